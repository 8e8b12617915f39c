#include "core/geometry/shape_model.hpp"

#include "core/geometry/shape_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Fixture {
    explicit Fixture(const test::SyntheticFaceOptions& options) : face(options) {
        const SolvePack pack = face.pack();
        auto scratch = std::make_unique<ShapeModelWorkspace>();
        build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma, *scratch,
                          *model);
    }

    // Fit to positions; `seen` empty means all.
    ShapeFit fit(const std::vector<Vec3>& positions, const std::vector<bool>& seen, double sigma_mm,
                 int iterations, const ShapePrior& prior = {}) const {
        std::vector<Mat3> informations;
        for (std::size_t k = 0; k < positions.size(); ++k) {
            const bool used = seen.empty() || seen[k];
            informations.push_back(used ? Mat3{Mat3::Identity() / (sigma_mm * sigma_mm)}
                                        : Mat3{Mat3::Zero()});
        }
        ShapeFit start;
        start.pose = prior.pose;
        start.coefficients = prior.coefficients;
        ShapeFit result;
        auto scratch = std::make_unique<ShapeFitWorkspace>();
        fit_shape(*model, positions, informations, prior, iterations, start, *scratch, result);
        return result;
    }

    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model = std::make_unique<ShapeModel>();
};

test::SyntheticFaceOptions options(std::size_t markers, std::size_t shapes, std::uint64_t seed) {
    test::SyntheticFaceOptions o;
    o.marker_count = markers;
    o.shape_count = shapes;
    o.seed = seed;
    return o;
}

double distance_rms(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]).squaredNorm();
    return std::sqrt(sum / (3.0 * static_cast<double>(a.size())));
}

std::vector<Vec3> fitted(const Fixture& f, const ShapeFit& fit) {
    std::vector<Vec3> result;
    for (std::size_t k = 0; k < f.model->marker_count; ++k)
        result.push_back(fit.headset_position(*f.model, k));
    return result;
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

TEST(ShapeModel, RecoversPoseAndExpression) {
    const Fixture f(options(60, 30, 45));
    test::SeededRandom random(46);
    for (int i = 0; i < 30; ++i) {
        const std::vector<Vec3> truth = f.face.positions(f.face.random_weights(random));
        const Rigid pose = test::random_slip(random, 0.1, 8.0);
        const std::vector<Vec3> seen = test::moved(pose, truth);
        const ShapeFit fit = f.fit(seen, {}, 0.001, 10, {{}, 10.0, 1000.0, {}, 1.0});
        ASSERT_TRUE(fit.ok);
        EXPECT_LT(distance_rms(fitted(f, fit), seen), 0.01);
        EXPECT_LT((fit.pose.translation_mm - pose.translation_mm).norm(), 0.2);
        EXPECT_LT(vector_from_rotation(Mat3{fit.pose.rotation * pose.rotation.transpose()}).norm(), 0.003);
        EXPECT_LT((fit.pose.rotation * fit.pose.rotation.transpose() - Mat3::Identity()).norm(), 1e-12);
    }
}

TEST(ShapeModel, PredictsHiddenMarkersBetterThanTheMean) {
    const Fixture f(options(60, 30, 47));
    test::SeededRandom random(48);
    double fit_sum = 0.0;
    double mean_sum = 0.0;
    for (int i = 0; i < 40; ++i) {
        const std::vector<Vec3> truth = f.face.positions(f.face.random_weights(random));
        std::vector<bool> seen(60, true);
        for (int hidden = 0; hidden < 12; ++hidden) seen[random.below(60)] = false;
        std::vector<Vec3> noisy = truth;
        test::add_noise(noisy, 0.1, random);
        const ShapeFit fit = f.fit(noisy, seen, 0.1, 6);
        for (std::size_t k = 0; k < 60; ++k) {
            if (seen[k]) continue;
            fit_sum += (fit.headset_position(*f.model, k) - truth[k]).squaredNorm();
            mean_sum += (f.model->mean_mm[k] - truth[k]).squaredNorm();
        }
    }
    EXPECT_LT(std::sqrt(fit_sum / mean_sum), 0.35);
    EXPECT_GT(std::sqrt(fit_sum / mean_sum), 0.02) << "too good: is the hidden marker hidden?";
}

// The fit with c free equals the minimum over the pose of (x - R b - t)^T C^-1 (x - R b - t), C = B S B^T +
// s^2 I written out in long double: gradient by central differences, and value, at the fitted pose.
class ExplicitObjective {
  public:
    ExplicitObjective(const Fixture& f, double sigma_mm) : f_(f), size_(3U * f.model->marker_count) {
        factor_.assign(size_ * size_, 0.0L);
        const SolvePack pack = f.face.pack();
        const std::size_t n = pack.shape_count;
        for (std::size_t a = 0; a < size_; ++a) {
            for (std::size_t b = 0; b <= a; ++b) {
                long double sum =
                    a == b ? static_cast<long double>(sigma_mm) * static_cast<long double>(sigma_mm) : 0.0L;
                for (std::size_t i = 0; i < n; ++i) {
                    const auto sigma = static_cast<long double>(pack.prior_sigma[i]);
                    sum += static_cast<long double>(pack.basis_mm[a * n + i]) * sigma * sigma *
                           static_cast<long double>(pack.basis_mm[b * n + i]);
                }
                for (std::size_t k = 0; k < b; ++k) sum -= factor_[a * size_ + k] * factor_[b * size_ + k];
                factor_[a * size_ + b] = a == b ? std::sqrt(sum) : sum / factor_[b * size_ + b];
            }
        }
    }

    // x [m] headset frame. The residual is taken in the face frame, where C lives.
    long double operator()(const std::vector<Vec3>& x, const Rigid& pose) const {
        std::vector<long double> e(size_);
        for (std::size_t k = 0; k < size_ / 3; ++k) {
            for (Eigen::Index a = 0; a < 3; ++a) {
                long double sum = 0.0L;
                for (Eigen::Index b = 0; b < 3; ++b) {
                    sum += static_cast<long double>(pose.rotation(b, a)) *
                           (static_cast<long double>(x[k][b]) -
                            static_cast<long double>(pose.translation_mm[b]));
                }
                e[3 * k + static_cast<std::size_t>(a)] =
                    sum - static_cast<long double>(f_.model->mean_mm[k][a]);
            }
        }
        long double total = 0.0L;
        for (std::size_t i = 0; i < size_; ++i) {
            for (std::size_t k = 0; k < i; ++k) e[i] -= factor_[i * size_ + k] * e[k];
            e[i] /= factor_[i * size_ + i];
            total += e[i] * e[i];
        }
        return total;
    }

  private:
    const Fixture& f_;
    std::size_t size_;
    std::vector<long double> factor_;
};

TEST(ShapeModel, OptimumIsThatOfTheCovarianceWeightedFit) {
    constexpr double kSigmaMm = 0.1;
    const Fixture f(options(24, 10, 49));
    const ExplicitObjective explicit_objective(f, kSigmaMm);
    test::SeededRandom random(50);
    // Priors so wide that the pose is free; coefficients with unit variance as C says.
    const ShapePrior wide{{}, 1e3, 1e5, {}, 1.0};
    for (int trial = 0; trial < 5; ++trial) {
        std::vector<Vec3> x = test::moved(test::random_slip(random, 0.08, 6.0),
                                          f.face.positions(f.face.random_weights(random)));
        test::add_noise(x, kSigmaMm, random);
        const ShapeFit fit = f.fit(x, {}, kSigmaMm, 40, wide);
        ASSERT_TRUE(fit.ok);
        const long double at_fit = explicit_objective(x, fit.pose);
        EXPECT_NEAR(static_cast<double>(at_fit), fit.objective, 1e-5 * fit.objective);
        for (Eigen::Index axis = 0; axis < 6; ++axis) {
            const double h = axis < 3 ? 1e-5 : 1e-3;
            std::array<long double, 2> value{};
            for (std::size_t side = 0; side < 2; ++side) {
                const double step = side == 0 ? -h : h;
                Rigid pose = fit.pose;
                Vec3 turn = Vec3::Zero();
                if (axis < 3) turn[axis] = step;
                pose.rotation = rotation_from_vector(turn) * fit.pose.rotation;
                if (axis >= 3) pose.translation_mm[axis - 3] += step;
                value[side] = explicit_objective(x, pose);
                EXPECT_GT(value[side], at_fit) << "axis " << axis;
            }
            const long double slope = (value[1] - value[0]) / 2.0L;
            const long double curvature = (value[1] + value[0]) / 2.0L - at_fit;
            // The minimum of the parabola through the three values is within a thousandth of the step.
            EXPECT_LT(std::fabs(static_cast<double>(slope / curvature)), 2e-3)
                << "axis " << axis << " trial " << trial;
        }
    }
}

TEST(ShapeModel, WithoutMarkersThePriorIsTheAnswer) {
    const Fixture f(options(20, 8, 51));
    ShapePrior prior;
    prior.pose = {rotation_from_vector(Vec3{0.05, -0.02, 0.01}), Vec3{3.0, -1.0, 2.0}};
    prior.coefficients[0] = 0.7;
    const std::vector<Vec3> anything(20, Vec3{1e9, -1e9, 1e9});
    const ShapeFit fit = f.fit(anything, std::vector<bool>(20, false), 0.1, 4, prior);
    EXPECT_TRUE(fit.ok);
    EXPECT_LT((fit.pose.translation_mm - prior.pose.translation_mm).norm(), 1e-12);
    EXPECT_LT((fit.pose.rotation - prior.pose.rotation).norm(), 1e-12);
    EXPECT_NEAR(fit.coefficients[0], 0.7, 1e-12);
    EXPECT_NEAR(fit.objective, 0.0, 1e-20);
}

TEST(ShapeModel, OneMarkerMovesTheFaceTowardsIt) {
    const Fixture f(options(20, 8, 52));
    std::vector<Vec3> positions(20, Vec3::Zero());
    positions[3] = f.model->mean_mm[3] + Vec3{2.0, 0.0, 0.0};
    std::vector<bool> seen(20, false);
    seen[3] = true;
    const ShapeFit fit = f.fit(positions, seen, 0.1, 6);
    EXPECT_TRUE(fit.ok);
    EXPECT_LT((fit.headset_position(*f.model, 3) - positions[3]).norm(), 0.05);
    for (std::size_t k = 0; k < 20; ++k)
        EXPECT_LT((fit.headset_position(*f.model, k) - f.model->mean_mm[k]).norm(), 8.0);
}

TEST(ShapeModel, RaysFixWhatTheyMeasure) {
    // One camera: the information of every marker has no part along its ray, and the fit must not pull there.
    const Fixture f(options(60, 30, 53));
    test::SeededRandom random(54);
    const Vec3 camera{0.0, -40.0, 210.0};
    const std::vector<Vec3> truth =
        test::moved(test::random_slip(random, 0.03, 2.0), f.face.positions(f.face.weights_at(0.4)));
    std::vector<Vec3> positions;
    std::vector<Mat3> informations;
    for (const Vec3& x : truth) {
        const Vec3 ray = (x - camera).normalized();
        positions.push_back(x + random.uniform(-5.0, 5.0) * ray);  // a wrong depth
        informations.emplace_back((Mat3::Identity() - ray * ray.transpose()) * 100.0);
    }
    ShapeFit result;
    auto scratch = std::make_unique<ShapeFitWorkspace>();
    fit_shape(*f.model, positions, informations, {}, 8, ShapeFit{}, *scratch, result);
    ASSERT_TRUE(result.ok);
    double across = 0.0;
    for (std::size_t k = 0; k < 60; ++k) {
        const Vec3 e = result.headset_position(*f.model, k) - truth[k];
        across += e.dot(Vec3{informations[k] * e}) / 100.0;
    }
    EXPECT_LT(std::sqrt(across / 120.0), 0.1);
}

}  // namespace
}  // namespace rig
