#include "core/geometry/shape_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Fixture {
    explicit Fixture(const test::SyntheticFaceOptions& options) : face(options) {
        model = test::shape_model_of(face.pack());
    }

    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model;
};

test::SyntheticFaceOptions options(std::size_t markers, std::size_t shapes, std::uint64_t seed) {
    test::SyntheticFaceOptions o;
    o.marker_count = markers;
    o.shape_count = shapes;
    o.seed = seed;
    return o;
}

// The modes are a factor of B S B^T, as far as they were kept: checked entry by entry in long double.
TEST(ShapeModel, ModesReproduceTheCovariance) {
    const Fixture f(options(20, 12, 41));
    const SolvePack pack = f.face.pack();
    const std::size_t rows = 60;
    double largest = 0.0;
    double worst = 0.0;
    for (std::size_t a = 0; a < rows; ++a) {
        for (std::size_t b = 0; b <= a; ++b) {
            long double expected = 0.0L;
            for (std::size_t i = 0; i < 12; ++i) {
                const auto sigma = static_cast<long double>(pack.prior_sigma[i]);
                expected += static_cast<long double>(pack.basis_mm[a * 12 + i]) * sigma * sigma *
                            static_cast<long double>(pack.basis_mm[b * 12 + i]);
            }
            double sum = 0.0;
            for (std::size_t j = 0; j < f.model->mode_count; ++j) {
                sum += f.model->modes[a / 3 * f.model->mode_count + j][static_cast<Eigen::Index>(a % 3)] *
                       f.model->modes[b / 3 * f.model->mode_count + j][static_cast<Eigen::Index>(b % 3)];
            }
            largest = std::max(largest, std::fabs(static_cast<double>(expected)));
            worst = std::max(worst, std::fabs(static_cast<double>(expected) - sum));
        }
    }
    EXPECT_EQ(f.model->mode_count, 12);
    EXPECT_LT(worst, 1e-12 * largest);
    EXPECT_EQ(f.model->residual_mm, 0.0);
}

TEST(ShapeModel, MoreShapesThanModesLeaveAResidual) {
    const Fixture f(options(60, 80, 42));
    EXPECT_EQ(f.model->mode_count, kMaxModes);
    EXPECT_GT(f.model->residual_mm, 0.0);
    EXPECT_LT(f.model->residual_mm, 0.3);  // of a motion of about 2 mm
}

TEST(ShapeModel, DependentAndZeroColumnsMakeNoModes) {
    test::SyntheticFaceOptions o = options(40, 20, 43);
    o.duplicate_columns = 3;
    o.zero_columns = 2;
    o.dependent_columns = 3;
    const Fixture f(o);
    EXPECT_EQ(f.model->mode_count, 12);
}

TEST(ShapeModel, MeanIsNeutralPlusMeanWeights) {
    const Fixture f(options(30, 15, 44));
    const std::vector<double> tenth(15, static_cast<double>(0.1F));
    const std::vector<Vec3> expected = f.face.positions(tenth);
    for (std::size_t k = 0; k < 30; ++k) EXPECT_LT((f.model->mean_mm[k] - expected[k]).norm(), 1e-12);
}

}  // namespace
}  // namespace rig
