// The identity experiments in short, on a face of arithmetic: for machines without the recorded takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/experiments/identity_run.hpp"
#include "tests/support/random.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::host {
namespace {

constexpr std::size_t kMarkers = 60;
constexpr std::size_t kMostFramesToRepair = 5;
constexpr double kRightShare = 0.999;

struct Cloud {
    std::vector<Vec3> points;
    std::vector<int> truth;
};

// A frame of an unlabelled stream: a twentieth hidden, a ghost in every second frame, in no order.
Cloud cloud_of(const test::SyntheticFace& face, double time_s, const Rigid& pose,
               test::SeededRandom& random) {
    std::vector<Vec3> markers = test::moved(pose, face.positions(face.weights_at(time_s)));
    test::add_noise(markers, 0.1, random);
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < markers.size(); ++k)
        if (!random.chance(0.05)) order.push_back(k);
    random.shuffle(std::span(order));
    Cloud out;
    for (const std::size_t k : order) {
        out.points.push_back(markers[k]);
        out.truth.push_back(static_cast<int>(k));
    }
    if (random.chance(0.5)) {
        out.points.emplace_back(random.uniform(-80.0, 80.0), random.uniform(-100.0, 80.0),
                                random.uniform(-30.0, 80.0));
        out.truth.push_back(-1);
    }
    return out;
}

std::size_t nearest_to(const std::vector<Vec3>& points, std::size_t marker) {
    std::size_t nearest = marker == 0 ? 1 : 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
        if (k != marker && (points[k] - points[marker]).norm() < (points[nearest] - points[marker]).norm())
            nearest = k;
    }
    return nearest;
}

void expect_right(const IdentityFigures& figures, const char* what) {
    std::printf("%s: %zu frames, %zu of %zu named right, %zu wrong, longest wrong %zu frames\n", what,
                figures.frames, figures.right, figures.visible, figures.wrong, figures.longest_wrong_frames);
    EXPECT_GT(figures.visible, 1000U);
    EXPECT_GE(figures.right_share(), kRightShare) << what;
    EXPECT_EQ(figures.converged_wrong, 0U) << what;
}

TEST(SyntheticIdentities, AnUnlabelledStreamUnderSlipIsNamedRight) {
    const test::SyntheticFace face({.marker_count = kMarkers});
    test::SeededRandom random(51);
    const SolvePack pack = face.pack();
    IdentityRun run(pack);
    for (int f = 0; f < 400; ++f) {
        const Cloud cloud = cloud_of(face, f / 60.0, test::creeping_slip(f / 60.0), random);
        run.begin_frame();
        run.add_points(cloud.points, cloud.truth);
        run.track(f > 0);
    }
    expect_right(run.figures(), "unlabelled, synthetic");
}

TEST(SyntheticIdentities, ExchangedMemoriesAreRepairedInFiveFrames) {
    constexpr int kPeriod = 20;
    const test::SyntheticFace face({.marker_count = kMarkers});
    const std::vector<Vec3> neutral = face.positions(std::vector<double>(face.shape_count(), 0.0));
    test::SeededRandom random(52);
    const SolvePack pack = face.pack();
    IdentityRun run(pack);
    for (int f = 0; f < kPeriod * 20; ++f) {
        if (f % kPeriod == 0 && f > 0) {
            const std::size_t a = static_cast<std::size_t>(7 * f / kPeriod) % kMarkers;
            run.exchange_memories(a, nearest_to(neutral, a));
        }
        const Cloud cloud = cloud_of(face, f / 60.0, Rigid{}, random);
        run.begin_frame();
        run.add_points(cloud.points, cloud.truth);
        const IdentityFigures frame = run.track();
        if (f % kPeriod >= static_cast<int>(kMostFramesToRepair)) {
            EXPECT_EQ(frame.wrong, 0U) << "frame " << f;
        }
    }
    EXPECT_EQ(run.figures().converged_wrong, 0U);
}

TEST(SyntheticIdentities, StartsAtAnyPoseInRangeAreRightWithinTenFrames) {
    constexpr std::size_t kStarts = 30;
    const test::SyntheticFace face({.marker_count = kMarkers, .camera_count = 2});
    for (const bool cameras : {false, true}) {
        const SolvePack pack = face.pack();
        IdentityRun run(pack);
        std::size_t right = 0;
        for (std::size_t start = 0; start < kStarts; ++start) {
            test::SeededRandom random(5300 + start);
            const double turn_rad = (cameras ? 10.0 : 25.0) * std::numbers::pi / 180.0 / std::sqrt(3.0);
            const Rigid pose = test::random_slip(random, turn_rad, 15.0);
            const double began_s = random.uniform(0.0, 60.0);
            run.restart();
            IdentityFigures tenth;
            for (int f = 0; f < 40; ++f) {
                const double time_s = began_s + f / 60.0;
                run.begin_frame();
                if (cameras) {
                    const auto markers = test::moved(pose, face.positions(face.weights_at(time_s)));
                    for (std::size_t c = 0; c < 2; ++c) {
                        const auto view = face.observe(c, markers, 0.1, 0.05, f % 2, random);
                        run.add_view(c, view.observations, view.marker);
                    }
                } else {
                    const Cloud cloud = cloud_of(face, time_s, pose, random);
                    run.add_points(cloud.points, cloud.truth);
                }
                const IdentityFigures frame = run.track(f >= 9);
                if (f == 9) tenth = frame;
            }
            right += tenth.visible > 0 && tenth.right == tenth.visible ? 1U : 0U;
        }
        EXPECT_EQ(right, kStarts) << (cameras ? "cameras" : "points");
        expect_right(run.figures(), cameras ? "starts, synthetic, cameras" : "starts, synthetic, points");
    }
}

// One camera, which sees no depth: with three ghosts in each picture a start may wait, but when it settles it
// is right. A marker that is turned away must not keep the sighting of one that lies before it on the same
// ray.
TEST(SyntheticIdentities, StartsFromOneCameraAreRightWithinTenFrames) {
    constexpr std::size_t kStarts = 60;
    const test::SyntheticFace face({.marker_count = kMarkers, .camera_count = 1});
    const SolvePack pack = face.pack();
    for (const int ghosts : {0, 3}) {
        IdentityRun run(pack);
        std::size_t right = 0;
        for (std::size_t start = 0; start < kStarts; ++start) {
            test::SeededRandom random(7000 + start);
            const Rigid pose =
                test::random_slip(random, 10.0 * std::numbers::pi / 180.0 / std::sqrt(3.0), 15.0);
            const double began_s = random.uniform(0.0, 60.0);
            run.restart();
            IdentityFigures tenth;
            for (int f = 0; f < 40; ++f) {
                const auto markers = test::moved(pose, face.positions(face.weights_at(began_s + f / 60.0)));
                const auto view = face.observe(0, markers, 0.1, 0.05, ghosts, random);
                run.begin_frame();
                run.add_view(0, view.observations, view.marker);
                const IdentityFigures frame = run.track(f >= 9);
                if (f == 9) tenth = frame;
            }
            right += tenth.right > 0 && tenth.wrong == 0 ? 1U : 0U;
        }
        std::printf(
            "one camera, %d ghosts: %zu of %zu starts without a wrong name after ten frames, %zu wrong of "
            "%zu later, longest %zu frames\n",
            ghosts, right, kStarts, run.figures().wrong, run.figures().visible,
            run.figures().longest_wrong_frames);
        EXPECT_EQ(right, kStarts);
        EXPECT_EQ(run.figures().converged_wrong, 0U);
    }
}

// Slip, noise, a tenth missing and swapped names at once, against noise alone.
TEST(SyntheticIdentities, CombinedIsSolvedNearlyAsWellAsNoiseAlone) {
    const auto weight_rms = [](bool combined) {
        const test::SyntheticFace face({.marker_count = kMarkers});
        const std::vector<Vec3> neutral = face.positions(std::vector<double>(face.shape_count(), 0.0));
        const auto pipeline = std::make_unique<Pipeline>();
        PipelineConfig config;
        config.filter = false;
        EXPECT_TRUE(pipeline->configure(face.pack(), config).has_value());
        test::SeededRandom random(54);
        const auto state = std::make_unique<FaceState>();
        const auto report = std::make_unique<FrameReport>();
        double sum = 0.0;
        double count = 0.0;
        for (int f = 0; f < 400; ++f) {
            const std::vector<double> truth = face.weights_at(f / 60.0);
            std::vector<Vec3> points = face.positions(truth);
            if (combined) points = test::moved(test::creeping_slip(f / 60.0), points);
            test::add_noise(points, 0.1, random);
            if (combined) {
                if (f % 100 >= 60 && f % 100 < 90) {
                    const std::size_t a = static_cast<std::size_t>(f / 100) * 13 + 4;
                    std::swap(points[a], points[nearest_to(neutral, a)]);
                }
                for (Vec3& point : points)
                    if (random.chance(0.1)) point = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
            }
            pipeline->step(LabelledFrame{1'000'000 + f * std::int64_t{16'667}, points}, *state, *report);
            if (f < 30) continue;
            for (std::size_t i = 0; i < truth.size(); ++i) {
                if (face.column_length(i) <= 1.0) continue;
                const double error = static_cast<double>(state->weights[i]) - truth[i];
                sum += error * error;
                count += 1.0;
            }
        }
        return std::sqrt(sum / count);
    };
    const double alone = weight_rms(false);
    const double combined = weight_rms(true);
    std::printf("weight rms, synthetic: noise alone %.4f, combined %.4f\n", alone, combined);
    EXPECT_GT(alone, 0.001);
    EXPECT_LE(combined, alone + 0.02);
}

}  // namespace
}  // namespace rig::host
