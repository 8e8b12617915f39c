#include "core/infer/inference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/stabilise/stabiliser.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    Scene() {
        const SolvePack pack = face.pack();
        model = test::shape_model_of(pack);
        auto gaussian_scratch = std::make_unique<FaceGaussianWorkspace>();
        build_face_gaussian(pack, *model, *gaussian_scratch, *gaussian);
        reset_inference(*inference);
    }

    void see(const std::vector<Vec3>& positions, const std::vector<Mat3>& informations) {
        named->count = 60;
        for (std::size_t k = 0; k < 60; ++k) {
            named->markers[k] = NamedMarker{};
            if (informations[k].norm() == 0.0) continue;
            named->markers[k].seen = true;
            named->markers[k].position_mm = positions[k];
            named->markers[k].information = informations[k];
        }
        stabilise(*model, config, *named, *state, *workspace, *stabilised, report);
        infer_missing(*gaussian, *stabilised, *inference, *output);
    }

    test::SyntheticFace face{{}};
    StabiliserConfig config;
    StabiliserReport report;
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<FaceGaussian> gaussian = std::make_unique<FaceGaussian>();
    std::unique_ptr<InferenceWorkspace> inference = std::make_unique<InferenceWorkspace>();
    std::unique_ptr<StabiliserState> state = std::make_unique<StabiliserState>();
    std::unique_ptr<StabiliserWorkspace> workspace = std::make_unique<StabiliserWorkspace>();
    std::unique_ptr<NamedMarkers> named = std::make_unique<NamedMarkers>();
    std::unique_ptr<StabiliserOutput> stabilised = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceOutput> output = std::make_unique<InferenceOutput>();
    test::SeededRandom random{151};
};

// A quarter of the face hidden, in one patch, as a hand does it.
TEST(Inference, HiddenPatchIsFarCloserThanTheNeutralFace) {
    Scene s;
    const std::vector<Vec3> neutral = s.face.positions(std::vector<double>(30, 0.0));
    double inferred2 = 0.0;
    double neutral2 = 0.0;
    int hidden = 0;
    for (int frame = 0; frame < 240; ++frame) {
        const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(frame / 60.0));
        std::vector<Vec3> seen = truth;
        test::add_noise(seen, 0.1, s.random);
        std::vector<Mat3> informations(60, 100.0 * Mat3::Identity());
        const Vec3 patch = neutral[static_cast<std::size_t>(frame / 40 * 9)];
        for (std::size_t k = 0; k < 60; ++k) {
            if ((neutral[k] - patch).norm() < 28.0) informations[k] = Mat3::Zero();
        }
        s.see(seen, informations);
        std::uint16_t missing = 0;
        for (std::size_t k = 0; k < 60; ++k) {
            if (s.stabilised->markers[k].seen) {
                ASSERT_EQ(s.output->position_mm[k], s.stabilised->markers[k].position_mm)
                    << "measured ones stay";
                continue;
            }
            ++missing;
            inferred2 += (s.output->position_mm[k] - truth[k]).squaredNorm();
            neutral2 += (neutral[k] - truth[k]).squaredNorm();
        }
        ASSERT_EQ(s.output->inferred, missing);
        hidden += missing;
    }
    const double rms = std::sqrt(inferred2 / (3.0 * hidden));
    const double copied = std::sqrt(neutral2 / (3.0 * hidden));
    std::printf("hidden markers: %.3f mm inferred, %.3f mm copied from neutral (%d)\n", rms, copied, hidden);
    EXPECT_LT(rms, 0.55 * copied);
    EXPECT_GT(rms, 0.02 * copied) << "too good: is the patch hidden?";
}

TEST(Inference, HiddenMarkersAreInferredWithoutStabilisationToo) {
    Scene s;
    s.config.enabled = false;
    double inferred2 = 0.0;
    double mean2 = 0.0;
    for (int frame = 0; frame < 60; ++frame) {
        const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(frame / 20.0));
        std::vector<Mat3> informations(60, 100.0 * Mat3::Identity());
        for (std::size_t k = 0; k < 60; k += 7) informations[k] = Mat3::Zero();
        s.see(truth, informations);
        for (std::size_t k = 0; k < 60; k += 7) {
            inferred2 += (s.output->position_mm[k] - truth[k]).squaredNorm();
            mean2 += (s.model->mean_mm[k] - truth[k]).squaredNorm();
        }
    }
    EXPECT_LT(std::sqrt(inferred2 / mean2), 0.5) << "the mean face is no inference";
}

TEST(Inference, OneViewKeepsTheDirectionAndTakesTheDepth) {
    Scene s;
    const Vec3 camera{0.0, -40.0, 210.0};
    double across2 = 0.0;
    double along2 = 0.0;
    double wrong2 = 0.0;
    int count = 0;
    for (int frame = 0; frame < 60; ++frame) {
        const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(frame / 20.0));
        std::vector<Vec3> seen = truth;
        std::vector<Mat3> informations(60, 100.0 * Mat3::Identity());
        for (std::size_t k = 0; k < 60; k += 5) {
            const Vec3 ray = (truth[k] - camera).normalized();
            const double wrong_depth = s.random.uniform(-4.0, 4.0);
            wrong2 += wrong_depth * wrong_depth;
            seen[k] += wrong_depth * ray;
            informations[k] = 100.0 * (Mat3::Identity() - ray * ray.transpose());
        }
        s.see(seen, informations);
        for (std::size_t k = 0; k < 60; k += 5) {
            const Vec3 ray = (truth[k] - camera).normalized();
            const Vec3 error = s.output->position_mm[k] - truth[k];
            const double along = error.dot(ray);
            along2 += along * along;
            across2 += error.squaredNorm() - along * along;
            ++count;
        }
    }
    std::printf("one view: %.4f mm across, %.3f mm along, %.3f mm before\n", std::sqrt(across2 / (2 * count)),
                std::sqrt(along2 / count), std::sqrt(wrong2 / count));
    EXPECT_LT(std::sqrt(across2 / (2 * count)), 0.1);
    EXPECT_LT(along2, 0.1 * wrong2);
}

TEST(Inference, ConfidenceIsOneWhereMeasuredAndLessElsewhere) {
    Scene s;
    const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(1.0));
    std::vector<Mat3> informations(60, 100.0 * Mat3::Identity());
    for (std::size_t k = 0; k < 60; k += 9) informations[k] = Mat3::Zero();
    informations[4] = Vec3{60.0, 60.0, 0.0}.asDiagonal();  // one view, along z
    s.see(truth, informations);
    for (std::size_t k = 0; k < 60; ++k) {
        if (k % 9 != 0 && k != 4) {
            EXPECT_EQ(s.output->confidence[k], 1.0F);
            EXPECT_EQ(s.output->deviation_mm[k], 0.0F);
            continue;
        }
        EXPECT_GT(s.output->confidence[k], 0.0F) << k;
        EXPECT_LT(s.output->confidence[k], 1.0F) << k;
        EXPECT_GT(s.output->deviation_mm[k], 0.0F) << k;
        const double usual = std::sqrt(s.gaussian->prior_mm2[k]);
        EXPECT_NEAR(static_cast<double>(s.output->confidence[k]),
                    1.0 - static_cast<double>(s.output->deviation_mm[k]) / usual, 1e-5);
    }
}

// What was worked out for the frame before may save time, and nothing else.
TEST(Inference, DoesNotDependOnTheFrameBefore) {
    Scene s;
    const auto fresh = std::make_unique<InferenceWorkspace>();
    const auto again = std::make_unique<InferenceOutput>();
    for (int frame = 0; frame < 60; ++frame) {
        const std::vector<Vec3> truth = s.face.positions(s.face.weights_at(frame / 20.0));
        std::vector<Mat3> informations(60, 100.0 * Mat3::Identity());
        // Patterns that stay for three frames: few hidden, many hidden, one view among them.
        const std::size_t step = frame / 3 % 3 == 0 ? 13 : 2;
        for (std::size_t k = 0; k < 60; k += step) informations[k] = Mat3::Zero();
        if (frame / 3 % 3 == 2) informations[1] = Vec3{60.0, 60.0, 0.0}.asDiagonal();
        s.see(truth, informations);
        reset_inference(*fresh);
        infer_missing(*s.gaussian, *s.stabilised, *fresh, *again);
        for (std::size_t k = 0; k < 60; ++k) {
            ASSERT_EQ(s.output->position_mm[k], again->position_mm[k]) << frame << " " << k;
            ASSERT_EQ(s.output->confidence[k], again->confidence[k]) << frame << " " << k;
        }
    }
}

TEST(Inference, StaysNearTheMeanFaceWhateverWasMeasured) {
    Scene s;
    s.see(s.face.positions(s.face.weights_at(1.0)), std::vector<Mat3>(60, 100.0 * Mat3::Identity()));
    for (const double far_mm : {1e3, 1e9, 1e200}) {
        for (const std::size_t step : {2U, 11U}) {
            for (std::size_t k = 0; k < 60; ++k) {
                s.stabilised->markers[k].seen = k % step != 0;
                s.stabilised->markers[k].information = (k % step != 0 ? 100.0 : 0.0) * Mat3::Identity();
                s.stabilised->markers[k].position_mm = Vec3{far_mm, -far_mm, far_mm};
            }
            infer_missing(*s.gaussian, *s.stabilised, *s.inference, *s.output);
            for (std::size_t k = 0; k < 60; k += step) {
                const double gap = (s.output->position_mm[k] - s.gaussian->mean_mm[k]).norm();
                EXPECT_LE(gap, 6.0001 * std::sqrt(s.gaussian->prior_mm2[k])) << far_mm << " " << k;
            }
        }
    }
}

TEST(Inference, NothingSeenIsTheExpectedFace) {
    Scene s;
    s.see(std::vector<Vec3>(60, Vec3::Zero()), std::vector<Mat3>(60, Mat3::Zero()));
    EXPECT_EQ(s.output->inferred, 60);
    for (std::size_t k = 0; k < 60; ++k)
        EXPECT_LT((s.output->position_mm[k] - s.model->mean_mm[k]).norm(), 1e-12);
    for (std::size_t k = 0; k < 60; ++k) EXPECT_NEAR(s.output->confidence[k], 0.0F, 1e-6F);
}

}  // namespace
}  // namespace rig
