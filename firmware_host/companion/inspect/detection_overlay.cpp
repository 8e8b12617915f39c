#include "firmware_host/companion/inspect/detection_overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>
#include <system_error>

#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

constexpr int kShift = 4;  // OpenCV draws at sixteenths of a pixel
constexpr int kLargestDoubled_px = 1280;
constexpr int kLegendRows = 26;
constexpr double kWindow = 0.75;   // half side in diameters: the blob and some skin, and no neighbour
constexpr double kAir_px = 2.0;    // ... and for the blur of a small one
constexpr double kLongest = 3.0;   // half axes in radii; more is another thing in the window
constexpr int kLeastContrast = 6;  // grey levels between blob and skin

struct Window {
    int left, top, right, bottom;  // inside the image, ends included
};

Window window_around(const GreyImage& image, const Observation& seen) {
    const double half = kWindow * static_cast<double>(seen.diameter_px) + kAir_px;
    const auto x = static_cast<double>(seen.x_px);
    const auto y = static_cast<double>(seen.y_px);
    return {std::max(0, cvFloor(x - half)), std::max(0, cvFloor(y - half)),
            std::min(image.width_px - 1, cvCeil(x + half)), std::min(image.height_px - 1, cvCeil(y + half))};
}

int pixel(const GreyImage& image, int x, int y) {
    return image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                        static_cast<std::size_t>(x)];
}

// Median of the window's rim.
int skin_around(const GreyImage& image, const Window& w) {
    std::vector<int> rim;
    for (int x = w.left; x <= w.right; ++x) {
        rim.push_back(pixel(image, x, w.top));
        rim.push_back(pixel(image, x, w.bottom));
    }
    for (int y = w.top; y <= w.bottom; ++y) {
        rim.push_back(pixel(image, w.left, y));
        rim.push_back(pixel(image, w.right, y));
    }
    std::ranges::nth_element(rim, rim.begin() + static_cast<std::ptrdiff_t>(rim.size() / 2));
    return rim[rim.size() / 2];
}

cv::Scalar colour_of(double score) {
    const double s = std::clamp(score, 0.0, 1.0);
    return {255.0 * std::min(1.0, 2.0 - 2.0 * s), 255.0 * std::min(1.0, 2.0 * s), 40.0};
}

void draw_legend(cv::Mat& picture, std::size_t count) {
    const int y = picture.rows - kLegendRows;
    cv::rectangle(picture, {0, y}, {picture.cols, picture.rows}, {24, 24, 24}, cv::FILLED);
    const auto text = [&](const std::string& words, int x) {
        cv::putText(picture, words, {x, y + 17}, cv::FONT_HERSHEY_SIMPLEX, 0.42, {235, 235, 235}, 1,
                    cv::LINE_AA);
    };
    text(fmt::format("{} observations", count), 8);
    text("score 0", 150);
    for (int i = 0; i < 100; ++i)
        cv::line(picture, {210 + i, y + 8}, {210 + i, y + 17}, colour_of(0.01 * i), 1);
    text("1", 318);
}

}  // namespace

BlobEllipse measure_ellipse(const GreyImage& image, const Observation& seen) {
    const double radius = 0.5 * static_cast<double>(seen.diameter_px);
    const BlobEllipse circle{radius, radius, 0.0};
    const Window w = window_around(image, seen);
    if (w.right - w.left < 2 || w.bottom - w.top < 2) return circle;
    const int skin = skin_around(image, w);
    const int x0 = std::clamp(cvRound(seen.x_px), w.left, w.right);
    const int y0 = std::clamp(cvRound(seen.y_px), w.top, w.bottom);
    const int depth = pixel(image, x0, y0) - skin;
    if (std::abs(depth) < kLeastContrast) return circle;
    const double reach = kWindow * static_cast<double>(seen.diameter_px) + 0.5 * kAir_px;
    double sum = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
    for (int y = w.top; y <= w.bottom; ++y) {
        for (int x = w.left; x <= w.right; ++x) {
            // 0 on skin, 1 in the middle; what is paler is blur, noise or shade
            const double share = static_cast<double>(pixel(image, x, y) - skin) / depth;
            const double dx = x - static_cast<double>(seen.x_px);
            const double dy = y - static_cast<double>(seen.y_px);
            if (dx * dx + dy * dy > reach * reach) continue;  // shade in the window's corners
            const double weight = std::clamp(3.0 * share - 1.0, 0.0, 1.0);
            sum += weight;
            sx += weight * dx;
            sy += weight * dy;
            sxx += weight * dx * dx;
            sxy += weight * dx * dy;
            syy += weight * dy * dy;
        }
    }
    if (sum < 3.0) return circle;
    const double vxx = sxx / sum - (sx / sum) * (sx / sum);
    const double vyy = syy / sum - (sy / sum) * (sy / sum);
    const double vxy = sxy / sum - (sx / sum) * (sy / sum);
    const double mean = 0.5 * (vxx + vyy);
    const double spread = std::hypot(0.5 * (vxx - vyy), vxy);
    BlobEllipse out;  // a filled ellipse's variance along an axis is a quarter of that half axis squared
    out.major_px = 2.0 * std::sqrt(std::max(0.0, mean + spread));
    out.minor_px = 2.0 * std::sqrt(std::max(0.0, mean - spread));
    out.angle_rad = 0.5 * std::atan2(2.0 * vxy, vxx - vyy);
    const bool plausible = out.minor_px > radius / kLongest && out.major_px < radius * kLongest;
    return plausible ? out : circle;
}

Result<std::vector<fs::path>, FileError> overlay_paths(const fs::path& wanted,
                                                       const std::vector<fs::path>& images) {
    std::error_code ignored;
    const bool folder = fs::is_directory(wanted, ignored) || !wanted.has_filename();
    if (!folder && wanted.extension() != ".png") {
        return file_failure(wanted,
                            wanted.has_extension()
                                ? "name the overlay .png, or name a folder for one overlay each"
                                : "no such folder; make it, end the name with / to have it made, or name a "
                                  ".png");
    }
    std::vector<fs::path> paths;
    std::set<fs::path> taken;
    for (const fs::path& image : images) {
        const std::string stem = image.stem().string();
        fs::path path = wanted;
        if (folder)
            path = wanted / (stem + ".png");
        else if (images.size() > 1)
            path = wanted.parent_path() / (wanted.stem().string() + "_" + stem + ".png");
        if (!taken.insert(path).second) {
            return file_failure(image,
                                fmt::format("another image is called {} too, and both overlays would be {}; "
                                            "look at one folder at a time",
                                            stem, path.string()));
        }
        paths.push_back(std::move(path));
    }
    for (const fs::path& path : paths) {
        for (const fs::path& image : images) {
            if (fs::equivalent(path, image, ignored) && !ignored)
                return file_failure(path,
                                    "the overlay would replace an image that is read; give it another name");
        }
    }
    if (folder) {
        if (const auto made = make_folder(wanted); !made) return failure(made.error());
    }
    return paths;
}

Result<void, FileError> draw_detections(const fs::path& path, const GreyImage& image,
                                        std::span<const Observation> observations) {
    const double zoom = std::max(image.width_px, image.height_px) <= kLargestDoubled_px ? 2.0 : 1.0;
    const cv::Mat grey(image.height_px, image.width_px, CV_8UC1,
                       const_cast<std::uint8_t*>(image.pixels.data()));
    cv::Mat picture(cvRound(zoom * image.height_px) + kLegendRows, cvRound(zoom * image.width_px), CV_8UC3);
    cv::Mat view = picture(cv::Rect(0, 0, picture.cols, picture.rows - kLegendRows));
    cv::Mat large;
    cv::resize(grey, large, view.size(), 0.0, 0.0, cv::INTER_NEAREST);
    cv::cvtColor(large, view, cv::COLOR_GRAY2RGB);
    const auto fixed = [&](double px) { return cvRound(((px + 0.5) * zoom - 0.5) * (1 << kShift)); };
    for (std::size_t i = 0; i < observations.size(); ++i) {
        const Observation& seen = observations[i];
        const BlobEllipse ellipse = measure_ellipse(image, seen);
        const cv::Point at(fixed(static_cast<double>(seen.x_px)), fixed(static_cast<double>(seen.y_px)));
        const cv::Scalar colour = colour_of(static_cast<double>(seen.score));
        const auto axis = [&](double px) { return cvRound((px * zoom + 1.0) * (1 << kShift)); };
        cv::ellipse(view, at, {axis(ellipse.major_px), axis(ellipse.minor_px)},
                    ellipse.angle_rad * 180.0 / std::numbers::pi, 0.0, 360.0, colour, 1, cv::LINE_AA, kShift);
        const int arm = 3 << kShift;
        cv::line(view, at - cv::Point(arm, 0), at + cv::Point(arm, 0), {80, 200, 255}, 1, cv::LINE_AA,
                 kShift);
        cv::line(view, at - cv::Point(0, arm), at + cv::Point(0, arm), {80, 200, 255}, 1, cv::LINE_AA,
                 kShift);
        const int off = cvRound(ellipse.major_px * zoom * std::numbers::sqrt2 / 2.0) + 3;
        const cv::Point label((at.x >> kShift) + off, (at.y >> kShift) - off);
        const std::string number = std::to_string(i);
        cv::putText(view, number, label, cv::FONT_HERSHEY_SIMPLEX, 0.34, {0, 0, 0}, 3, cv::LINE_AA);
        cv::putText(view, number, label, cv::FONT_HERSHEY_SIMPLEX, 0.34, {255, 255, 190}, 1, cv::LINE_AA);
    }
    draw_legend(picture, observations.size());
    const std::vector<std::uint8_t> rgb(picture.datastart, picture.dataend);
    return write_rgb_image(path, picture.cols, picture.rows, rgb);
}

}  // namespace rig::host
