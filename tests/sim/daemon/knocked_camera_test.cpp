// A camera that is knocked on the helmet while the daemon runs: what its reference marks make of it, from
// pictures to what the host is told.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/daemon/daemon_bench.hpp"

namespace rig::test {
namespace {

constexpr std::uint32_t kFrames = 240;
constexpr std::uint32_t kKnock = 90;

// On the brim and beside the chin.
std::vector<HelmetMark> marks() {
    return {{Vec3{-70.0, 62.0, 10.0}, 3},
            {Vec3{0.0, 72.0, 20.0}, 3},
            {Vec3{70.0, 62.0, 10.0}, 3},
            {Vec3{-62.0, -105.0, 0.0}, 3},
            {Vec3{62.0, -105.0, 0.0}, 3}};
}

PaintedTakeOptions knocked(std::vector<HelmetMark> marks, double degrees) {
    PaintedTakeOptions options;
    options.marks = std::move(marks);
    options.knocked_camera = 1;
    options.knocked_from = kKnock;
    // Down and a little aside.
    options.knock_rad = Vec3{0.9, 0.4, 0.1}.normalized() * (degrees * 3.14159265358979 / 180.0);
    return options;
}

struct DaemonRun {
    std::vector<FaceState> states;
    int raised_at = -1;      // first frame that carries F20
    double rms_after = 0.0;  // weights against the truth, from half a second after the knock
};

DaemonRun run_daemon(const PaintedTake& take) {
    BenchOptions options;
    options.frames = kFrames;
    options.take = &take;
    DaemonBench bench(options);
    EXPECT_EQ(bench.run(), AppEnd::kWorldEnded);
    DaemonRun run;
    run.states = bench.host.states;
    EXPECT_EQ(run.states.size(), kFrames);
    const auto rms = [&](std::uint32_t from, std::uint32_t to) {
        double sum = 0.0;
        for (std::uint32_t frame = from; frame < to; ++frame) {
            const std::vector<double> truth = take.weights_at(frame);
            for (std::size_t i = 0; i < truth.size(); ++i) {
                const double e = static_cast<double>(run.states[frame].weights[i]) - truth[i];
                sum += e * e / static_cast<double>(truth.size());
            }
        }
        return std::sqrt(sum / (to - from));
    };
    run.rms_after = rms(kKnock + 30, kFrames);
    for (std::uint32_t frame = 0; frame < kFrames && run.raised_at < 0; ++frame) {
        if ((run.states[frame].faults & fault_bit(Fault::kRigMoved)) != 0)
            run.raised_at = static_cast<int>(frame);
    }
    return run;
}

TEST(KnockedCamera, MarksRaiseTheFaultWithinASecondAndTheFaceIsSolvedOn) {
    const PaintedTake with(knocked(marks(), 1.0));
    const PaintedTake without(knocked({}, 1.0));
    const PaintedTake still(knocked(marks(), 0.0));
    const DaemonRun watched = run_daemon(with);
    const DaemonRun blind = run_daemon(without);
    const DaemonRun unmoved = run_daemon(still);
    std::printf(
        "weight rms after a knock of 1 degree: with marks %.4f, without %.4f, without a knock %.4f; "
        "F20 after %d frames\n",
        watched.rms_after, blind.rms_after, unmoved.rms_after, watched.raised_at - static_cast<int>(kKnock));
    EXPECT_GE(watched.raised_at, static_cast<int>(kKnock) + 29);
    EXPECT_LE(watched.raised_at, static_cast<int>(kKnock) + 60) << "catalogue: within a second";
    EXPECT_NE(watched.states.back().faults & fault_bit(Fault::kRigMoved), 0U);
    EXPECT_LT(watched.rms_after, 1.3 * unmoved.rms_after);
    EXPECT_GT(blind.rms_after, 10.0 * watched.rms_after) << "what the marks are for";
}

TEST(KnockedCamera, CamerasThatSitStillRaiseNothing) {
    const PaintedTake still(knocked(marks(), 0.0));
    const DaemonRun run_still = run_daemon(still);
    EXPECT_EQ(run_still.raised_at, -1);
    // The marks cost the face nothing.
    const PaintedTake plain(knocked({}, 0.0));
    const DaemonRun run_plain = run_daemon(plain);
    std::printf("weight rms of a rig at rest: with marks %.4f, without %.4f\n", run_still.rms_after,
                run_plain.rms_after);
    EXPECT_LT(run_still.rms_after, 1.05 * run_plain.rms_after);
}

}  // namespace
}  // namespace rig::test
