#include "firmware_host/companion/calibrate/coverage_picture.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

namespace {

constexpr int kFields = 8;
constexpr int kTitleRows = 28;
constexpr int kLegendRows = 26;
constexpr double kWorst_px = 0.3;
constexpr double kLengthen = 100.0;

const cv::Scalar kNeverSeen(150, 150, 160);

cv::Scalar colour_of(double residual_px) {
    const double share = std::min(1.0, residual_px / kWorst_px);
    return {30.0 + 200.0 * share, 170.0 * (1.0 - share) + 20.0, 40.0};
}

void draw_legend(cv::Mat strip) {
    const cv::Scalar ink(60, 60, 60);
    const auto text = [&](const char* words, int x) {
        cv::putText(strip, words, {x, 17}, cv::FONT_HERSHEY_SIMPLEX, 0.42, ink, 1, cv::LINE_AA);
    };
    cv::rectangle(strip, {8, 7}, {20, 19}, kNeverSeen, cv::FILLED);
    text("board never seen here", 26);
    text("residual 0", 210);
    for (int i = 0; i < 80; ++i)
        cv::line(strip, {288 + i, 8}, {288 + i, 18}, colour_of(kWorst_px * i / 80.0), 1);
    text("0.3 px and more", 376);
}

// Pictures below 480 px are doubled, so that words fit.
double zoom_of(const CameraModel& camera) {
    return std::clamp(960.0 / camera.width_px, 0.5, 2.0);
}

}  // namespace

Result<void, FileError> draw_coverage(const std::filesystem::path& path, const Calibration& calibration,
                                      std::size_t camera, const std::string& title) {
    const CameraModel& model = calibration.cameras[camera];
    const double zoom = zoom_of(model);
    const int width = cvRound(zoom * model.width_px);
    const int height = cvRound(zoom * model.height_px);
    cv::Mat picture(height + kTitleRows + kLegendRows, width, CV_8UC3, cv::Scalar(245, 245, 245));
    cv::Mat view = picture(cv::Rect(0, kTitleRows, width, height));
    std::vector<int> counts(static_cast<std::size_t>(kFields) * kFields, 0);
    const auto field = [&](double at, int size) {
        return std::clamp(static_cast<int>((at + 0.5) / size * kFields), 0, kFields - 1);
    };
    for (const SeenPoint& seen : calibration.seen) {
        if (seen.camera != camera) continue;
        const int row = field(seen.at_px[1], model.height_px);
        ++counts[static_cast<std::size_t>(row * kFields + field(seen.at_px[0], model.width_px))];
    }
    for (int f = 0; f < kFields * kFields; ++f) {
        const int x = f % kFields;
        const int y = f / kFields;
        const cv::Rect place(cv::Point(x * width / kFields, y * height / kFields),
                             cv::Point((x + 1) * width / kFields, (y + 1) * height / kFields));
        const bool empty = counts[static_cast<std::size_t>(f)] == 0;
        cv::rectangle(view, place, empty ? kNeverSeen : cv::Scalar(252, 252, 252), cv::FILLED);
        cv::rectangle(view, place, cv::Scalar(220, 220, 220), 1);
    }
    constexpr int kShift = 4;
    const auto fixed = [&](double px) { return cvRound(((px + 0.5) * zoom - 0.5) * (1 << kShift)); };
    for (const SeenPoint& seen : calibration.seen) {
        if (seen.camera != camera) continue;
        const cv::Scalar colour = colour_of(seen.residual_px.norm());
        const cv::Point at(fixed(seen.at_px[0]), fixed(seen.at_px[1]));
        const Vec2 end = seen.at_px + kLengthen * seen.residual_px;
        cv::line(view, at, {fixed(end[0]), fixed(end[1])}, colour, 1, cv::LINE_AA, kShift);
        cv::circle(view, at, 2 << kShift, colour, cv::FILLED, cv::LINE_AA, kShift);
    }
    cv::putText(picture, title, {8, kTitleRows - 9}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(60, 60, 60), 1,
                cv::LINE_AA);
    draw_legend(picture(cv::Rect(0, kTitleRows + height, width, kLegendRows)));
    const std::vector<std::uint8_t> rgb(picture.datastart, picture.dataend);
    return write_rgb_image(path, picture.cols, picture.rows, rgb);
}

}  // namespace rig::host
