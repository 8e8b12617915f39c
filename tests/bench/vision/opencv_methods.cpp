#include "tests/bench/vision/opencv_methods.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace rig::bench {

namespace {

cv::Mat matrix(const ImageView& image) {
    return {image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
            static_cast<std::size_t>(image.stride_bytes)};
}

cv::Mat adaptive_mask(const ImageView& image, bool bright, double step) {
    constexpr int kBlock = 31;  // three dots of 10 px
    cv::Mat mask;
    cv::adaptiveThreshold(matrix(image), mask, 255, cv::ADAPTIVE_THRESH_MEAN_C,
                          bright ? cv::THRESH_BINARY : cv::THRESH_BINARY_INV, kBlock, bright ? -step : step);
    return mask;
}

}  // namespace

void use_one_thread() {
    cv::setNumThreads(1);
}

std::vector<test::SeenDot> simple_blob_detector(const ImageView& image, bool bright) {
    cv::SimpleBlobDetector::Params params;
    params.minThreshold = 10;
    params.maxThreshold = 220;
    params.thresholdStep = 10;
    params.minDistBetweenBlobs = 6;
    params.filterByColor = true;
    params.blobColor = bright ? 255 : 0;
    params.filterByArea = true;
    params.minArea = static_cast<float>(kLeastArea);
    params.maxArea = static_cast<float>(kMostArea);
    params.filterByCircularity = false;
    params.filterByInertia = true;
    params.minInertiaRatio = 0.08F;
    params.filterByConvexity = true;
    params.minConvexity = 0.8F;
    std::vector<cv::KeyPoint> points;
    cv::SimpleBlobDetector::create(params)->detect(matrix(image), points);
    std::vector<test::SeenDot> seen;
    for (const cv::KeyPoint& point : points)
        seen.push_back({static_cast<double>(point.pt.x), static_cast<double>(point.pt.y)});
    return seen;
}

std::vector<test::SeenDot> threshold_contours(const ImageView& image, bool bright, double step) {
    std::vector<std::vector<cv::Point>> contours;
    std::vector<cv::Vec4i> hierarchy;
    // Not RETR_EXTERNAL: the outline of a head would hide every dot on it.
    cv::findContours(adaptive_mask(image, bright, step), contours, hierarchy, cv::RETR_CCOMP,
                     cv::CHAIN_APPROX_NONE);
    std::vector<test::SeenDot> seen;
    for (std::size_t i = 0; i < contours.size(); ++i) {
        const auto& contour = contours[i];
        if (hierarchy[i][3] >= 0) continue;  // a hole
        const cv::Moments m = cv::moments(contour);
        const double length = cv::arcLength(contour, true);
        if (m.m00 < kLeastArea || m.m00 > kMostArea || 12.566 * m.m00 < 0.5 * length * length) continue;
        seen.push_back({m.m10 / m.m00, m.m01 / m.m00});
    }
    return seen;
}

std::vector<test::SeenDot> threshold_components(const ImageView& image, bool bright) {
    cv::Mat labels;
    cv::Mat stats;
    cv::Mat centroids;
    const int count =
        cv::connectedComponentsWithStats(adaptive_mask(image, bright, kUsualStep), labels, stats, centroids);
    std::vector<test::SeenDot> seen;
    for (int i = 1; i < count; ++i) {
        const double area = stats.at<int>(i, cv::CC_STAT_AREA);
        const double width = stats.at<int>(i, cv::CC_STAT_WIDTH);
        const double height = stats.at<int>(i, cv::CC_STAT_HEIGHT);
        if (area < kLeastArea || area > kMostArea || std::max(width, height) > 3.0 * std::min(width, height))
            continue;
        if (area < 0.5 * width * height) continue;
        seen.push_back({centroids.at<double>(i, 0), centroids.at<double>(i, 1)});
    }
    return seen;
}

std::size_t threshold_count(const ImageView& image, bool bright) {
    constexpr std::uint8_t kLevel = 60;
    std::size_t count = 0;
    for (int y = 0; y < image.height_px; ++y) {
        const std::uint8_t* pixels = image.row(y);
        std::uint32_t row = 0;
        for (int x = 0; x < image.width_px; ++x) row += (pixels[x] > kLevel) == bright ? 1U : 0U;
        count += row;
    }
    return count;
}

}  // namespace rig::bench
