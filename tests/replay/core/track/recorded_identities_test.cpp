// The identity experiments in short, on the recorded head and takes: a few hundred frames and tens of starts
// where `headrig experiment identity-*` has thousands. What breaks names shows here first.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "firmware_host/companion/experiments/identity_run.hpp"
#include "firmware_host/companion/experiments/identity_scene.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "tests/replay/replay_streams.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMarkers = 60;
constexpr std::size_t kMostFramesToRepair = 5;  // issue 4: swaps are repaired in so many
constexpr double kRightShare = 0.999;           // and so many names are right after the start

void expect_right(const IdentityFigures& figures, const char* what) {
    std::printf(
        "%s: %zu frames, %zu of %zu named right, %zu wrong, longest wrong %zu frames, ghosts taken %zu of "
        "%zu\n",
        what, figures.frames, figures.right, figures.visible, figures.wrong, figures.longest_wrong_frames,
        figures.ghosts_taken, figures.ghosts);
    EXPECT_GT(figures.visible, 1000U) << what;
    EXPECT_GE(figures.right_share(), kRightShare) << what;
    EXPECT_EQ(figures.converged_wrong, 0U) << what;
}

// Loaded once: reading the head and building its pack take a second.
class RecordedIdentities : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        const fs::path rig = test::shared_data("rig/vertices.npy");
        if (rig.empty() || test::shared_data("takes").empty() || test::shared_data("markers").empty()) return;
        data = rig.parent_path().parent_path();
        auto loaded = load_identity_scene(data);
        ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
        scene = std::move(*loaded);
    }
    static void TearDownTestSuite() { scene.reset(); }
    void SetUp() override {
        if (scene == nullptr) GTEST_SKIP() << "needs rig, takes and markers of ../shared/data";
    }

    static fs::path data;
    static std::unique_ptr<IdentityScene> scene;
};

fs::path RecordedIdentities::data;
std::unique_ptr<IdentityScene> RecordedIdentities::scene;

TEST_F(RecordedIdentities, UnlabelledStreamsAreNamedFromTheFirstFrame) {
    constexpr std::size_t kFrames = 300;
    for (const char* take : {"alex_rom_3", "facegood_3_15"}) {
        const fs::path folder = data / "markers" / take / "60";
        const auto points = read_npy<float>(folder / "unlabelled.npy");
        const auto ids = read_npy<std::int16_t>(folder / "unlabelled_id.npy");
        ASSERT_TRUE(points && ids);
        const std::size_t slots = points->shape[1];
        for (const std::size_t restart_every : {std::size_t{0}, std::size_t{30}}) {
            IdentityRun run(scene->view);
            for (std::size_t f = 0; f < kFrames; ++f) {
                std::vector<Vec3> row;
                std::vector<int> truth;
                for (std::size_t s = 0; s < slots; ++s) {
                    const float* x = points->values.data() + 3 * (f * slots + s);
                    row.emplace_back(static_cast<double>(x[0]), static_cast<double>(x[1]),
                                     static_cast<double>(x[2]));
                    truth.push_back(ids->values[f * slots + s]);
                }
                if (restart_every != 0 && f % restart_every == 0) run.restart();
                run.begin_frame();
                run.add_points(row, truth);
                run.track();
            }
            expect_right(run.figures(), take);
            // The speech has one ghost beside a hidden marker that is taken for a frame: known since the
            // first run.
            EXPECT_LE(run.figures().ghosts_taken, 1U) << take;
        }
    }
}

// 400 frames of swap.npy hold three swaps of swaps.csv.
TEST_F(RecordedIdentities, LabelledSwapsAreRepairedInFiveFrames) {
    constexpr std::size_t kFrames = 400;
    const fs::path folder = data / "markers" / "alex_rom_3" / "60";
    const auto truth = read_npy<float>(folder / "noise01.npy");
    const auto claimed = read_npy<float>(folder / "swap.npy");
    const auto swaps = read_numeric_csv(folder / "swaps.csv");
    ASSERT_TRUE(truth && claimed && swaps);
    const auto row_of = [](const NpyArray<float>& stream, std::size_t frame) {
        std::vector<Vec3> row;
        for (std::size_t k = 0; k < kMarkers; ++k) {
            const float* x = stream.values.data() + 3 * (frame * kMarkers + k);
            row.emplace_back(static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2]));
        }
        return row;
    };
    IdentityRun run(scene->view);
    std::vector<std::vector<std::size_t>> wrong(kFrames);  // markers
    for (std::size_t f = 0; f < kFrames; ++f) {
        run.check(row_of(*claimed, f));
        const std::vector<Vec3> right = row_of(*truth, f);
        for (std::size_t k = 0; k < kMarkers; ++k) {
            const NamedMarker& marker = run.named().markers[k];
            if (marker.seen && (marker.position_mm - right[k]).norm() > 0.5) wrong[f].push_back(k);
        }
    }
    std::size_t checked = 0;
    for (std::size_t s = 0; s < swaps->row_count; ++s) {
        const auto begin = static_cast<std::size_t>(swaps->values[4 * s]);
        if (begin + 40 > kFrames) continue;
        ++checked;
        for (std::size_t f = begin + kMostFramesToRepair; f < begin + 40; ++f) {
            for (const std::size_t k : wrong[f]) {
                EXPECT_NE(k, static_cast<std::size_t>(swaps->values[4 * s + 2])) << "frame " << f;
                EXPECT_NE(k, static_cast<std::size_t>(swaps->values[4 * s + 3])) << "frame " << f;
            }
        }
    }
    EXPECT_EQ(checked, 3U);
}

TEST_F(RecordedIdentities, ExchangedMemoriesAreRepairedInFiveFrames) {
    constexpr std::size_t kPeriod = 20;
    constexpr std::size_t kFrames = 20 * 16;
    for (const bool speech : {false, true}) {
        const Take& take = speech ? scene->head.speech : scene->head.range_of_motion;
        IdentityRun run(scene->view);
        SightingSource source(*scene, {}, kFrames, speech ? 422 : 421);
        for (std::size_t f = 0; f < kFrames; ++f) {
            if (f % kPeriod == 0 && f > 0) {
                const std::size_t a = (7 * f / kPeriod) % kMarkers;
                run.exchange_memories(a, nearest_neighbour(scene->head.layout, a));
            }
            source.add_frame(f, take, f, Rigid{}, run);
            const IdentityFigures frame = run.track();
            if (f % kPeriod >= kMostFramesToRepair) {
                EXPECT_EQ(frame.wrong, 0U) << "frame " << f;
            }
        }
        EXPECT_EQ(run.figures().converged_wrong, 0U);
    }
}

// As identity-bootstrap has it, 20 of its 1000 starts: right within ten frames, and right for thirty more.
TEST_F(RecordedIdentities, StartsAtAnyPoseInRangeAreRightWithinTenFrames) {
    constexpr std::uint64_t kStarts = 20;
    constexpr std::size_t kFramesToStart = 10;
    constexpr std::size_t kFrames = 40;
    for (const bool cameras : {false, true}) {
        for (const bool speech : {false, true}) {
            const Take& take = speech ? scene->head.speech : scene->head.range_of_motion;
            IdentityRun run(scene->view);
            std::size_t right = 0;
            for (std::uint64_t seed = 7000; seed < 7000 + kStarts; ++seed) {
                WhiteNoise random(seed);
                const auto first = static_cast<std::size_t>(random.uniform() *
                                                            static_cast<double>(take.frame_count - kFrames));
                const double turn_rad = (cameras ? 10.0 : 25.0) * std::numbers::pi / 180.0;
                const Rigid pose = random_pose(turn_rad, 15.0, random);
                SightingSource source(*scene, {.cameras = cameras}, kFrames, seed);
                run.restart();
                IdentityFigures tenth;
                for (std::size_t f = 0; f < kFrames; ++f) {
                    source.add_frame(f, take, first + f, pose, run);
                    const IdentityFigures frame = run.track(f + 1 >= kFramesToStart);
                    if (f + 1 == kFramesToStart) tenth = frame;
                }
                right += tenth.visible > 0 && tenth.right == tenth.visible ? 1U : 0U;
            }
            const char* what = cameras
                                   ? (speech ? "starts, speech, cameras" : "starts, range of motion, cameras")
                                   : (speech ? "starts, speech, points" : "starts, range of motion, points");
            EXPECT_EQ(right, kStarts) << what;
            expect_right(run.figures(), what);
        }
    }
}

// Slip, noise, a tenth missing and swaps at once cost no more than 0.02 of a weight against noise alone.
TEST_F(RecordedIdentities, CombinedIsSolvedNearlyAsWellAsNoiseAlone) {
    const test::ReplayPack pack(data, static_cast<int>(kMarkers));
    const std::vector<std::vector<double>> truth = test::read_truth(data, "alex_rom_3");
    PipelineConfig config;
    config.filter = false;
    const auto weight_rms = [&](const char* name) {
        test::ReplayStream stream =
            test::read_stream(data / "markers/alex_rom_3/60" / (std::string(name) + ".npy"));
        stream.frames = 400;
        stream.points.resize(stream.frames * stream.slots);
        const test::ReplayRun run = test::run_stream(pack, stream, config);
        double sum = 0.0;
        double count = 0.0;
        for (std::size_t f = 0; f < run.weights.size(); ++f) {
            for (std::size_t i = 0; i < pack.shape_count(); ++i) {
                if (pack.column_length(i) <= 1.0) continue;
                const double error = static_cast<double>(run.weights[f][i]) - truth[f][i];
                sum += error * error;
                count += 1.0;
            }
        }
        return std::sqrt(sum / count);
    };
    const double alone = weight_rms("noise01");
    const double combined = weight_rms("combined");
    std::printf("weight rms: noise alone %.4f, combined %.4f\n", alone, combined);
    EXPECT_GT(alone, 0.005) << "the stream was not degraded, or the measure broke";
    EXPECT_LE(combined, alone + 0.02);
}

}  // namespace
}  // namespace rig::host
