// What the pipeline makes of how cameras and dots sit: reference marks, a neutral that is taken, cameras that
// stand beside the performer.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/base/math.hpp"
#include "tests/unit/core/pipeline/pipeline_scene.hpp"

namespace rig {
namespace {

using Scene = test::PipelineScene;

// Dots glued 1 mm aside of where the pack was trained: after a second at rest the solve is as good as with
// dots in their places.
TEST(Pipeline, ANeutralTakenAtRestUndoesDotsThatAreGluedAside) {
    PipelineConfig config;
    config.filter = false;
    const auto run = [&](double aside_mm, bool take) {
        Scene s(config);
        test::SeededRandom ways(99);
        std::vector<Vec3> aside;
        for (std::size_t k = 0; k < 60; ++k) {
            const Vec3 way{ways.normal(0.0, 1.0), ways.normal(0.0, 1.0), ways.normal(0.0, 1.0)};
            aside.push_back(aside_mm * way.normalized());
        }
        const auto step = [&](const std::vector<double>& weights) {
            std::vector<Vec3> points = s.face.positions(weights);
            for (std::size_t k = 0; k < points.size(); ++k) points[k] += aside[k];
            points = test::moved(test::creeping_slip(s.frame / 60.0), points);
            test::add_noise(points, 0.1, s.random);
            s.pipeline->step(LabelledFrame{s.now(), points}, s.state, s.report);
            ++s.frame;
        };
        const std::vector<double> rest(s.face.shape_count(), 0.0);
        for (int i = 0; i < 30; ++i) step(rest);
        if (take) s.pipeline->begin_neutral();
        for (int i = 0; i < 60; ++i) step(rest);
        EXPECT_EQ(s.report.neutral.phase, take ? NeutralPhase::kTaken : NeutralPhase::kIdle);
        s.pipeline->reset_tracking();  // which does not lose the neutral
        double sum = 0.0;
        for (int i = 0; i < 300; ++i) {
            step(s.face.weights_at(s.frame / 60.0));
            sum += s.weight_rms() * s.weight_rms() / 300.0;
        }
        return std::sqrt(sum);
    };
    const double in_place = run(0.0, false);
    const double glued = run(1.0, false);
    const double taken = run(1.0, true);
    std::printf("weight rms: dots in place %.4f, 1 mm aside %.4f, after the neutral %.4f\n", in_place, glued,
                taken);
    EXPECT_GT(glued, 2.0 * in_place);
    EXPECT_LT(taken, 1.15 * in_place);
}

TEST(Pipeline, ANeutralIsRefusedWhileTalkingAndNothingChanges) {
    Scene s;
    Scene plain;
    for (int i = 0; i < 120; ++i) {
        if (i == 30) s.pipeline->begin_neutral();
        s.labelled();
        plain.labelled();
        ASSERT_EQ(s.state.weights, plain.state.weights) << i;
        EXPECT_EQ(s.report.neutral.phase, i < 30 || i > 89 ? NeutralPhase::kIdle
                                          : i == 89        ? NeutralPhase::kRefused
                                                           : NeutralPhase::kCollecting);
        if (i == 89) {
            EXPECT_EQ(s.report.neutral.refusal, NeutralRefusal::kMoved);
        }
    }
}

// A frame of both cameras as they sit, helmet marks among the dots.
void step_with_marks(Scene& s, std::span<const HelmetMark> marks, const Vec3& turn_rad) {
    const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(s.frame / 60.0));
    std::array<std::vector<Observation>, 2> views;
    ObservationFrame frame;
    frame.capture_us = s.now();
    frame.camera_count = 2;
    for (std::size_t c = 0; c < 2; ++c) {
        const CameraModel camera = s.face.pack().cameras[c];
        const CameraModel sits = c == 1 ? turned_camera(camera, turn_rad) : camera;
        const auto add = [&](const Vec3& at) {
            const test::ReferencePixel p = test::reference_project(sits, at);
            views[c].push_back({static_cast<float>(static_cast<double>(p.x_px) + s.random.normal(0.0, 0.1)),
                                static_cast<float>(static_cast<double>(p.y_px) + s.random.normal(0.0, 0.1)),
                                8.0F, 0.5F, 0.9F});
        };
        for (const HelmetMark& mark : marks) add(mark.headset_mm);
        for (const Vec3& at : truth) add(at);
        frame.status[c] = CameraStatus::kGood;
        frame.cameras[c] = views[c];
    }
    s.pipeline->step(frame, s.state, s.report);
    ++s.frame;
}

TEST(Pipeline, AKnockedCameraIsReportedAndItsMarksAreNoMarkersOfTheFace) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene s({}, options);
    SolvePack pack = s.face.pack();
    for (const double x : {-70.0, 0.0, 70.0})
        pack.reference_marks[pack.reference_mark_count++] = {Vec3{x, 66.0, 12.0}, 3};
    ASSERT_TRUE(s.pipeline->configure(pack, {}).has_value());
    const std::span<const HelmetMark> marks = std::span(pack.reference_marks).first(3);
    const Vec3 turn{0.012, -0.009, 0.005};
    int raised = -1;
    for (int i = 0; i < 200; ++i) {
        step_with_marks(s, marks, i < 60 ? Vec3{Vec3::Zero()} : turn);
        const bool fault = (s.state.faults & fault_bit(Fault::kRigMoved)) != 0;
        if (fault && raised < 0) raised = i;
        EXPECT_TRUE(s.report.mounts[0].measured && s.report.mounts[1].measured) << i;
        EXPECT_EQ(s.report.mounts[1].drifted, fault);
        EXPECT_FALSE(s.report.mounts[0].drifted);
        EXPECT_EQ(s.report.observations[0], 63) << "what was seen is told as it was seen";
        for (std::size_t c = 0; c < 2; ++c) {
            for (std::size_t k = 0; k < 60; ++k) {
                const int at = s.pipeline->matches()[c][k];
                // Observation 3 + k is marker k.
                if (at >= 0) {
                    ASSERT_EQ(at, static_cast<int>(k) + 3) << i;
                }
            }
        }
    }
    EXPECT_GE(raised, 89);
    EXPECT_LE(raised, 120);
    EXPECT_LT((s.report.mounts[1].turn_rad - turn).norm(), 1e-3);
    EXPECT_LT(s.weight_rms(), 0.05);
    s.idle();
    EXPECT_NE(s.state.faults & fault_bit(Fault::kRigMoved), 0U) << "a tick without pictures mends no bracket";
    ASSERT_TRUE(s.pipeline->configure(pack, {}).has_value());
    s.idle();
    EXPECT_EQ(s.state.faults & fault_bit(Fault::kRigMoved), 0U);
}

TEST(Pipeline, ARigWithoutMarksSolvesToTheSameBitsAsOneWhoseMarksNobodySees) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene plain({}, options);
    Scene marked({}, options);
    SolvePack pack = marked.face.pack();
    pack.reference_marks[pack.reference_mark_count++] = {Vec3{300.0, 200.0, 100.0}, 3};
    ASSERT_TRUE(marked.pipeline->configure(pack, {}).has_value());
    for (int i = 0; i < 40; ++i) {
        step_with_marks(plain, {}, Vec3::Zero());
        step_with_marks(marked, {}, Vec3::Zero());
        ASSERT_EQ(plain.state.weights, marked.state.weights) << i;
        EXPECT_FALSE(plain.report.mounts[0].measured);
    }
}

// A head that nods and turns before two cameras on stands.
TEST(Pipeline, CamerasThatStandTellTheHeadsPoseAndNoSlip) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    PipelineConfig config;
    config.camera_on_head = false;
    Scene s(config, options);
    double turn2 = 0.0;
    double shift2 = 0.0;
    double weights2 = 0.0;
    int known = 0;
    for (int i = 0; i < 240; ++i) {
        const double t = i / 60.0;
        const Rigid head{rotation_from_vector(Vec3{0.12 * std::sin(2.0 * t), 0.25 * std::sin(1.3 * t), 0.0}),
                         Vec3{12.0 * std::sin(0.9 * t), 8.0 * std::sin(1.7 * t), 5.0 * std::sin(t)}};
        const std::vector<Vec3> truth = test::moved(head, s.face.positions(s.face.weights_at(t)));
        const ObservationFrame frame = s.observed(truth);
        s.pipeline->step(frame, s.state, s.report);
        ++s.frame;
        EXPECT_EQ(s.state.faults & fault_bit(Fault::kRigMoved), 0U);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_EQ(s.state.slip.rotation_rad[a], 0.0F);
            EXPECT_EQ(s.state.slip.translation_mm[a], 0.0F);
        }
        if (i < 10) continue;
        known += s.report.head_pose.known ? 1 : 0;
        EXPECT_EQ(s.state.head.status, HeadStatus::kKnown);
        EXPECT_EQ(s.state.head.capture_us, frame.capture_us)
            << "of these pictures, whatever smooths the weights";
        EXPECT_NEAR(s.state.head.translation_mm[0], s.report.head_pose.reference_from_face.translation_mm[0],
                    1e-4);
        EXPECT_EQ(s.state.head.points_used, s.report.head_pose.points_used);
        EXPECT_GT(s.state.head.translation_sigma_mm[2], 0.0F);
        const Mat3 between = s.report.head_pose.reference_from_face.rotation * head.rotation.transpose();
        turn2 += vector_from_rotation(between).squaredNorm() / 230.0;
        shift2 +=
            (s.report.head_pose.reference_from_face.translation_mm - head.translation_mm).squaredNorm() /
            230.0;
        weights2 += s.weight_rms() * s.weight_rms() / 230.0;
    }
    std::printf(
        "head before standing cameras: pose known in %d of 230, turn %.3f degrees rms, place %.2f mm, "
        "weight rms %.3f\n",
        known, std::sqrt(turn2) * 57.29578, std::sqrt(shift2), std::sqrt(weights2));
    EXPECT_EQ(known, 230);
    EXPECT_LT(std::sqrt(turn2), 0.01);
    EXPECT_LT(std::sqrt(shift2), 1.0);
    EXPECT_LT(std::sqrt(weights2), 0.06);
    s.idle();
    EXPECT_EQ(s.state.head.status, HeadStatus::kUnknown) << "a head is never held";
    EXPECT_EQ(s.state.head.translation_mm, (std::array<float, 3>{}));
}

// The stand of the second camera was knocked: by 7 px, which its marks tell. The head is where it is, not
// where the calibrated camera would have it.
TEST(Pipeline, AKnockedCameraThatStandsTellsTheHeadsPoseAsItSits) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    PipelineConfig config;
    config.camera_on_head = false;
    Scene s(config, options);
    SolvePack pack = s.face.pack();
    for (const double x : {-70.0, 0.0, 70.0})
        pack.reference_marks[pack.reference_mark_count++] = {Vec3{x, 66.0, 12.0}, 3};
    ASSERT_TRUE(s.pipeline->configure(pack, config).has_value());
    const std::span<const HelmetMark> marks = std::span(pack.reference_marks).first(3);
    const Vec3 turn{0.012, -0.009, 0.005};
    double rms_px = 0.0;
    double turn_rad = 0.0;
    double shift_mm = 0.0;
    for (int i = 0; i < 200; ++i) {
        step_with_marks(s, marks, i < 60 ? Vec3{Vec3::Zero()} : turn);
        if (i < 140) continue;  // the running estimate has settled by then
        const HeadPose& pose = s.report.head_pose;
        ASSERT_TRUE(pose.known) << i << " refusal " << static_cast<int>(pose.refusal);
        EXPECT_GE(pose.points_used, 110) << i;
        rms_px = std::max(rms_px, pose.rms_px);
        turn_rad = std::max(turn_rad, vector_from_rotation(pose.reference_from_face.rotation).norm());
        shift_mm = std::max(shift_mm, pose.reference_from_face.translation_mm.norm());
    }
    std::printf("knocked camera on a stand: pose off by at most %.3f degrees and %.2f mm, rms %.2f px\n",
                turn_rad * 57.29578, shift_mm, rms_px);
    EXPECT_LT(rms_px, 0.4);
    EXPECT_LT(turn_rad, 0.02);
    EXPECT_LT(shift_mm, 2.0);
}

TEST(Pipeline, CamerasOnTheHelmetTellNoHeadPose) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene s({}, options);
    for (int i = 0; i < 10; ++i) step_with_marks(s, {}, Vec3::Zero());
    EXPECT_FALSE(s.report.head_pose.known);
    EXPECT_EQ(s.report.head_pose.points_used, 0);
    EXPECT_EQ(s.state.head.status, HeadStatus::kUnknown);
    EXPECT_EQ(s.state.head.capture_us, 0);
}

// What tracking is begun anew from is what configure() leaves, how the cameras sit included: a recording that
// begins with it can be solved again to the same bits.
TEST(Pipeline, TrackingBegunAnewKnowsNothingOfTheFramesBefore) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    Scene used({}, options);
    Scene fresh({}, options);
    SolvePack pack = used.face.pack();
    for (const double x : {-70.0, 0.0, 70.0})
        pack.reference_marks[pack.reference_mark_count++] = {Vec3{x, 66.0, 12.0}, 3};
    ASSERT_TRUE(used.pipeline->configure(pack, {}).has_value());
    ASSERT_TRUE(fresh.pipeline->configure(pack, {}).has_value());
    const std::span<const HelmetMark> marks = std::span(pack.reference_marks).first(3);
    for (int i = 0; i < 120; ++i) step_with_marks(used, marks, Vec3{0.012, -0.009, 0.005});
    ASSERT_TRUE(used.report.mounts[1].drifted);
    used.pipeline->reset_tracking();
    fresh.frame = used.frame;
    used.random = fresh.random = test::SeededRandom(5);
    for (int i = 0; i < 60; ++i) {
        step_with_marks(used, marks, Vec3::Zero());
        step_with_marks(fresh, marks, Vec3::Zero());
        EXPECT_EQ(used.report.bootstrapped, fresh.report.bootstrapped) << i;
        ASSERT_EQ(used.report.mounts[1].turn_rad, fresh.report.mounts[1].turn_rad) << i;
        ASSERT_EQ(used.report.mounts[1].drifted, fresh.report.mounts[1].drifted) << i;
        for (std::size_t k = 0; k < 60; ++k)
            ASSERT_EQ(used.report.face_markers_mm[k], fresh.report.face_markers_mm[k]) << i;
    }
}

// Discs of one grey value on another, far enough apart for any detector.
std::vector<std::uint8_t> discs(std::uint8_t ground, std::uint8_t dot) {
    std::vector<std::uint8_t> pixels(480U * 640U, ground);
    for (std::size_t y = 0; y < 640; ++y) {
        for (std::size_t x = 0; x < 480; ++x) {
            const double dx = static_cast<double>(x % 60) - 30.0;
            const double dy = static_cast<double>(y % 64) - 32.0;
            if (dx * dx + dy * dy < 25.0) pixels[y * 480 + x] = dot;
        }
    }
    return pixels;
}

TEST(Pipeline, TrackingBegunAnewForgetsWhichSideTheDotsAreOn) {
    test::SyntheticFaceOptions options;
    options.camera_count = 1;
    Scene s({}, options);
    const std::vector<std::uint8_t> bright = discs(70, 220);
    const std::vector<std::uint8_t> dark = discs(180, 30);
    const auto step = [&s](const std::vector<std::uint8_t>& pixels) {
        FrameSet frame;
        frame.capture_us = s.now();
        frame.camera_count = 1;
        frame.images[0] = ImageView{pixels.data(), 480, 640, 480};
        frame.status[0] = CameraStatus::kGood;
        s.pipeline->step(frame, s.state, s.report);
        ++s.frame;
    };
    for (int i = 0; i < 20; ++i) step(bright);
    ASSERT_EQ(s.pipeline->detector_report(0).polarity, MarkerPolarity::kBright);
    ASSERT_EQ(s.report.observations[0], 80);
    s.pipeline->reset_tracking();
    step(dark);
    EXPECT_EQ(s.pipeline->detector_report(0).polarity, MarkerPolarity::kDark);
    EXPECT_EQ(s.report.observations[0], 80);
    EXPECT_EQ(s.state.faults & fault_bit(Fault::kExposure), 0U) << "other light than before is no step";
}

}  // namespace
}  // namespace rig
