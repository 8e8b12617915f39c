#include "core/infer/face_gaussian.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

std::unique_ptr<FaceGaussian> built(const SolvePack& pack) {
    const auto model = test::shape_model_of(pack);
    auto workspace = std::make_unique<FaceGaussianWorkspace>();
    auto face = std::make_unique<FaceGaussian>();
    build_face_gaussian(pack, *model, *workspace, *face);
    return face;
}

// Entry of the covariance of the measured coordinates.
double covariance(const FaceGaussian& face, std::size_t r, std::size_t s) {
    double sum = r == s ? face.noise_mm2 + face.residual_mm2[r / 3] : 0.0;
    for (std::size_t j = 0; j < face.mode_count; ++j) sum += face.mode_row(r)[j] * face.mode_row(s)[j];
    return sum;
}

void expect_precision_inverts(const FaceGaussian& face) {
    const std::size_t rows = 3U * face.marker_count;
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t s = 0; s < rows; ++s) {
            double sum = 0.0;
            for (std::size_t t = 0; t < rows; ++t)
                sum += face.precision[r * kMaxRows + t] * covariance(face, t, s);
            ASSERT_NEAR(sum, r == s ? 1.0 : 0.0, 1e-8) << r << " " << s;
        }
        for (std::size_t t = rows; t < padded(rows); ++t) ASSERT_EQ(face.precision[r * kMaxRows + t], 0.0);
    }
}

TEST(FaceGaussian, OfThePacksMarkerSet) {
    const test::SamplePack sample({.markers = 9, .shapes = 5, .marker_sets = true});
    const auto face = built(sample.view);
    const MarkerSetModel& set = sample.view.marker_sets[0];
    ASSERT_EQ(face->mode_count, set.mode_count);
    for (std::size_t r = 0; r < 27; ++r) {
        EXPECT_NEAR(face->mean_mm[r / 3][static_cast<Eigen::Index>(r % 3)],
                    static_cast<double>(sample.neutral[r]) + static_cast<double>(set.mean_mm[r]), 1e-9);
        for (std::size_t j = 0; j < set.mode_count; ++j) {
            EXPECT_NEAR(face->mode_row(r)[j],
                        static_cast<double>(set.modes[j * 27 + r]) *
                            std::sqrt(static_cast<double>(set.variance_mm2[j])),
                        1e-9);
        }
    }
    expect_precision_inverts(*face);
}

TEST(FaceGaussian, OfTheRigsShapesWhenThePackHasNoSets) {
    const test::SyntheticFace synthetic({.marker_count = 20, .shape_count = 12});
    const auto face = built(synthetic.pack());
    ASSERT_EQ(face->marker_count, 20);
    EXPECT_GT(face->mode_count, 5);
    expect_precision_inverts(*face);
    // The trace of the prior is that of B S B^T.
    const SolvePack pack = synthetic.pack();
    for (std::size_t k = 0; k < 20; ++k) {
        double trace = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t i = 0; i < 12; ++i) {
                const double b = static_cast<double>(pack.basis_mm[(3 * k + axis) * 12 + i]) *
                                 static_cast<double>(pack.prior_sigma[i]);
                trace += b * b;
            }
        }
        EXPECT_NEAR(face->prior_mm2[k], trace, 1e-3 * trace + 1e-3);
    }
}

// A face built after a larger one has nothing of it left.
TEST(FaceGaussian, IsTheSameInUsedMemory) {
    const test::SyntheticFace large({.marker_count = 60, .shape_count = 30});
    const test::SamplePack small({.markers = 9, .shapes = 5, .marker_sets = true});
    const auto used = built(large.pack());
    auto workspace = std::make_unique<FaceGaussianWorkspace>();
    auto unused = std::make_unique<ShapeModel>();
    build_face_gaussian(small.view, *unused, *workspace, *used);
    const auto fresh = built(small.view);
    EXPECT_EQ(used->precision, fresh->precision);
    EXPECT_EQ(used->modes, fresh->modes);
    EXPECT_EQ(used->mode_count, fresh->mode_count);
}

}  // namespace
}  // namespace rig
