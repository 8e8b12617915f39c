#include "firmware_host/companion/demo/pictures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kRunUpFrames = 12;
constexpr double kZoom = 2.0;
constexpr int kShift = 4;  // OpenCV draws at sixteenths of a pixel

const cv::Scalar kRing{90, 220, 90};
const cv::Scalar kCross{255, 80, 80};
const cv::Scalar kNameless{255, 200, 60};
const cv::Scalar kLabel{255, 255, 160};

// Panels of draw_curves.
constexpr int kColumns = 2;
constexpr int kPanelWidth = 860;
constexpr int kPanelHeight = 190;
constexpr int kMargin = 46;
constexpr int kTitleHeight = 64;

struct CameraImages {
    std::vector<std::vector<std::uint8_t>> pixels;
    std::vector<std::vector<MarkerSight>> sights;
};

void render_all(const World& world, WorldRenderer& renderer, std::size_t frame, CameraImages& images) {
    for (std::size_t c = 0; c < world.cameras().size(); ++c) {
        renderer.render(frame, c, CameraControl{}, images.pixels[c], images.sights[c]);
    }
}

FrameSet frame_set(const World& world, std::size_t frame, const CameraImages& images) {
    FrameSet set;
    set.capture_us =
        static_cast<std::int64_t>(std::llround(static_cast<double>(frame) * 1e6 / world.config().rate_hz));
    set.camera_count = static_cast<std::uint8_t>(world.cameras().size());
    for (std::size_t c = 0; c < world.cameras().size(); ++c) {
        const HelmetCamera& camera = world.cameras()[c];
        set.images[c] =
            ImageView{images.pixels[c].data(), camera.width_px, camera.height_px, camera.width_px};
        set.status[c] = CameraStatus::kGood;
    }
    return set;
}

cv::Point fixed(double x_px, double y_px) {
    const auto scaled = [](double px) { return cvRound(((px + 0.5) * kZoom - 0.5) * (1 << kShift)); };
    return {scaled(x_px), scaled(y_px)};
}

void draw_names(const Pipeline& pipeline, const SolvePack& pack, std::size_t camera, cv::Mat& picture) {
    const Observations& seen = pipeline.observations(camera);
    std::vector<int> name_of(seen.size(), -1);
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const std::int16_t at = pipeline.matches()[camera][k];
        if (at >= 0 && static_cast<std::size_t>(at) < seen.size())
            name_of[static_cast<std::size_t>(at)] = static_cast<int>(k);
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const cv::Point at = fixed(static_cast<double>(seen[i].x_px), static_cast<double>(seen[i].y_px));
        const int radius =
            cvRound((0.5 * static_cast<double>(seen[i].diameter_px) + 2.0) * kZoom * (1 << kShift));
        const cv::Point plain(at.x >> kShift, at.y >> kShift);
        if (name_of[i] < 0) {
            const cv::Point half(radius >> kShift, radius >> kShift);
            cv::rectangle(picture, plain - half, plain + half, kNameless, 1, cv::LINE_AA);
            continue;
        }
        cv::circle(picture, at, radius, kRing, 1, cv::LINE_AA, kShift);
        const std::string name(pack.marker_names[static_cast<std::size_t>(name_of[i])]);
        cv::putText(picture, name, plain + cv::Point((radius >> kShift) + 2, -2), cv::FONT_HERSHEY_SIMPLEX,
                    0.36, kLabel, 1, cv::LINE_AA);
    }
}

void draw_truth(const std::vector<MarkerSight>& sights, cv::Mat& picture) {
    for (const MarkerSight& sight : sights) {
        if (!sight.visible) continue;
        const cv::Point at = fixed(sight.x_px, sight.y_px);
        const int arm = 4 << kShift;
        cv::line(picture, at - cv::Point(arm, 0), at + cv::Point(arm, 0), kCross, 1, cv::LINE_AA, kShift);
        cv::line(picture, at - cv::Point(0, arm), at + cv::Point(0, arm), kCross, 1, cv::LINE_AA, kShift);
    }
}

cv::Mat enlarged(const HelmetCamera& camera, std::vector<std::uint8_t>& pixels) {
    const cv::Mat grey(camera.height_px, camera.width_px, CV_8UC1, pixels.data());
    cv::Mat picture;
    cv::resize(grey, picture, {}, kZoom, kZoom, cv::INTER_LINEAR);
    cv::cvtColor(picture, picture, cv::COLOR_GRAY2RGB);
    return picture;
}

Result<void, FileError> save(const std::filesystem::path& path, const cv::Mat& picture) {
    const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();
    const std::vector<std::uint8_t> rgb(whole.datastart, whole.dataend);
    return write_rgb_image(path, whole.cols, whole.rows, rgb);
}

void draw_line(const std::vector<double>& values, const cv::Rect& box, const cv::Scalar& colour,
               int thickness, cv::Mat& picture) {
    const double step =
        static_cast<double>(box.width) / static_cast<double>(std::max<std::size_t>(1, values.size() - 1));
    for (std::size_t i = 1; i < values.size(); ++i) {
        if (std::isnan(values[i]) || std::isnan(values[i - 1])) continue;
        const auto point = [&](std::size_t at) {
            const double x = box.x + step * static_cast<double>(at);
            const double y = box.y + box.height * (1.0 - values[at]);
            return cv::Point(cvRound(x * (1 << kShift)), cvRound(y * (1 << kShift)));
        };
        cv::line(picture, point(i - 1), point(i), colour, thickness, cv::LINE_AA, kShift);
    }
}

void draw_text(cv::Mat& picture, const std::string& text, cv::Point at, double size,
               const cv::Scalar& colour) {
    cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

void draw_panel(const Curve& curve, const cv::Rect& cell, double rate_hz, cv::Mat& picture) {
    const cv::Scalar grid{225, 225, 225};
    const cv::Scalar ink{60, 60, 60};
    const cv::Rect box(cell.x + kMargin, cell.y + 26, cell.width - kMargin - 16, cell.height - 58);
    for (int i = 0; i <= 4; ++i) {
        const int y = box.y + box.height - box.height * i / 4;
        cv::line(picture, {box.x, y}, {box.x + box.width, y}, grid, 1);
        if (i % 2 == 0) draw_text(picture, fmt::format("{:.1f}", 0.25 * i), {box.x - 34, y + 4}, 0.38, ink);
    }
    const double seconds = static_cast<double>(curve.truth.size()) / rate_hz;
    const double tick_s = seconds > 30.0 ? 10.0 : seconds > 8.0 ? 2.0 : 0.5;
    for (double t = 0.0; t <= seconds; t += tick_s) {
        const int x = box.x + cvRound(box.width * t / seconds);
        cv::line(picture, {x, box.y + box.height}, {x, box.y + box.height + 4}, ink, 1);
        draw_text(picture, fmt::format("{:g} s", t), {x - 10, box.y + box.height + 18}, 0.36, ink);
    }
    draw_line(curve.truth, box, {170, 170, 170}, 4, picture);
    draw_line(curve.solved, box, {200, 40, 40}, 1, picture);
    draw_text(picture, fmt::format("{}   rms {:.3f}", curve.name, curve.rms), {box.x, cell.y + 18}, 0.48,
              ink);
}

}  // namespace

Result<void, FileError> draw_overlay(const std::filesystem::path& path, const World& world,
                                     const SolvePack& pack, std::size_t frame) {
    CameraImages images;
    images.pixels.assign(world.cameras().size(), std::vector<std::uint8_t>(world.image_bytes()));
    images.sights.assign(world.cameras().size(), std::vector<MarkerSight>(world.marker_count()));
    const auto pipeline = std::make_unique<Pipeline>();
    PipelineConfig config;
    config.rate_hz = world.config().rate_hz;
    if (!pipeline->configure(pack, config))
        return failure(FileError{path.string() + ": the solver refuses the pack"});
    const auto renderer = std::make_unique<WorldRenderer>(world);
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    for (std::size_t f = frame > kRunUpFrames ? frame - kRunUpFrames : 0; f <= frame; ++f) {
        render_all(world, *renderer, f, images);
        pipeline->step(frame_set(world, f, images), *state, *report);
    }
    std::vector<cv::Mat> views;
    for (std::size_t c = 0; c < world.cameras().size(); ++c) {
        cv::Mat picture = enlarged(world.cameras()[c], images.pixels[c]);
        draw_truth(images.sights[c], picture);
        draw_names(*pipeline, pack, c, picture);
        draw_text(picture,
                  fmt::format("camera {}  frame {}  {} detections", world.cameras()[c].name, frame,
                              report->observations[c]),
                  {12, 22}, 0.55, {255, 255, 255});
        views.push_back(picture);
    }
    cv::Mat whole;
    cv::hconcat(views, whole);
    draw_text(whole, "ring + name: detected and named   square: no name   cross: true place",
              {12, whole.rows - 12}, 0.5, {255, 255, 255});
    return save(path, whole);
}

Result<void, FileError> draw_curves(const std::filesystem::path& path, const std::vector<Curve>& curves,
                                    double rate_hz, const std::string& title) {
    const int rows = static_cast<int>((curves.size() + kColumns - 1) / kColumns);
    cv::Mat picture(kTitleHeight + rows * kPanelHeight, kColumns * kPanelWidth, CV_8UC3,
                    cv::Scalar(255, 255, 255));
    draw_text(picture, title, {kMargin, 28}, 0.62, {20, 20, 20});
    cv::line(picture, {kMargin, 48}, {kMargin + 40, 48}, {170, 170, 170}, 4, cv::LINE_AA);
    draw_text(picture, "true", {kMargin + 48, 53}, 0.45, {60, 60, 60});
    cv::line(picture, {kMargin + 120, 48}, {kMargin + 160, 48}, {200, 40, 40}, 1, cv::LINE_AA);
    draw_text(picture, "solved on the rig, received by the host", {kMargin + 168, 53}, 0.45, {60, 60, 60});
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const int column = static_cast<int>(i) % kColumns;
        const int row = static_cast<int>(i) / kColumns;
        const cv::Rect cell(column * kPanelWidth, kTitleHeight + row * kPanelHeight, kPanelWidth,
                            kPanelHeight);
        draw_panel(curves[i], cell, rate_hz, picture);
    }
    return save(path, picture);
}

}  // namespace rig::host
