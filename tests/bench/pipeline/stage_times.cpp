#include "tests/bench/pipeline/stage_times.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/bench/thread_clock.hpp"
#include "tests/bench/vision/opencv_methods.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {
namespace {

constexpr std::size_t kCameras = 2;
constexpr std::size_t kMarkers = 60;
constexpr double kDotMm = 4.0;  // painted
constexpr double kRateHz = 60.0;

enum Stage : std::size_t {
    kDetect,
    kTrack,
    kStabilise,
    kInfer,
    kSolve,
    kRest,
    kAll,
    kVision,
    kOpenCv,
    kOpenCvUsual,
    kStages
};
constexpr std::array<const char*, kStages> kNames{
    "detect, two pictures",
    "track, rays included",
    "stabilise",
    "infer",
    "solve",
    "rest: smoothing, ladder, copies",
    "whole frame",
    "vision: detect to infer",
    "OpenCV threshold, findContours, the same two, told their contrast",
    "the same, with the step of bench_vision"};

SceneDot dot_of(const CameraModel& camera, const Vec3& position_mm, const Vec3& outward, double x_px,
                double y_px) {
    const Vec3 at = camera.camera_from_headset * (position_mm - camera.centre_mm);
    const Vec3 normal = camera.camera_from_headset * outward;
    SceneDot dot;
    dot.x_px = x_px;
    dot.y_px = y_px;
    dot.long_px = kDotMm * camera.fx_px / at[2];
    dot.short_px = dot.long_px * std::abs(normal.dot(at)) / at.norm();
    dot.angle_rad = std::atan2(normal[1], normal[0]) + 1.5707963267948966;  // foreshortened along the normal
    return dot;
}

std::vector<Picture> draw(const SyntheticFace& face, const SolvePack& pack, std::size_t frame) {
    const double time_s = static_cast<double>(frame) / kRateHz;
    SeededRandom random(7 + frame);
    const std::vector<Vec3> points = moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
    std::vector<Picture> pictures;
    for (std::size_t c = 0; c < kCameras; ++c) {
        const SyntheticFace::View view = face.observe(c, points, 0.0, 0.0, 0, random);
        Scene scene;
        scene.width_px = pack.cameras[c].width_px;
        scene.height_px = pack.cameras[c].height_px;
        scene.seed = 100 + c;  // the clutter stays where it is
        scene.clutter = {.lines = 10, .hairs = 20, .patches = 4, .shadows = 4, .silhouette = true};
        for (std::size_t i = 0; i < view.observations.size(); ++i) {
            const auto k = static_cast<std::size_t>(view.marker[i]);
            scene.dots.push_back(dot_of(pack.cameras[c], points[k], face.outward(k),
                                        static_cast<double>(view.observations[i].x_px),
                                        static_cast<double>(view.observations[i].y_px)));
        }
        pictures.push_back(render(scene));
    }
    return pictures;
}

// The stages as the pipeline strings them together, so that each can be timed: core has no clock.
class StageChain {
  public:
    explicit StageChain(const SolvePack& pack) : pack_(pack) {
        auto scratch = std::make_unique<ShapeModelWorkspace>();
        build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma, *scratch,
                          model_);
        auto gaussian_scratch = std::make_unique<FaceGaussianWorkspace>();
        build_face_gaussian(pack, model_, *gaussian_scratch, gaussian_);
        reset_inference(inference_);
        configure_solver(pack, kRateHz, solver_workspace_, solver_config_);
        reset_solver(solver_);
        tracker_config_.rate_hz = kRateHz;
        ok_ = true;
        for (Detector& detector : detectors_) {
            ok_ = ok_ && detector.configure({}).has_value();
            detector.reset();
        }
    }
    [[nodiscard]] bool ok() const { return ok_; }
    [[nodiscard]] std::size_t seen() const { return tracked_.seen; }
    // The last frame began the tracking or asked for one of the second opinions that follow.
    [[nodiscard]] bool starting() const { return starting_; }

    // us of each stage up to kSolve.
    void step(std::int64_t capture_us, const std::vector<Picture>& pictures,
              std::array<double, kStages>& times_us) {
        double last_us = bench::thread_cpu_us();
        const auto lap = [&](Stage stage) {
            const double now_us = bench::thread_cpu_us();
            times_us[stage] = now_us - last_us;
            last_us = now_us;
        };
        for (std::size_t c = 0; c < kCameras; ++c) {
            find_markers(c, pictures[c].view());
        }
        lap(kDetect);
        starting_ = !tracker_.tracking || tracker_.opinion.left > 0;
        sightings_.clear();
        named_ = NamedMarkers{};
        for (std::size_t c = 0; c < kCameras; ++c) {
            const CameraModel& camera = pack_.cameras[c];
            add_camera_view(camera, seen_[c].span(), kCentreSigmaPx, camera.centre_mm.norm(), sightings_);
        }
        track(model_, tracker_config_, sightings_, tracker_, tracker_workspace_, named_, tracked_);
        lap(kTrack);
        stabilise(model_, stabiliser_config_, named_, stabiliser_, stabiliser_workspace_, stabilised_,
                  stabiliser_report_);
        lap(kStabilise);
        infer_missing(gaussian_, stabilised_, inference_, completed_);
        lap(kInfer);
        solve(solver_config_, stabilised_, completed_, capture_us, solver_, solver_workspace_, solved_,
              solver_report_);
        lap(kSolve);
    }

  private:
    // A tracked face in windows, as in most frames of the pipeline.
    void find_markers(std::size_t camera, const ImageView& image) {
        expected_.clear();
        if (tracker_.tracking) {
            const MarkerPrediction prediction{
                predict_markers(model_, tracker_config_, tracker_, tracker_workspace_),
                std::span(tracker_.missed).first(pack_.marker_count),
                std::span(tracked_.matches[camera]).first(pack_.marker_count)};
            expect_markers(pack_.cameras[camera], camera, prediction, {}, expected_);
        }
        detectors_[camera].detect_around(image, expected_.span(), seen_[camera], detected_);
    }

    SolvePack pack_;
    bool ok_ = false;
    bool starting_ = false;
    ShapeModel model_;
    FaceGaussian gaussian_;
    std::array<Detector, kCameras> detectors_;
    std::array<Observations, kCameras> seen_;
    ExpectedMarkers expected_;
    DetectorReport detected_;
    SightingSet sightings_;
    TrackerConfig tracker_config_;
    TrackerState tracker_;
    TrackerWorkspace tracker_workspace_;
    TrackerReport tracked_;
    NamedMarkers named_;
    StabiliserConfig stabiliser_config_;
    StabiliserState stabiliser_;
    StabiliserWorkspace stabiliser_workspace_;
    StabiliserOutput stabilised_;
    StabiliserReport stabiliser_report_;
    InferenceWorkspace inference_;
    InferenceOutput completed_;
    SolverConfig solver_config_;
    SolverState solver_;
    SolverWorkspace solver_workspace_;
    SolverOutput solved_;
    SolverReport solver_report_;
};

double step_whole(Pipeline& pipeline, std::int64_t capture_us, const std::vector<Picture>& pictures,
                  FaceState& state, FrameReport& report) {
    FrameSet frame;
    frame.capture_us = capture_us;
    frame.camera_count = kCameras;
    for (std::size_t c = 0; c < kCameras; ++c) {
        frame.images[c] = pictures[c].view();
        frame.status[c] = CameraStatus::kGood;
    }
    const double began_us = bench::thread_cpu_us();
    pipeline.step(frame, state, report);
    return bench::thread_cpu_us() - began_us;
}

// Detection alone, by the fastest chain of bench_vision. Dots are dark, and so much so that a step far above
// these pictures' noise finds them: with the usual one it outlines thousands of specks.
constexpr double kToldStep = 40.0;   // grey levels: of one who knows how dark these dots are
constexpr double kUsualStep = 12.0;  // of bench_vision: of one who does not

double step_opencv(const std::vector<Picture>& pictures, double step) {
    const double began_us = bench::thread_cpu_us();
    std::size_t seen = 0;
    for (const Picture& picture : pictures)
        seen += bench::threshold_contours(picture.view(), false, step).size();
    const double ended_us = bench::thread_cpu_us();
    return seen == 0 ? std::nan("") : ended_us - began_us;
}

}  // namespace

void print_stage_times(std::size_t frames) {
    SyntheticFaceOptions options;
    options.marker_count = kMarkers;
    options.shape_count = 53;
    options.camera_count = kCameras;
    options.temporal_gamma_mm2 = 10.0;
    const SyntheticFace face(options);
    const SolvePack pack = face.pack();
    const auto chain = std::make_unique<StageChain>(pack);
    const auto pipeline = std::make_unique<Pipeline>();
    if (!chain->ok() || !pipeline->configure(pack, {})) return;
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    bench::use_one_thread();
    std::array<std::vector<double>, kStages> times_us;
    std::vector<double> start_us;  // of vision
    double seen = 0.0;
    for (std::size_t f = 0; f < frames; ++f) {
        const std::vector<Picture> pictures = draw(face, pack, f);
        const auto capture_us = static_cast<std::int64_t>(static_cast<double>(f) / kRateHz * 1e6);
        std::array<double, kStages> one{};
        // In turns: who comes second finds the pictures in the cache.
        if (f % 2 == 0) chain->step(capture_us, pictures, one);
        one[kAll] = step_whole(*pipeline, capture_us, pictures, *state, *report);
        if (f % 2 == 1) chain->step(capture_us, pictures, one);
        one[kOpenCv] = step_opencv(pictures, kToldStep);
        one[kOpenCvUsual] = step_opencv(pictures, kUsualStep);
        one[kVision] = one[kDetect] + one[kTrack] + one[kStabilise] + one[kInfer];
        one[kRest] = one[kAll] - one[kVision] - one[kSolve];
        if (chain->starting()) {
            start_us.push_back(one[kVision]);
            continue;
        }
        for (std::size_t s = 0; s < kStages; ++s) times_us[s].push_back(one[s]);
        seen += static_cast<double>(chain->seen());
    }
    const std::size_t tracked = times_us[kVision].size();
    if (tracked == 0 || start_us.empty()) return;
    fmt::print(
        "\npictures to weights by stage, {} tracked frames of two 640 x 480 pictures, {:.1f} of {} markers "
        "seen; rest is the whole less the stages\n\n| stage | p50 us | p99 us |\n|---|---|---|\n",
        tracked, seen / static_cast<double>(tracked), kMarkers);
    for (std::size_t s = 0; s < kStages; ++s) {
        fmt::print("| {} | {:.0f} | {:.0f} |\n", kNames[s], bench::quantile(times_us[s], 0.5),
                   bench::quantile(times_us[s], 0.99));
    }
    fmt::print("vision of the {} frames before, start and second opinions: p50 {:.0f} us, most {:.0f} us\n",
               start_us.size(), bench::quantile(start_us, 0.5), bench::quantile(start_us, 1.0));
    const double vision_us = bench::quantile(times_us[kVision], 0.5);
    fmt::print(
        "vision / OpenCV's detection, p50: {:.2f} of one told the dots' contrast, {:.2f} of one that is "
        "not\n",
        vision_us / bench::quantile(times_us[kOpenCv], 0.5),
        vision_us / bench::quantile(times_us[kOpenCvUsual], 0.5));
}

}  // namespace rig::test
