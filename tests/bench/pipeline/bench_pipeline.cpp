// Latency and memory of the solver side of the pipeline, observations in hand to FaceState, in one table:
// marker streams and helmets of one to four cameras, small to largest rigs; and where a frame's time goes,
// pictures included. Thread CPU time, so that a busy machine disturbs it less. Detection against others is
// measured by bench_vision. Not a test: nothing here fails because a
// machine is slow.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/bench/pipeline/stage_times.hpp"
#include "tests/bench/thread_clock.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {
namespace {

struct Case {
    const char* name;
    std::size_t markers;
    std::size_t shapes;
    std::size_t cameras;  // 0: a shuffled 3D stream
    SolverKind solver;
};

struct Spread {
    double p50_us = 0.0;
    double p99_us = 0.0;
    double max_us = 0.0;
    double seen = 0.0;        // markers a frame
    double iterations = 0.0;  // of the solve, a frame
};

// One tick's input, made before the clock starts.
class TickInput {
  public:
    TickInput(const SyntheticFace& face, const Case& c, std::size_t frame, SeededRandom& random)
        : cameras_(c.cameras) {
        const double time_s = static_cast<double>(frame) / 60.0;
        points_ = moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
        frame_.capture_us = static_cast<std::int64_t>(time_s * 1e6);
        frame_.camera_count = static_cast<std::uint8_t>(c.cameras);
        for (std::size_t camera = 0; camera < c.cameras; ++camera) {
            views_.push_back(face.observe(camera, points_, 0.1, 0.02, 2, random));
        }
        for (std::size_t camera = 0; camera < c.cameras; ++camera) {
            frame_.cameras[camera] = views_[camera].observations;
            frame_.status[camera] = CameraStatus::kGood;
        }
        add_noise(points_, 0.1, random);
        std::rotate(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(frame % points_.size()),
                    points_.end());
    }
    void step(Pipeline& pipeline, FaceState& state, FrameReport& report) const {
        if (cameras_ > 0) {
            pipeline.step(frame_, state, report);
        } else {
            pipeline.step(PointFrame{frame_.capture_us, points_}, state, report);
        }
    }

  private:
    std::size_t cameras_;
    std::vector<Vec3> points_;
    std::vector<SyntheticFace::View> views_;
    ObservationFrame frame_;
};

Spread measure(const Case& c, std::size_t frames) {
    SyntheticFaceOptions options;
    options.marker_count = c.markers;
    options.shape_count = c.shapes;
    options.camera_count = c.cameras;
    options.solver = c.solver;
    options.temporal_gamma_mm2 = c.solver == SolverKind::kBoxQp ? 10.0 : 0.0;
    const SyntheticFace face(options);
    const auto pipeline = std::make_unique<Pipeline>();
    Spread spread;
    if (!pipeline->configure(face.pack(), {})) return spread;
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    SeededRandom random(3);
    std::vector<double> times_us;
    for (std::size_t f = 0; f < frames; ++f) {
        const TickInput input(face, c, f, random);
        const double began_us = bench::thread_cpu_us();
        input.step(*pipeline, *state, *report);
        times_us.push_back(bench::thread_cpu_us() - began_us);
        spread.seen += static_cast<double>(report->markers_seen) / static_cast<double>(frames);
        spread.iterations += static_cast<double>(report->iterations) / static_cast<double>(frames);
    }
    std::sort(times_us.begin(), times_us.end());
    const auto last = static_cast<double>(times_us.size() - 1);
    spread.p50_us = times_us[static_cast<std::size_t>(0.5 * last)];
    spread.p99_us = times_us[static_cast<std::size_t>(0.99 * last)];
    spread.max_us = times_us.back();
    return spread;
}

void print_memory() {
    const auto row = [](const char* name, std::size_t bytes) {
        fmt::print("| {:<34} | {:>10.1f} |\n", name, static_cast<double>(bytes) / 1024.0);
    };
    fmt::print("\n| fixed memory | KiB |\n|---|---|\n");
    row("Pipeline, everything", sizeof(Pipeline));
    row("of it: detectors, four cameras", kMaxCameras * sizeof(Detector));
    row("tracker state and workspace", sizeof(TrackerState) + sizeof(TrackerWorkspace));
    row("stabiliser state and workspace", sizeof(StabiliserState) + sizeof(StabiliserWorkspace));
    row("solver config, state and workspace",
        sizeof(SolverConfig) + sizeof(SolverState) + sizeof(SolverWorkspace));
    row("shape model and its set-up", sizeof(ShapeModel) + sizeof(ShapeModelWorkspace));
    row("FaceState", sizeof(FaceState));
    row("FrameReport", sizeof(FrameReport));
}

}  // namespace
}  // namespace rig::test

int main(int argc, char** argv) {
    CLI::App app{"bench_pipeline: observations to weights, time and memory"};
    std::size_t frames = 600;
    app.add_option("--frames", frames, "frames of each case")
        ->capture_default_str()
        ->check(CLI::Range(10, 1'000'000));
    CLI11_PARSE(app, argc, argv);
    using rig::SolverKind;
    const std::vector<rig::test::Case> cases{
        {"3D stream, least squares", 60, 53, 0, SolverKind::kLeastSquares},
        {"3D stream, NNLS", 60, 53, 0, SolverKind::kNonNegative},
        {"3D stream, box QP", 60, 53, 0, SolverKind::kBoxQp},
        {"1 camera, box QP", 60, 53, 1, SolverKind::kBoxQp},
        {"2 cameras, box QP", 60, 53, 2, SolverKind::kBoxQp},
        {"4 cameras, box QP", 60, 53, 4, SolverKind::kBoxQp},
        {"2 cameras, 102 markers", 102, 140, 2, SolverKind::kBoxQp},
        {"2 cameras, every capacity", 128, 256, 2, SolverKind::kBoxQp},
    };
    fmt::print(
        "thread CPU time a frame, tracking included, detection not; {} frames, the first bootstraps\n\n",
        frames);
    fmt::print(
        "| case | markers | shapes | p50 us | p99 us | max us | seen | iterations "
        "|\n|---|---|---|---|---|---|---|---|\n");
    for (const auto& c : cases) {
        const auto s = rig::test::measure(c, frames);
        fmt::print("| {} | {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.1f} | {:.1f} |\n", c.name, c.markers,
                   c.shapes, s.p50_us, s.p99_us, s.max_us, s.seen, s.iterations);
    }
    rig::test::print_stage_times(std::clamp<std::size_t>(frames / 4, 10, 150));  // drawing takes its time
    rig::test::print_memory();
    return 0;
}
