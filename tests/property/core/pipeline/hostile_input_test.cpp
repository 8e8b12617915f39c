// Clause C1 and goal G8 of the reliability page: whatever comes in, every output is finite and in range, at
// every tick, and a good stream afterwards is solved again. Seeds are fixed; a failure prints seed and frame.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double hostile_number(test::SeededRandom& random) {
    constexpr std::array<double, 14> kWorst{kNan,   kInfinity, -kInfinity, 1e308, -1e308, 1e38,  -1e38,
                                            5e-324, -5e-324,   0.0,        -0.0,  999.9,  -1e15, 1e-300};
    return random.chance(0.5) ? kWorst[random.below(kWorst.size())] : random.normal(0.0, 100.0);
}

Vec3 hostile_point(test::SeededRandom& random) {
    return {hostile_number(random), hostile_number(random), hostile_number(random)};
}

// One frame of points out of the catalogue: good, mixed, coincident, collinear, flat, swapped, empty, far too
// many.
std::vector<Vec3> hostile_points(const std::vector<Vec3>& good, test::SeededRandom& random) {
    std::vector<Vec3> points = good;
    switch (random.below(10)) {
        case 0:
            break;
        case 1:
            for (Vec3& p : points) p = hostile_point(random);
            break;
        case 2:
            for (Vec3& p : points) {
                if (random.chance(0.3)) p = hostile_point(random);
            }
            break;
        case 3:
            points.assign(good.size(), good[random.below(good.size())]);
            break;
        case 4:
            for (std::size_t k = 0; k < points.size(); ++k)
                points[k] = Vec3{static_cast<double>(k), 0.0, 0.0};
            break;
        case 5:
            for (Vec3& p : points) p[2] = 0.0;
            break;
        case 6:
            random.shuffle(std::span<Vec3>(points));
            break;
        case 7:
            points.clear();
            break;
        case 8:
            for (std::size_t i = 0; i < 600; ++i) points.push_back(hostile_point(random));
            break;
        default:
            for (Vec3& p : points) {
                if (random.chance(0.9)) p = Vec3{kNan, kNan, kNan};
            }
            break;
    }
    return points;
}

std::vector<Observation> hostile_dots(const std::vector<Observation>& good, test::SeededRandom& random) {
    std::vector<Observation> dots = good;
    const auto number = [&random] { return static_cast<float>(hostile_number(random)); };
    switch (random.below(6)) {
        case 0:
            break;
        case 1:
            for (Observation& o : dots) o = {number(), number(), number(), number(), number()};
            break;
        case 2:
            dots.clear();
            break;
        case 3:
            dots.assign(400, Observation{320.0F, 240.0F, 8.0F, 0.5F, 0.9F});
            break;
        case 4:
            for (int i = 0; i < 500; ++i) dots.push_back({number(), number(), number(), number(), number()});
            break;
        default:
            for (Observation& o : dots) {
                if (random.chance(0.3)) o.x_px = number();
            }
            break;
    }
    return dots;
}

std::int64_t hostile_time(std::int64_t usual, test::SeededRandom& random) {
    switch (random.below(40)) {
        case 0:
            return std::numeric_limits<std::int64_t>::max();
        case 1:
            return std::numeric_limits<std::int64_t>::min();
        case 2:
            return 0;
        case 3:
            return usual - 1'000'000;
        default:
            return usual;
    }
}

void expect_finite_and_in_range(const SolvePack& pack, const FaceState& state, const FrameReport& report) {
    ASSERT_EQ(state.shape_count, pack.shape_count);
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        ASSERT_TRUE(state.weights[i] >= pack.weight_low[i] && state.weights[i] <= pack.weight_high[i]);
        ASSERT_TRUE(state.confidence[i] >= 0.0F && state.confidence[i] <= 1.0F);
    }
    for (std::size_t a = 0; a < 3; ++a) {
        ASSERT_TRUE(std::isfinite(state.slip.rotation_rad[a]) && std::isfinite(state.slip.translation_mm[a]));
    }
    ASSERT_TRUE(std::isfinite(report.kkt) && std::isfinite(report.objective_mm2) &&
                std::isfinite(report.residual_rms_mm));
    ASSERT_TRUE(std::isfinite(report.hull_distance));
    ASSERT_LE(report.markers_used, pack.marker_count);
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        for (Eigen::Index a = 0; a < 3; ++a) ASSERT_TRUE(std::isfinite(report.face_markers_mm[k][a]));
    }
    for (const std::int16_t label : report.labels) ASSERT_TRUE(label >= -1 && label < pack.marker_count);
    ASSERT_TRUE(report.solved || state.held);
}

// One pipeline and what is fed to it.
struct Victim {
    const test::SyntheticFace& face;
    Pipeline& pipeline;
    test::SeededRandom& random;
    FaceState state{};
    FrameReport report{};
};

void step_labelled(Victim& v, std::int64_t at_us, std::span<const Vec3> good) {
    std::vector<Vec3> points = hostile_points({good.begin(), good.end()}, v.random);
    if (v.random.chance(0.9)) points.resize(24, Vec3{kNan, kNan, kNan});
    v.pipeline.step(LabelledFrame{at_us, points}, v.state, v.report);
}

void step_points(Victim& v, std::int64_t at_us, std::span<const Vec3> good) {
    const std::vector<Vec3> points = hostile_points({good.begin(), good.end()}, v.random);
    v.pipeline.step(PointFrame{at_us, points}, v.state, v.report);
}

void step_observations(Victim& v, std::int64_t at_us, std::span<const Vec3> good) {
    ObservationFrame input;
    input.capture_us = at_us;
    input.camera_count = static_cast<std::uint8_t>(v.random.below(5));
    std::array<std::vector<Observation>, 2> dots;
    for (std::size_t c = 0; c < 2; ++c) {
        dots[c] = hostile_dots(v.face.observe(c, good, 0.1, 0.1, 1, v.random).observations, v.random);
        input.cameras[c] = dots[c];
        input.status[c] = static_cast<CameraStatus>(v.random.below(6));
    }
    v.pipeline.step(input, v.state, v.report);
}

void step_images(Victim& v, std::int64_t at_us) {
    std::vector<std::uint8_t> noise(64 * 48);
    FrameSet input;
    input.capture_us = at_us;
    input.camera_count = static_cast<std::uint8_t>(v.random.below(3));
    for (std::uint8_t& pixel : noise) pixel = static_cast<std::uint8_t>(v.random.below(256));
    for (std::size_t c = 0; c < 2; ++c) {
        if (v.random.chance(0.7)) input.images[c] = {noise.data(), 64, 48, 64};
        input.status[c] = static_cast<CameraStatus>(v.random.below(6));
    }
    v.pipeline.step(input, v.state, v.report);
}

void step_any(Victim& v, std::int64_t at_us, std::span<const Vec3> good) {
    switch (v.random.below(5)) {
        case 0:
            return step_labelled(v, at_us, good);
        case 1:
            return step_points(v, at_us, good);
        case 2:
            return step_observations(v, at_us, good);
        case 3:
            return step_images(v, at_us);
        default:
            return v.pipeline.idle(at_us, v.state, v.report);
    }
}

class HostileInput : public testing::TestWithParam<SolverKind> {};

TEST_P(HostileInput, EveryOutputIsFiniteAndInRange) {
    constexpr int kFrames = 2500;
    test::SyntheticFaceOptions options;
    options.marker_count = 24;
    options.shape_count = 16;
    options.camera_count = 2;
    options.duplicate_columns = 1;
    options.zero_columns = 1;
    options.temporal_gamma_mm2 = 1.0;
    options.solver = GetParam();
    const test::SyntheticFace face(options);
    const SolvePack pack = face.pack();
    for (const bool filter : {true, false}) {
        test::SeededRandom random(171);
        const auto pipeline = std::make_unique<Pipeline>();
        PipelineConfig config;
        config.filter = filter;
        config.loss_policy = filter ? LossPolicy::kDecay : LossPolicy::kHold;
        config.stabilise = random.chance(0.5);
        ASSERT_TRUE(pipeline->configure(pack, config).has_value());
        Victim v{face, *pipeline, random};
        for (int frame = 0; frame < kFrames; ++frame) {
            const std::vector<Vec3> good = face.positions(face.weights_at(frame / 60.0));
            step_any(v, hostile_time(frame * 16'667, random), good);
            ASSERT_NO_FATAL_FAILURE(expect_finite_and_in_range(pack, v.state, v.report)) << "frame " << frame;
        }
        // And then the face is back.
        for (int frame = 0; frame < 40; ++frame) {
            const std::vector<Vec3> good = face.positions(face.weights_at(frame / 60.0));
            pipeline->step(LabelledFrame{frame * 16'667, good}, v.state, v.report);
        }
        EXPECT_EQ(v.state.state, TrackingState::kLive);
        EXPECT_TRUE(v.report.solved);
        EXPECT_LT(v.report.residual_rms_mm, 0.1) << "filter " << filter;
    }
}

INSTANTIATE_TEST_SUITE_P(Solvers, HostileInput,
                         testing::Values(SolverKind::kLeastSquares, SolverKind::kNonNegative,
                                         SolverKind::kBoxQp));

}  // namespace
}  // namespace rig
