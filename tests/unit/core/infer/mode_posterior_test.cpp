#include "core/infer/mode_posterior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <numeric>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    Scene() {
        const SolvePack pack = synthetic.pack();
        const auto model = test::shape_model_of(pack);
        const auto scratch = std::make_unique<FaceGaussianWorkspace>();
        build_face_gaussian(pack, *model, *scratch, *face);
        for (std::size_t k = 0; k < face->marker_count; ++k) measure(k);
    }

    void measure(std::size_t k) {
        posterior->knowledge[k] = MarkerKnowledge::kMeasured;
        posterior->weight[k] = face->measured_weight(k) * Mat3::Identity();
    }
    void hide(std::size_t k) {
        posterior->knowledge[k] = MarkerKnowledge::kHidden;
        posterior->weight[k] = Mat3::Zero();
    }
    // `share` of a measured marker's weight across a ray, nothing along it.
    void see_from_one_side(std::size_t k, double share) {
        Vec3 ray{random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0)};
        ray.normalize();
        posterior->knowledge[k] = MarkerKnowledge::kPartly;
        posterior->weight[k] = share * face->measured_weight(k) * (Mat3::Identity() - ray * ray.transpose());
    }

    [[nodiscard]] Eigen::MatrixXd modes_of(std::size_t k) const {
        Eigen::MatrixXd rows(3, face->mode_count);
        for (Eigen::Index a = 0; a < 3; ++a) {
            for (Eigen::Index j = 0; j < rows.cols(); ++j)
                rows(a, j) = face->mode_row(3 * k + static_cast<std::size_t>(a))[j];
        }
        return rows;
    }
    [[nodiscard]] Eigen::MatrixXd covariance() const {
        Eigen::MatrixXd equations = Eigen::MatrixXd::Identity(face->mode_count, face->mode_count);
        for (std::size_t k = 0; k < face->marker_count; ++k)
            equations += modes_of(k).transpose() * posterior->weight[k] * modes_of(k);
        return equations.inverse();
    }

    void expect_written_out(const char* what) {
        ASSERT_TRUE(factor_modes(*face, *posterior)) << what;
        const Eigen::MatrixXd expected = covariance();
        Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(face->mode_count, -1.0, 2.0);
        const Eigen::VectorXd solved = expected * x;
        solve_modes(*face, *posterior, x.data());
        EXPECT_LT((x - solved).norm(), 1e-10 * solved.norm()) << what;

        std::vector<std::uint16_t> all(face->marker_count);
        std::iota(all.begin(), all.end(), std::uint16_t{0});
        find_variances(*face, all, *posterior, *variance);
        for (std::size_t k = 0; k < face->marker_count; ++k) {
            const Mat3 kept = Mat3::Identity() - face->residual_mm2[k] * posterior->weight[k];
            const Eigen::MatrixXd narrowed = kept * modes_of(k);
            const double trace =
                face->residual_mm2[k] * kept.trace() + (narrowed * expected * narrowed.transpose()).trace();
            EXPECT_NEAR((*variance)[k], trace, 1e-5 * trace) << what << " " << k;
        }
    }

    test::SeededRandom random{171};
    test::SyntheticFace synthetic{{}};
    std::unique_ptr<FaceGaussian> face = std::make_unique<FaceGaussian>();
    std::unique_ptr<ModePosterior> posterior = std::make_unique<ModePosterior>();
    std::unique_ptr<std::array<double, kMaxMarkers>> variance =
        std::make_unique<std::array<double, kMaxMarkers>>();
};

TEST(ModePosterior, IsTheEquationsWrittenOut) {
    Scene s;
    s.expect_written_out("all measured");
    for (std::size_t k = 0; k < 20; ++k) s.see_from_one_side(k, 1.0);
    s.expect_written_out("a third from one side");
    for (std::size_t k = 10; k < 25; ++k) s.see_from_one_side(k, 0.3);
    s.expect_written_out("some of them less sure");
    for (std::size_t k = 20; k < 52; ++k) s.hide(k);
    s.expect_written_out("more hidden than measured");
    for (std::size_t k = 0; k < 60; ++k) s.hide(k);
    s.expect_written_out("nothing known");
}

TEST(ModePosterior, WhatWasKeptChangesNothing) {
    Scene s;
    const auto fresh = std::make_unique<ModePosterior>();
    for (int frame = 0; frame < 40; ++frame) {
        const std::size_t k = s.random.below(60);
        if (frame % 4 == 0) s.hide(k);
        if (frame % 4 == 1) s.see_from_one_side(k, s.random.uniform(0.1, 1.0));
        if (frame % 4 == 2) s.measure(s.random.below(60));
        if (frame == 20) {
            for (std::size_t h = 0; h < 40; ++h) s.hide(h);
        }
        fresh->knowledge = s.posterior->knowledge;
        fresh->weight = s.posterior->weight;
        reset_modes(*fresh);
        ASSERT_TRUE(factor_modes(*s.face, *s.posterior));
        ASSERT_TRUE(factor_modes(*s.face, *fresh));
        ASSERT_EQ(s.posterior->factor, fresh->factor) << frame;
    }
}

}  // namespace
}  // namespace rig
