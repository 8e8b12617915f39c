#include "core/pipeline/pipeline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/synthetic_face.hpp"
#include "tests/unit/core/pipeline/pipeline_scene.hpp"

namespace rig {
namespace {

using test::kFrameUs;
const Vec3 kNowhere{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};

using Scene = test::PipelineScene;

void expect_contract(const FaceState& state, const FrameReport& report, std::size_t shapes,
                     std::size_t markers) {
    ASSERT_EQ(state.shape_count, shapes);
    for (std::size_t i = 0; i < shapes; ++i) {
        ASSERT_TRUE(state.weights[i] >= 0.0F && state.weights[i] <= 1.0F)
            << "weight " << i << ' ' << state.weights[i];
        ASSERT_TRUE(state.confidence[i] >= 0.0F && state.confidence[i] <= 1.0F);
    }
    for (std::size_t a = 0; a < 3; ++a) {
        ASSERT_TRUE(std::isfinite(state.slip.rotation_rad[a]) && std::isfinite(state.slip.translation_mm[a]));
    }
    ASSERT_TRUE(std::isfinite(report.kkt) && std::isfinite(report.objective_mm2) &&
                std::isfinite(report.residual_rms_mm));
    for (std::size_t k = 0; k < markers; ++k) {
        for (Eigen::Index a = 0; a < 3; ++a) ASSERT_TRUE(std::isfinite(report.face_markers_mm[k][a]));
    }
    for (const std::int16_t label : report.labels)
        ASSERT_TRUE(label >= -1 && label < static_cast<int>(markers));
    if (!report.solved) {
        ASSERT_TRUE(state.held) << "no solve stands behind this tick";
    }
    if (state.state <= TrackingState::kLost) {
        for (std::size_t i = 0; i < shapes; ++i) ASSERT_EQ(state.confidence[i], 0.0F);
    }
    if (state.state >= TrackingState::kPartial) {
        ASSERT_LT(state.sequence, 0xffffffffU);
    }
}

TEST(Pipeline, BeforeAPackIsInPlaceItIsSafe) {
    auto pipeline = std::make_unique<Pipeline>();
    FaceState state;
    FrameReport report;
    const std::vector<Vec3> points(60, Vec3::Zero());
    pipeline->step(LabelledFrame{0, points}, state, report);
    pipeline->step(PointFrame{1, points}, state, report);
    pipeline->step(FrameSet{}, state, report);
    pipeline->step(ObservationFrame{}, state, report);
    pipeline->idle(2, state, report);
    EXPECT_EQ(state.state, TrackingState::kSafe);
    EXPECT_TRUE(state.held);
    EXPECT_EQ(state.shape_count, 0);
    EXPECT_EQ(state.sequence, 4U);
}

TEST(Pipeline, RefusesWhatDoesNotFit) {
    const test::SyntheticFace face({});
    auto pipeline = std::make_unique<Pipeline>();
    SolvePack pack = face.pack();
    pack.marker_count = 59;
    EXPECT_EQ(pipeline->configure(pack, {}).error(), PipelineError::kPackLimits);
    PipelineConfig config;
    for (const double rate : {0.0, -60.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
        config.rate_hz = rate;
        EXPECT_EQ(pipeline->configure(face.pack(), config).error(), PipelineError::kRate);
    }
    FaceState state;
    FrameReport report;
    pipeline->idle(0, state, report);
    EXPECT_EQ(state.state, TrackingState::kSafe);
}

TEST(Pipeline, LabelledStreamIsSolvedAndGoesLive) {
    PipelineConfig config;
    config.filter = false;
    Scene s(config);
    double sum = 0.0;
    for (int i = 0; i < 240; ++i) {
        s.labelled();
        expect_contract(s.state, s.report, 30, 60);
        EXPECT_EQ(s.state.state, i < 4 ? TrackingState::kHold : TrackingState::kLive);
        EXPECT_EQ(s.state.sequence, static_cast<std::uint32_t>(i));
        EXPECT_TRUE(s.report.optimal);
        EXPECT_FALSE(s.state.held) << "without the filter every solve is put out";
        sum += s.weight_rms() * s.weight_rms();
    }
    const double rms = std::sqrt(sum / 240.0);
    std::printf("labelled, no filter: weight rms %.4f\n", rms);
    EXPECT_LT(rms, 0.03);
    EXPECT_GT(rms, 0.002) << "better than the noise allows";
}

TEST(Pipeline, WithTheFilterTheFirstFramesAreHeldAndSaySo) {
    Scene s;
    for (int i = 0; i < 4; ++i) {
        s.labelled();
        EXPECT_EQ(s.state.state, TrackingState::kHold);
        EXPECT_TRUE(s.state.held);
        for (std::size_t w = 0; w < 30; ++w) EXPECT_EQ(s.state.weights[w], 0.0F);
    }
    s.labelled();
    EXPECT_EQ(s.state.state, TrackingState::kLive);
    EXPECT_FALSE(s.state.held);
    EXPECT_LT(s.weight_rms(), 0.1);
    EXPECT_EQ(s.state.capture_us, s.now() - kFrameUs);
}

// HOLD: last good weights, held, age rising until a new solve is put out, also while good frames are being
// counted.
TEST(Pipeline, AgeRisesAllThroughALoss) {
    Scene s;
    for (int i = 0; i < 60; ++i) s.labelled();
    const std::int64_t last_us = s.state.capture_us;
    const std::array<float, kMaxShapes> last = s.state.weights;
    EXPECT_EQ(last_us, s.now() - kFrameUs);
    for (int i = 0; i < 10; ++i) {
        s.idle();
        EXPECT_TRUE(s.state.held);
        EXPECT_EQ(s.state.capture_us, last_us);
        EXPECT_EQ(s.state.weights, last);
        EXPECT_NE(s.state.faults & fault_bit(Fault::kMarkersLost), 0U);
    }
    EXPECT_EQ(s.state.state, TrackingState::kHold);
    for (int i = 0; i < 4; ++i) {
        s.labelled();
        EXPECT_EQ(s.state.state, TrackingState::kHold);
        EXPECT_TRUE(s.state.held);
        EXPECT_EQ(s.state.weights, last);
        EXPECT_EQ(s.state.capture_us, last_us) << "the weights did not get younger";
    }
    s.labelled();
    EXPECT_EQ(s.state.state, TrackingState::kLive);
    EXPECT_FALSE(s.state.held);
    EXPECT_EQ(s.state.capture_us, s.now() - kFrameUs);
}

// Beside a twin that saw everything: no step is larger than the twin's own by more than the slew of 5 per
// second.
TEST(Pipeline, RecoveryDoesNotPop) {
    for (const int gap : {5, 30, 120}) {
        Scene s;
        Scene twin;
        double largest_excess = 0.0;
        double largest_gap = 0.0;
        for (int i = 0; i < 60 + gap + 60; ++i) {
            twin.random = s.random;
            twin.labelled();
            if (i >= 60 && i < 60 + gap) {
                s.idle();
                s.random = twin.random;
            } else {
                s.labelled();
            }
            largest_gap = std::max(largest_gap, s.weight_rms());
            if (i >= 60) largest_excess = std::max(largest_excess, s.step_size - twin.step_size);
        }
        EXPECT_LT(largest_excess, 5.0 / 60.0 + 0.03) << "gap " << gap;
        EXPECT_GT(largest_gap, gap < 10 ? 0.05 : 0.2) << "there was nothing to recover from";
        EXPECT_EQ(s.state.state, TrackingState::kLive);
        EXPECT_LT(s.weight_rms(), 0.05);
    }
}

TEST(Pipeline, LostByPolicyHoldsOrDecays) {
    for (const LossPolicy policy : {LossPolicy::kHold, LossPolicy::kDecay}) {
        PipelineConfig config;
        config.loss_policy = policy;
        Scene s(config);
        for (int i = 0; i < 40; ++i) s.labelled();
        const std::array<float, kMaxShapes> last = s.state.weights;
        double largest = 0.0;
        for (int i = 0; i < 60; ++i) {  // one second
            s.idle();
            largest = std::max(largest, s.step_size);
            expect_contract(s.state, s.report, 30, 60);
            if (i < 17) {
                EXPECT_EQ(s.state.weights, last) << "frame " << i;
            }
            EXPECT_EQ(s.state.state,
                      i < 2 ? TrackingState::kLive : (i < 17 ? TrackingState::kHold : TrackingState::kLost));
        }
        if (policy == LossPolicy::kHold) {
            EXPECT_EQ(s.state.weights, last);
        } else {
            for (std::size_t w = 0; w < 30; ++w) EXPECT_EQ(s.state.weights[w], 0.0F);
            EXPECT_LT(largest, 1.2 / 24.0) << "400 ms are 24 frames";
        }
    }
}

// A flicker of good frames in the middle of the decay does not make it jump.
TEST(Pipeline, DecayGoesOnSmoothlyAfterAFlicker) {
    PipelineConfig config;
    config.loss_policy = LossPolicy::kDecay;
    Scene s(config);
    for (int i = 0; i < 40; ++i) s.labelled();
    double largest = 0.0;
    for (int round = 0; round < 5; ++round) {
        for (int i = 0; i < 25; ++i) {
            s.idle();
            largest = std::max(largest, s.step_size);
        }
        for (int i = 0; i < 2; ++i) {
            s.labelled();
            largest = std::max(largest, s.step_size);
        }
    }
    EXPECT_LT(largest, 1.2 / 24.0);
}

TEST(Pipeline, UnlabelledPointsMayComeInAnyOrder) {
    Scene a;
    Scene b;
    for (int frame = 0; frame < 120; ++frame) {
        std::vector<Vec3> points = a.seen_at(frame);
        for (Vec3& point : points) {
            if (a.random.chance(0.05)) point = kNowhere;
        }
        points.emplace_back(40.0, 20.0, 90.0);
        std::vector<std::size_t> order(points.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        b.random.shuffle(std::span<std::size_t>(order));
        std::vector<Vec3> shuffled;
        for (const std::size_t i : order) shuffled.push_back(points[i]);
        a.pipeline->step(PointFrame{frame * kFrameUs, points}, a.state, a.report);
        b.pipeline->step(PointFrame{frame * kFrameUs, shuffled}, b.state, b.report);
        ASSERT_EQ(a.state.weights, b.state.weights) << frame;
        ASSERT_EQ(a.state.state, b.state.state);
        for (std::size_t i = 0; i < order.size(); ++i)
            ASSERT_EQ(b.report.labels[i], a.report.labels[order[i]]);
        for (std::size_t k = 0; k < 60; ++k) {
            if (a.report.labels[k] >= 0) {
                ASSERT_EQ(a.report.labels[k], static_cast<int>(k));
            }
        }
    }
    EXPECT_EQ(a.state.state, TrackingState::kLive);
}

std::uint64_t digest_of_run(bool filter) {
    PipelineConfig config;
    config.filter = filter;
    Scene s(config);
    test::Digest digest;
    for (int i = 0; i < 100; ++i) {
        i % 40 < 35 ? s.labelled() : s.idle();
        digest.add(std::span<const float>(s.state.weights)).add(s.state.state).add(s.state.capture_us);
    }
    return digest.value();
}

TEST(Pipeline, EqualInputGivesEqualBits) {
    EXPECT_EQ(digest_of_run(true), digest_of_run(true));
    EXPECT_NE(digest_of_run(true), digest_of_run(false));
}

TEST(Pipeline, ConfiguringAgainStartsFromNothing) {
    Scene s;
    for (int i = 0; i < 50; ++i) s.labelled();
    ASSERT_TRUE(s.pipeline->configure(s.face.pack(), {}).has_value());
    Scene fresh;
    fresh.random = s.random;
    const int begin = s.frame;
    fresh.frame = begin;
    for (int i = 0; i < 30; ++i) {
        s.labelled();
        fresh.labelled();
        ASSERT_EQ(s.state.weights, fresh.state.weights) << i;
        ASSERT_EQ(s.state.state, fresh.state.state);
        ASSERT_EQ(s.state.held, fresh.state.held);
        ASSERT_EQ(s.state.capture_us, fresh.state.capture_us);
    }
    EXPECT_EQ(s.state.sequence, 79U) << "the sequence goes on: the host must not take it for another stream";
}

TEST(Pipeline, AMarkerStreamAfterCameraFramesIsNotPartial) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene s({}, options);
    for (int i = 0; i < 5; ++i) {
        s.pipeline->step(ObservationFrame{s.now(), {}, {}, 2}, s.state, s.report);
        ++s.frame;
    }
    for (int i = 0; i < 30; ++i) {
        const std::vector<Vec3> points = s.seen_at(s.frame);
        s.pipeline->step(PointFrame{s.now(), points}, s.state, s.report);
        ++s.frame;
    }
    EXPECT_EQ(s.state.state, TrackingState::kLive);
}

TEST(Pipeline, ACameraThatIsGoneMakesItPartial) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene s({}, options);
    std::vector<TrackingState> states;
    for (int i = 0; i < 60; ++i) {
        const bool gone = i >= 20 && i < 30;
        const double time_s = i / 60.0;
        const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(time_s));
        ObservationFrame frame = s.observed(truth);
        if (gone) {
            frame.status[1] = CameraStatus::kGone;
            frame.cameras[1] = {};
        }
        s.pipeline->step(frame, s.state, s.report);
        expect_contract(s.state, s.report, 30, 60);
        EXPECT_EQ((s.state.faults & fault_bit(Fault::kCameraGone)) != 0, gone) << i;
        states.push_back(s.state.state);
        ++s.frame;
    }
    EXPECT_EQ(states[20], TrackingState::kPartial);
    EXPECT_EQ(states[33], TrackingState::kPartial);
    for (const int i : {20, 25, 29, 33})
        EXPECT_EQ(states[static_cast<std::size_t>(i)], TrackingState::kPartial);
}

// Dark discs on grey skin where the projection puts them.
std::vector<std::uint8_t> draw(const CameraModel& camera, const std::vector<Observation>& dots) {
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width_px * camera.height_px), 170);
    for (const Observation& dot : dots) {
        const int reach = 7;
        const int x0 = static_cast<int>(std::lround(dot.x_px));
        const int y0 = static_cast<int>(std::lround(dot.y_px));
        for (int y = std::max(0, y0 - reach); y <= std::min(camera.height_px - 1, y0 + reach); ++y) {
            for (int x = std::max(0, x0 - reach); x <= std::min(camera.width_px - 1, x0 + reach); ++x) {
                const double d =
                    std::hypot(x - static_cast<double>(dot.x_px), y - static_cast<double>(dot.y_px));
                const double cover = std::clamp(4.0 - d + 0.5, 0.0, 1.0);  // radius 4 px, soft edge
                auto& pixel = pixels[static_cast<std::size_t>(y * camera.width_px + x)];
                pixel = static_cast<std::uint8_t>(pixel - static_cast<int>(cover * 120.0) * pixel / 170);
            }
        }
    }
    return pixels;
}

TEST(Pipeline, RecordedObservationsSolveToTheSameBits) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene images({}, options);
    Scene recorded({}, options);
    int live = 0;
    double worst = 0.0;
    for (int i = 0; i < 40; ++i) {
        const std::vector<Vec3> truth = images.face.positions(images.face.weights_at(i / 60.0));
        FrameSet set;
        set.capture_us = images.now();
        set.camera_count = 2;
        std::array<std::vector<std::uint8_t>, 2> pixels;
        for (std::size_t c = 0; c < 2; ++c) {
            const CameraModel camera = images.face.pack().cameras[c];
            pixels[c] = draw(camera, images.face.observe(c, truth, 0.0, 0.0, 0, images.random).observations);
            set.images[c] = {pixels[c].data(), camera.width_px, camera.height_px, camera.width_px};
            set.status[c] = CameraStatus::kGood;
        }
        images.pipeline->step(set, images.state, images.report);
        ++images.frame;
        ObservationFrame frame;
        frame.capture_us = set.capture_us;
        frame.camera_count = 2;
        for (std::size_t c = 0; c < 2; ++c) {
            frame.cameras[c] = images.pipeline->observations(c).span();
            frame.status[c] = images.state.cameras[c];
        }
        recorded.pipeline->step(frame, recorded.state, recorded.report);
        ++recorded.frame;
        ASSERT_GT(images.report.observations[0], 20) << "the drawn dots are found";
        ASSERT_EQ(images.state.weights, recorded.state.weights) << i;
        ASSERT_EQ(images.state.state, recorded.state.state);
        ASSERT_EQ(images.state.cameras, recorded.state.cameras);
        ASSERT_EQ(images.state.capture_us, recorded.state.capture_us);
        ASSERT_EQ(images.report.objective_mm2, recorded.report.objective_mm2);
        live += images.state.held ? 0 : 1;
        if (!images.state.held) worst = std::max(worst, images.weight_rms());
    }
    EXPECT_GE(live, 30);
    std::printf("drawn dots: worst weight rms %.3f\n", worst);
}

}  // namespace
}  // namespace rig
