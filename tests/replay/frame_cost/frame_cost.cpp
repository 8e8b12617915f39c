// Steps a tracked face from two cameras' observations, so that callgrind can count the instructions of a
// frame: what it collects is counted_frames() alone. Prints how many frames that were, and fails when they
// were not what they stand for. Not a measurement by itself.
#include <cstdio>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {
namespace {

constexpr std::size_t kWarmFrames = 20;  // bootstrap, and what is kept between frames
constexpr std::size_t kCountedFrames = 40;

struct Tick {
    std::vector<SyntheticFace::View> views;
    ObservationFrame frame;
};

struct Run {
    std::vector<Tick> ticks;
    std::unique_ptr<Pipeline> pipeline = std::make_unique<Pipeline>();
    FaceState state;
    FrameReport report;
    std::size_t tracked = 0;  // of the counted frames

    void step(std::size_t frame) {
        pipeline->step(ticks[frame].frame, state, report);
        tracked += report.solved && report.markers_seen > 40 && !report.bootstrapped ? 1U : 0U;
    }
};

// 60 markers, two cameras, 0.1 px of noise, 2 % of the dots unseen, two false dots a picture.
std::vector<Tick> make_ticks(const SyntheticFace& face) {
    SeededRandom random(3);
    std::vector<Tick> ticks(kWarmFrames + kCountedFrames);
    for (std::size_t f = 0; f < ticks.size(); ++f) {
        const double time_s = static_cast<double>(f) / 60.0;
        const std::vector<Vec3> points =
            moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
        Tick& tick = ticks[f];
        for (std::size_t c = 0; c < 2; ++c)
            tick.views.push_back(face.observe(c, points, 0.1, 0.02, 2, random));
        tick.frame.capture_us = static_cast<std::int64_t>(time_s * 1e6);
        tick.frame.camera_count = 2;
        for (std::size_t c = 0; c < 2; ++c) {
            tick.frame.cameras[c] = tick.views[c].observations;
            tick.frame.status[c] = CameraStatus::kGood;
        }
    }
    return ticks;
}

}  // namespace
}  // namespace rig::test

// A plain name for callgrind's --toggle-collect.
extern "C" [[gnu::noinline]] void counted_frames(rig::test::Run* run) {
    for (std::size_t f = rig::test::kWarmFrames; f < run->ticks.size(); ++f) run->step(f);
}

int main() {
    rig::test::SyntheticFaceOptions options;
    options.marker_count = 60;
    options.shape_count = 53;
    options.camera_count = 2;
    options.temporal_gamma_mm2 = 10.0;
    const rig::test::SyntheticFace face(options);
    rig::test::Run run;
    run.ticks = rig::test::make_ticks(face);
    if (!run.pipeline->configure(face.pack(), {})) return 1;
    for (std::size_t f = 0; f < rig::test::kWarmFrames; ++f) run.step(f);
    run.tracked = 0;
    counted_frames(&run);
    std::printf("%zu frames\n", rig::test::kCountedFrames);
    return run.tracked == rig::test::kCountedFrames ? 0 : 1;
}
