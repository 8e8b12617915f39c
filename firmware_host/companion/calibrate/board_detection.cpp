#include "firmware_host/companion/calibrate/board_detection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware_host/companion/calibrate/corner_fit.hpp"

namespace rig::host {

namespace {

constexpr double kLeastNeighbour_px = 6.0;  // between circles: less and a window holds its neighbour

// Distance to the nearest other point.
std::vector<double> neighbour_distances(const std::vector<cv::Point2f>& points) {
    std::vector<double> distances(points.size(), 1e9);
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = 0; j < points.size(); ++j) {
            if (i != j) distances[i] = std::min(distances[i], cv::norm(points[i] - points[j]));
        }
    }
    return distances;
}

double median_of(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

cv::Rect window_around(const cv::Mat& grey, const cv::Point2d& centre, double half_px) {
    const int half = cvCeil(half_px);
    const cv::Rect wanted(cvRound(centre.x) - half, cvRound(centre.y) - half, 2 * half + 1, 2 * half + 1);
    return wanted & cv::Rect(0, 0, grey.cols, grey.rows);
}

// Blur of a circle's rim as a standard deviation: a step of height h behind a Gaussian of sigma rises by
// h / (sigma sqrt(2 pi)) a pixel. The gradient is taken along eight directions and the worst counts, so that
// motion blur shows.
double edge_sigma_px(const cv::Mat& grey, const cv::Point2f& centre, double half_px) {
    constexpr int kDirections = 8;
    const cv::Rect window =
        window_around(grey, centre, half_px) & cv::Rect(1, 1, grey.cols - 2, grey.rows - 2);
    if (window.width < 3 || window.height < 3) return 0.0;
    std::array<double, kDirections> steepest{};
    int low = 255;
    int high = 0;
    for (int y = window.y; y < window.y + window.height; ++y) {
        for (int x = window.x; x < window.x + window.width; ++x) {
            low = std::min<int>(low, grey.at<std::uint8_t>(y, x));
            high = std::max<int>(high, grey.at<std::uint8_t>(y, x));
            const double dx = 0.5 * (grey.at<std::uint8_t>(y, x + 1) - grey.at<std::uint8_t>(y, x - 1));
            const double dy = 0.5 * (grey.at<std::uint8_t>(y + 1, x) - grey.at<std::uint8_t>(y - 1, x));
            for (int d = 0; d < kDirections; ++d) {
                const double angle = CV_PI * d / kDirections;
                auto& best = steepest[static_cast<std::size_t>(d)];
                best = std::max(best, std::abs(dx * std::cos(angle) + dy * std::sin(angle)));
            }
        }
    }
    const double least = *std::ranges::min_element(steepest);
    return least > 0.0 ? (high - low) / (least * std::sqrt(2.0 * CV_PI)) : half_px;
}

// Centroid of what is darker than half way between ink and paper, with a soft threshold [the detector's
// rule].
cv::Point2d dark_centroid(const cv::Mat& grey, cv::Point2d centre, double half_px) {
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
        const cv::Rect window = window_around(grey, centre, half_px);
        if (window.width < 3 || window.height < 3) return centre;
        double low = 0.0;
        double high = 0.0;
        cv::minMaxLoc(grey(window), &low, &high);
        const double ink = low + 0.1 * (high - low);
        const double paper = high - 0.1 * (high - low);
        double sum = 0.0;
        double sum_x = 0.0;
        double sum_y = 0.0;
        for (int y = window.y; y < window.y + window.height; ++y) {
            for (int x = window.x; x < window.x + window.width; ++x) {
                if (std::hypot(x - centre.x, y - centre.y) > half_px) continue;
                const double depth = (paper - grey.at<std::uint8_t>(y, x)) / std::max(1.0, paper - ink);
                const double weight = std::clamp(2.0 * depth - 0.5, 0.0, 1.0);
                sum += weight;
                sum_x += weight * x;
                sum_y += weight * y;
            }
        }
        if (!(sum > 0.0)) return centre;
        centre = {sum_x / sum, sum_y / sum};
    }
    return centre;
}

struct Found {
    std::vector<std::size_t> numbers;
    std::vector<Vec2> at;
    std::vector<double> blur_px;
    std::string fault;
};

// Outer corners of a marker on the board, clockwise from the upper left, as OpenCV finds them.
std::array<cv::Point2f, 4> marker_corners(const BoardSpec& board, int number) {
    // White squares row by row: with an odd number of columns rows hold one more or less in turn.
    int x = 0;
    int y = 0;
    int before = number;
    for (;; ++y) {
        const int whites = y % 2 == 0 ? board.columns / 2 : (board.columns + 1) / 2;
        if (before < whites) break;
        before -= whites;
    }
    x = 2 * before + (y % 2 == 0 ? 1 : 0);
    const double gap = 0.5 * (board.spacing_mm - board.mark_mm);
    const auto left = static_cast<float>(x * board.spacing_mm + gap);
    const auto top = static_cast<float>(y * board.spacing_mm + gap);
    const auto side = static_cast<float>(board.mark_mm);
    return {cv::Point2f(left, top), {left + side, top}, {left + side, top + side}, {left, top + side}};
}

// The corner as each marker beside it foretells it, and what a square looks like there.
struct Foretold {
    double weight = 0.0;
    Vec2 at = Vec2::Zero();
    Mat2 px_from_square = Mat2::Zero();
};

Vec2 mapped(const cv::Mat& homography, double x, double y) {
    const cv::Vec3d at = cv::Mat(homography * cv::Vec3d(x, y, 1.0));
    return {at[0] / at[2], at[1] / at[2]};
}

void foretell(const BoardSpec& board, const std::vector<BoardPoint>& points, int number,
              const std::vector<cv::Point2f>& seen, std::vector<Foretold>& corners) {
    const auto flat = marker_corners(board, number);
    const cv::Mat homography = cv::getPerspectiveTransform(flat.data(), seen.data());
    const double middle_x = 0.5 * static_cast<double>(flat[0].x + flat[2].x);
    const double middle_y = 0.5 * static_cast<double>(flat[0].y + flat[2].y);
    const double s = board.spacing_mm;
    for (std::size_t i = 0; i < points.size(); ++i) {
        // The four corners of the marker's own square.
        if (std::abs(points[i].x_mm - middle_x) > 0.6 * s || std::abs(points[i].y_mm - middle_y) > 0.6 * s)
            continue;
        const double x = points[i].x_mm;
        const double y = points[i].y_mm;
        corners[i].weight += 1.0;
        corners[i].at += mapped(homography, x, y);
        corners[i].px_from_square.col(0) +=
            (mapped(homography, x + 0.25 * s, y) - mapped(homography, x - 0.25 * s, y)) / 0.5;
        corners[i].px_from_square.col(1) +=
            (mapped(homography, x, y + 0.25 * s) - mapped(homography, x, y - 0.25 * s)) / 0.5;
    }
}

Found find_charuco(const cv::Mat& grey, const BoardSpec& board) {
    Found found;
    const auto dictionary = cv::aruco::getPredefinedDictionary(dictionary_number(board.dictionary));
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> numbers;
    cv::aruco::detectMarkers(grey, dictionary, markers, numbers);
    if (numbers.empty()) {
        found.fault = "no marker of dictionary " + board.dictionary + " was found";
        return found;
    }
    const int held = board.columns * board.rows / 2;
    if (std::ranges::any_of(numbers, [&](int number) { return number >= held; })) {
        found.fault = fmt::format("it shows marker {}, and the board's are 0 to {}",
                                  std::ranges::max(numbers), held - 1);
        return found;
    }
    const std::vector<BoardPoint> points = board_points(board);
    std::vector<Foretold> corners(points.size());
    for (std::size_t m = 0; m < numbers.size(); ++m) foretell(board, points, numbers[m], markers[m], corners);
    const ImageView view{grey.data, grey.cols, grey.rows, static_cast<std::ptrdiff_t>(grey.step)};
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!(corners[i].weight > 0.0)) continue;
        const CornerFit fit = fit_corner(
            view, {corners[i].at / corners[i].weight, corners[i].px_from_square / corners[i].weight,
                   0.5 * (1.0 - board.mark_mm / board.spacing_mm)});
        if (!fit.ok) continue;
        found.numbers.push_back(i);
        found.at.push_back(fit.at_px);
        found.blur_px.push_back(fit.blur_px);
    }
    if (found.at.empty())
        found.fault = fmt::format("{} markers were found, but no sharp corner between them", numbers.size());
    return found;
}

Found find_circles(const cv::Mat& grey, const BoardSpec& board) {
    Found found;
    const cv::Size size(board.columns, board.rows);
    std::vector<cv::Point2f> rough;
    if (!cv::findCirclesGrid(grey, size, rough, cv::CALIB_CB_ASYMMETRIC_GRID) &&
        !cv::findCirclesGrid(grey, size, rough, cv::CALIB_CB_ASYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING)) {
        found.fault = fmt::format("no grid of {} circles was found; all of them must be in the picture",
                                  board.columns * board.rows);
        return found;
    }
    const std::vector<double> neighbours = neighbour_distances(rough);
    if (median_of(neighbours) < kLeastNeighbour_px) {
        found.fault = "the board is too small in the picture; hold it nearer";
        return found;
    }
    for (std::size_t i = 0; i < rough.size(); ++i) {
        const double half = 0.5 * neighbours[i];  // up to the middle between two circles
        const cv::Point2d at = dark_centroid(grey, rough[i], half);
        const bool inside =
            at.x >= half && at.y >= half && at.x <= grey.cols - 1 - half && at.y <= grey.rows - 1 - half;
        if (!inside ||
            std::hypot(at.x - static_cast<double>(rough[i].x), at.y - static_cast<double>(rough[i].y)) > half)
            continue;
        found.numbers.push_back(i);
        found.at.emplace_back(at.x, at.y);
        found.blur_px.push_back(edge_sigma_px(grey, rough[i], half));
    }
    return found;
}

BoardSighting searched(const cv::Mat& grey, const BoardSpec& board) {
    const Found found =
        board.kind == BoardKind::kCharuco ? find_charuco(grey, board) : find_circles(grey, board);
    BoardSighting sighting;
    sighting.fault = found.fault;
    sighting.points = found.numbers;
    for (const Vec2& at : found.at) {
        sighting.x_px.push_back(at[0]);
        sighting.y_px.push_back(at[1]);
    }
    sighting.edge_sigma_px = median_of(found.blur_px);
    if (sighting.points.empty() && sighting.fault.empty())
        sighting.fault = "no point of the board could be measured";
    return sighting;
}

}  // namespace

BoardSighting find_board(const ImageView& image, const BoardSpec& board) {
    const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                       static_cast<std::size_t>(image.stride_bytes));
    try {
        return searched(grey, board);
    } catch (const cv::Exception& error) {
        BoardSighting sighting;
        sighting.fault = "OpenCV gave up on it: " + printable(error.err);
        return sighting;
    }
}

}  // namespace rig::host
