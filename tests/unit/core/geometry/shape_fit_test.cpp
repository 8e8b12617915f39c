#include "core/geometry/shape_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Fixture {
    explicit Fixture(const test::SyntheticFaceOptions& options) : face(options) {
        model = test::shape_model_of(face.pack());
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
    std::unique_ptr<ShapeModel> model;
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

TEST(ShapeFit, RecoversPoseAndExpression) {
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

TEST(ShapeFit, PredictsHiddenMarkersBetterThanTheMean) {
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

TEST(ShapeFit, OptimumIsThatOfTheCovarianceWeightedFit) {
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

TEST(ShapeFit, WithoutMarkersThePriorIsTheAnswer) {
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

TEST(ShapeFit, OneMarkerMovesTheFaceTowardsIt) {
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

TEST(ShapeFit, RaysFixWhatTheyMeasure) {
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

// One frame of a stream: what is seen of a moving face under a creeping helmet, with dropouts.
struct Frame {
    std::vector<Vec3> positions;
    std::vector<Mat3> informations;
};

Frame frame_of(const Fixture& f, int index, bool one_camera, test::SeededRandom& random) {
    const double time_s = index / 60.0;
    Frame frame;
    frame.positions = test::moved(test::creeping_slip(time_s), f.face.positions(f.face.weights_at(time_s)));
    test::add_noise(frame.positions, 0.1, random);
    for (const Vec3& x : frame.positions) {
        const Vec3 ray = (x - Vec3{0.0, -40.0, 210.0}).normalized();
        const Mat3 across = Mat3::Identity() - ray * ray.transpose();
        const bool hidden = random.chance(0.1);
        frame.informations.emplace_back(hidden                             ? Mat3{Mat3::Zero()}
                                        : one_camera || random.chance(0.3) ? Mat3{100.0 * across}
                                                                           : Mat3{100.0 * Mat3::Identity()});
    }
    return frame;
}

// The matrix that is kept decides how fast, not where: the same minimum as with a new one in every fit.
TEST(ShapeFit, MemoryDoesNotChangeTheAnswer) {
    for (const bool one_camera : {false, true}) {
        const Fixture f(options(60, 30, 55));
        test::SeededRandom random(56);
        auto memory = std::make_unique<ShapeFitMemory>();
        auto scratch = std::make_unique<ShapeFitWorkspace>();
        ShapeFit kept;
        ShapeFit fresh;
        double worst_rad = 0.0;
        double worst_mm = 0.0;
        double worst_sigmas = 0.0;
        for (int i = 0; i < 240; ++i) {
            const Frame frame = frame_of(f, i, one_camera, random);
            const ShapeFit start = kept;
            fit_shape(*f.model, frame.positions, frame.informations, {}, {6, 1e-2}, start, *memory, *scratch,
                      kept);
            fit_shape(*f.model, frame.positions, frame.informations, {}, 40, start, *scratch, fresh);
            ASSERT_TRUE(kept.ok && fresh.ok);
            const Mat3 turned = kept.pose.rotation * fresh.pose.rotation.transpose();
            worst_rad = std::max(worst_rad, vector_from_rotation(turned).norm());
            worst_mm = std::max(worst_mm, (kept.pose.translation_mm - fresh.pose.translation_mm).norm());
            worst_sigmas = std::max(worst_sigmas, kept.objective - fresh.objective);
        }
        std::printf("one camera %d: %.2e rad, %.2e mm, objective %.2e above the least\n", one_camera,
                    worst_rad, worst_mm, worst_sigmas);
        EXPECT_LT(worst_rad, 5e-5);
        EXPECT_LT(worst_mm, 5e-3);
        EXPECT_LT(worst_sigmas, 5e-3) << "0.07 of a standard deviation";
    }
}

TEST(ShapeFit, LeavesTheFittedMarkersInTheWorkspace) {
    const Fixture f(options(40, 20, 57));
    test::SeededRandom random(58);
    const Frame frame = frame_of(f, 30, false, random);
    auto scratch = std::make_unique<ShapeFitWorkspace>();
    ShapeFit fit;
    fit_shape(*f.model, frame.positions, frame.informations, {}, 6, ShapeFit{}, *scratch, fit);
    for (std::size_t k = 0; k < 40; ++k) {
        EXPECT_LT((scratch->headset_mm[k] - fit.headset_position(*f.model, k)).norm(), 1e-5);
        EXPECT_LT((fit.pose.apply(scratch->face_mm[k]) - scratch->headset_mm[k]).norm(), 1e-12);
    }
}

// A matrix of another face is thrown away once the steps stop shrinking.
TEST(ShapeFit, RecoversFromAMatrixThatDoesNotFit) {
    const Fixture f(options(60, 30, 59));
    test::SeededRandom random(60);
    const Frame frame = frame_of(f, 10, false, random);
    auto memory = std::make_unique<ShapeFitMemory>();
    auto scratch = std::make_unique<ShapeFitWorkspace>();
    ShapeFit fit;
    ShapeFit fresh;
    fit_shape(*f.model, frame.positions, frame.informations, {}, {10, 1e-2}, ShapeFit{}, *memory, *scratch,
              fit);
    for (float& entry : memory->information.matrix) entry *= 0.2F;  // steps five times too long
    memory->factor.modes_done = false;
    fit_shape(*f.model, frame.positions, frame.informations, {}, {10, 1e-2}, ShapeFit{}, *memory, *scratch,
              fit);
    fit_shape(*f.model, frame.positions, frame.informations, {}, 40, ShapeFit{}, *scratch, fresh);
    ASSERT_TRUE(fit.ok);
    EXPECT_LT(fit.objective - fresh.objective, 1e-2);
}

}  // namespace
}  // namespace rig
