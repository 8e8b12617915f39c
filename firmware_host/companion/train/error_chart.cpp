#include "firmware_host/companion/train/error_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

namespace {

constexpr int kWidth = 960;
constexpr int kHeight = 560;
const cv::Rect kBox(84, 56, kWidth - 84 - 200, kHeight - 56 - 70);
const cv::Scalar kInk{60, 60, 60};
const cv::Scalar kGrid{225, 225, 225};

struct Axes {
    double first = 0.0;
    double last = 1.0;
    double highest = 1.0;

    [[nodiscard]] cv::Point at(double count, double error) const {
        const double x = (count - first) / std::max(1e-9, last - first);
        return {kBox.x + cvRound(x * kBox.width),
                kBox.y + kBox.height - cvRound(error / highest * kBox.height)};
    }
};

void write_text(cv::Mat& picture, const std::string& text, cv::Point at, double size) {
    cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

// 1, 2 or 5 times a power of ten, at least a fifth of the range.
double round_step(double range) {
    const double power = std::pow(10.0, std::floor(std::log10(range / 5.0)));
    for (const double digit : {1.0, 2.0, 5.0}) {
        if (digit * power >= range / 5.0) return digit * power;
    }
    return 10.0 * power;
}

Axes axes_of(const std::vector<ErrorLine>& lines) {
    Axes axes{HUGE_VAL, 0.0, 0.0};
    for (const ErrorLine& line : lines) {
        for (std::size_t i = 0; i < line.counts.size(); ++i) {
            axes.first = std::min(axes.first, line.counts[i]);
            axes.last = std::max(axes.last, line.counts[i]);
            axes.highest = std::max(axes.highest, line.errors[i]);
        }
    }
    axes.highest = axes.highest > 0.0 ? 1.1 * axes.highest : 1.0;
    return axes;
}

void draw_axes(const Axes& axes, const std::string& count_label, const std::string& unit, cv::Mat& picture) {
    const double up = round_step(axes.highest);
    for (double y = 0.0; y <= axes.highest; y += up) {
        const cv::Point left = axes.at(axes.first, y);
        cv::line(picture, left, left + cv::Point(kBox.width, 0), kGrid, 1);
        write_text(picture, fmt::format("{:g}", y), {kBox.x - 52, left.y + 4}, 0.42);
    }
    const double along = std::max(1.0, round_step(std::max(1.0, axes.last - axes.first)));
    for (double x = std::ceil(axes.first / along) * along; x <= axes.last; x += along) {
        const cv::Point foot = axes.at(x, 0.0);
        cv::line(picture, foot, foot + cv::Point(0, 5), kInk, 1);
        write_text(picture, fmt::format("{:g}", x), {foot.x - 8, foot.y + 22}, 0.42);
    }
    cv::rectangle(picture, kBox, kInk, 1);
    write_text(picture, count_label, {kBox.x + kBox.width / 2 - 60, kBox.y + kBox.height + 50}, 0.5);
    write_text(picture, unit, {12, kBox.y - 12}, 0.46);
}

}  // namespace

Result<void, FileError> draw_errors(const std::filesystem::path& path, const std::vector<ErrorLine>& lines,
                                    const std::string& title, const std::string& count_label,
                                    const std::string& unit) {
    cv::Mat picture(kHeight, kWidth, CV_8UC3, cv::Scalar(255, 255, 255));
    const Axes axes = axes_of(lines);
    write_text(picture, title, {kBox.x, 28}, 0.6);
    draw_axes(axes, count_label, unit, picture);
    int legend = kBox.y + 14;
    for (const ErrorLine& line : lines) {
        const cv::Scalar colour(line.rgb[0], line.rgb[1], line.rgb[2]);
        for (std::size_t i = 0; i < line.counts.size(); ++i) {
            const cv::Point here = axes.at(line.counts[i], line.errors[i]);
            cv::circle(picture, here, line.counts.size() == 1 ? 6 : 3, colour, cv::FILLED, cv::LINE_AA);
            if (i > 0) {
                cv::line(picture, axes.at(line.counts[i - 1], line.errors[i - 1]), here, colour, 2,
                         cv::LINE_AA);
            }
        }
        const int x = kBox.x + kBox.width + 16;
        cv::line(picture, {x, legend - 4}, {x + 24, legend - 4}, colour, 3, cv::LINE_AA);
        write_text(picture, line.name, {x + 32, legend}, 0.44);
        legend += 24;
    }
    const std::vector<std::uint8_t> rgb(picture.datastart, picture.dataend);
    return write_rgb_image(path, picture.cols, picture.rows, rgb);
}

}  // namespace rig::host
