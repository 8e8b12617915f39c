#include "core/geometry/shape_information.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/dense_solve.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(std::size_t shapes) : face(options(shapes)) {
        model = test::shape_model_of(face.pack());
        for (std::size_t k = 0; k < model->marker_count; ++k) positions.push_back(model->mean_mm[k]);
    }
    static test::SyntheticFaceOptions options(std::size_t shapes) {
        test::SyntheticFaceOptions o;
        o.marker_count = 30;
        o.shape_count = shapes;
        o.seed = 61;
        return o;
    }

    void draw_informations() {
        informations.clear();
        for (std::size_t k = 0; k < model->marker_count; ++k) {
            const Vec3 ray{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), -0.9};
            const Mat3 across = Mat3::Identity() - ray * ray.transpose() / ray.squaredNorm();
            informations.emplace_back(random.chance(0.3) ? Mat3{Mat3::Zero()}
                                                         : Mat3{random.uniform(20.0, 200.0) * across});
        }
    }

    bool follow(const ShapeTolerance& tolerance) {
        return follow_markers(*model, rotation, positions, informations, tolerance, *information);
    }

    // J^T W J written out, in long double; the upper triangle.
    std::vector<long double> expected() const {
        const std::size_t modes = model->mode_count;
        const std::size_t n = modes + 6;
        std::vector<long double> sum(n * n, 0.0L);
        for (std::size_t k = 0; k < model->marker_count; ++k) {
            const Mat3 w = rotation.transpose() * informations[k] * rotation;
            std::vector<Vec3> columns;
            for (std::size_t j = 0; j < modes; ++j) columns.push_back(model->modes[k * modes + j]);
            for (Eigen::Index a = 0; a < 3; ++a) columns.push_back(Vec3::Unit(a).cross(positions[k]));
            for (Eigen::Index a = 0; a < 3; ++a) columns.emplace_back(Vec3::Unit(a));
            for (std::size_t i = 0; i < n; ++i) {
                for (std::size_t j = 0; j < n; ++j) {
                    sum[i * n + j] += static_cast<long double>(columns[i].dot(Vec3{w * columns[j]}));
                }
            }
        }
        return sum;
    }

    // Largest difference relative to the geometric mean of the two diagonal entries.
    double worst_error() const {
        const std::vector<long double> truth = expected();
        const std::size_t n = model->mode_count + 6U;
        double worst = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = i; j < n; ++j) {
                const long double got =
                    static_cast<long double>(information->matrix[i * ShapeInformation::kStride + j]);
                const long double scale = std::sqrt(truth[i * n + i] * truth[j * n + j]);
                worst = std::max(worst, static_cast<double>(std::fabs(got - truth[i * n + j]) / scale));
            }
        }
        return worst;
    }

    test::SyntheticFace face;
    test::SeededRandom random{62};
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<ShapeInformation> information = std::make_unique<ShapeInformation>();
    Mat3 rotation = rotation_from_vector(Vec3{0.05, -0.1, 0.03});
    std::vector<Vec3> positions;
    std::vector<Mat3> informations;
};

TEST(ShapeInformation, IsTheMatrixOfTheMarkers) {
    for (const std::size_t shapes : {3U, 17U, 30U}) {
        Scene s(shapes);
        s.draw_informations();
        EXPECT_TRUE(s.follow({}));
        EXPECT_LT(s.worst_error(), 2e-6) << shapes;
        EXPECT_FALSE(s.follow({})) << "nothing changed";
    }
}

// A thousand changes one after the other leave no more than the rounding of a few.
TEST(ShapeInformation, FollowsChangesWithoutWearing) {
    Scene s(20);
    const ShapeTolerance exact{0.0, 0.0, 0.05};
    double worst = 0.0;
    for (int round = 0; round < 60; ++round) {
        s.draw_informations();
        for (Vec3& x : s.positions) x += Vec3{0.01 * round, 0.2, -0.1};
        s.follow(exact);
        worst = std::max(worst, s.worst_error());
    }
    EXPECT_LT(worst, 5e-5);
}

TEST(ShapeInformation, SmallChangesWaitLargeOnesDoNot) {
    Scene s(12);
    s.draw_informations();
    s.follow({});
    for (Mat3& a : s.informations) a *= 1.05;
    for (Vec3& x : s.positions) x += Vec3{1.0, -2.0, 0.5};
    EXPECT_FALSE(s.follow({}));
    s.rotation = s.rotation * rotation_from_vector(Vec3{0.0, 0.02, 0.0});
    EXPECT_FALSE(s.follow({}));
    const std::vector<Mat3> before = s.informations;
    std::size_t seen = 0;
    while (s.informations[seen].norm() == 0.0) ++seen;
    s.informations[seen] *= 1.5;
    EXPECT_TRUE(s.follow({}));
    s.informations[seen] = Mat3::Zero();
    EXPECT_TRUE(s.follow({}));
    s.positions[seen + 1] += Vec3{0.0, 0.0, 5.0};
    s.informations[seen + 1] = 50.0 * Mat3::Identity();
    EXPECT_TRUE(s.follow({}));
    s.rotation = s.rotation * rotation_from_vector(Vec3{0.0, 0.06, 0.0});
    EXPECT_TRUE(s.follow({}));
    EXPECT_LT(s.worst_error(), 2e-6) << "turned too far: all were put in anew";
}

TEST(ShapeInformation, FactorSolvesWithAnyPriorOfThePose) {
    Scene s(15);
    s.draw_informations();
    s.follow({});
    const std::size_t n = s.model->mode_count + 6U;
    auto factor = std::make_unique<ShapeFactor>();
    for (const double by_rotation : {10.0, 1e6, 1e12}) {
        const ShapePriorInformation prior{1.0, by_rotation, by_rotation / 100.0};
        ASSERT_TRUE(factor_shape(*s.information, s.model->mode_count, prior, *factor));
        std::vector<long double> system(n * n);
        std::vector<long double> right(n);
        std::vector<double> x(n);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j) {
                const std::size_t low = std::min(i, j);
                const std::size_t high = std::max(i, j);
                system[i * n + j] =
                    static_cast<long double>(s.information->matrix[low * ShapeInformation::kStride + high]);
            }
            system[i * n + i] += static_cast<long double>(
                i < n - 6 ? prior.by_mode : (i < n - 3 ? prior.by_rotation : prior.by_translation));
            x[i] = s.random.uniform(-10.0, 10.0);
            right[i] = static_cast<long double>(x[i]);
        }
        const std::vector<long double> old = right;
        x.resize(n + kLaneFloats);
        const double squares = solve_shape(*factor, s.model->mode_count, x.data());
        std::vector<long double> expected = right;
        ASSERT_TRUE(test::solve_dense(system, expected, 0.0L));
        long double product = 0.0L;
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_NEAR(x[i], static_cast<double>(expected[i]),
                        1e-9 * std::fabs(static_cast<double>(expected[i])) + 1e-10);
            product += old[i] * expected[i];
        }
        EXPECT_NEAR(squares, static_cast<double>(product), 1e-9 * squares);
    }
}

TEST(ShapeInformation, RefusesWhatIsNotPositiveDefinite) {
    Scene s(6);
    s.draw_informations();
    s.follow({});
    auto factor = std::make_unique<ShapeFactor>();
    s.information->matrix[0] = -5.0F;
    EXPECT_FALSE(factor_shape(*s.information, s.model->mode_count, {}, *factor));
    s.information->matrix[0] = std::nanf("");
    EXPECT_FALSE(factor_shape(*s.information, s.model->mode_count, {}, *factor));
}

}  // namespace
}  // namespace rig
