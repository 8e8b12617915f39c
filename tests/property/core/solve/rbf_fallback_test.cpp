// Outside the references of an RBF pack: the answer goes over to the box QP's when the pack says so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/solver.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr std::size_t kDimensions = 6;
constexpr std::size_t kCentres = 20;
constexpr float kWidthMm = 10.0F;

// A synthetic face whose pack also holds a regression: axes along its first shapes, centres on frames of its
// performance, regression weights at random. Where it is right or wrong does not matter here.
class FaceWithRbf {
  public:
    FaceWithRbf() : face_({.marker_count = 40, .shape_count = 12, .ridge_mm2 = 1e-2}) {
        SolvePack pack = face_.pack();
        rows_ = 3U * pack.marker_count;
        shapes_ = pack.shape_count;
        make_axes(pack);
        test::SeededRandom random(61);
        for (std::size_t k = 0; k < kCentres; ++k) {
            const std::vector<double> x = point_of(face_.weights_at(static_cast<double>(k)));
            for (const double coordinate : x) centres_.push_back(static_cast<float>(coordinate));
        }
        widths_.assign(kCentres, kWidthMm);
        for (std::size_t i = 0; i < kCentres * shapes_; ++i)
            weights_.push_back(static_cast<float>(random.normal(0.0, 0.3)));
        offset_.assign(shapes_, 0.3F);
    }

    [[nodiscard]] SolvePack pack(SolverKind solver, float near_widths, float far_widths) const {
        SolvePack out = face_.pack();
        out.solver = solver;
        if (solver != SolverKind::kRbf) return out;
        out.rbf = {.hull_near_widths = near_widths,
                   .hull_far_widths = far_widths,
                   .dimension_count = kDimensions,
                   .centre_count = kCentres,
                   .mean_mm = out.neutral_mm,
                   .basis = axes_,
                   .centres = centres_,
                   .widths_mm = widths_,
                   .weights = weights_,
                   .offset = offset_};
        return out;
    }
    [[nodiscard]] const test::SyntheticFace& face() const { return face_; }
    [[nodiscard]] std::size_t shapes() const { return shapes_; }

  private:
    void make_axes(const SolvePack& pack) {
        std::vector<std::vector<double>> axes;
        for (std::size_t a = 0; a < kDimensions; ++a) {
            std::vector<double> axis(rows_);
            for (std::size_t r = 0; r < rows_; ++r)
                axis[r] = static_cast<double>(pack.basis_mm[r * shapes_ + a]);
            for (const auto& other : axes) {
                double along = 0.0;
                for (std::size_t r = 0; r < rows_; ++r) along += axis[r] * other[r];
                for (std::size_t r = 0; r < rows_; ++r) axis[r] -= along * other[r];
            }
            double square = 0.0;
            for (const double x : axis) square += x * x;
            for (double& x : axis) x /= std::sqrt(square);
            for (const double x : axis) axes_.push_back(static_cast<float>(x));
            axes.push_back(axis);
        }
    }
    [[nodiscard]] std::vector<double> point_of(const std::vector<double>& weights) const {
        const std::vector<Vec3> at = face_.positions(weights);
        const SolvePack pack = face_.pack();
        std::vector<double> x(kDimensions);
        for (std::size_t a = 0; a < kDimensions; ++a) {
            for (std::size_t r = 0; r < rows_; ++r) {
                const double motion =
                    at[r / 3][static_cast<Eigen::Index>(r % 3)] - static_cast<double>(pack.neutral_mm[r]);
                x[a] += static_cast<double>(axes_[a * rows_ + r]) * motion;
            }
        }
        return x;
    }

    test::SyntheticFace face_;
    std::size_t rows_ = 0;
    std::size_t shapes_ = 0;
    std::vector<float> axes_, centres_, widths_, weights_, offset_;
};

// One frame from a cold start.
class OneFrame {
  public:
    explicit OneFrame(const SolvePack& pack) : shapes_(pack.shape_count) {
        configure_solver(pack, 60.0, *workspace_, *config_);
    }
    std::vector<double> solve_at(const std::vector<Vec3>& positions) {
        const double noise = static_cast<double>(config_->pack.noise_mm);
        stabilised_->count = static_cast<std::uint16_t>(positions.size());
        completed_->count = stabilised_->count;
        for (std::size_t k = 0; k < positions.size(); ++k) {
            StabilisedMarker& marker = stabilised_->markers[k];
            marker.seen = true;
            marker.position_mm = positions[k];
            marker.information = Mat3::Identity() / (noise * noise);
            completed_->position_mm[k] = positions[k];
        }
        reset_solver(*state_);
        solve(*config_, *stabilised_, *completed_, 0, *state_, *workspace_, *output_, *report_);
        std::vector<double> out;
        for (std::size_t i = 0; i < shapes_; ++i) out.push_back(static_cast<double>(output_->weights[i]));
        return out;
    }
    [[nodiscard]] const SolverReport& report() const { return *report_; }

  private:
    std::size_t shapes_;
    std::unique_ptr<SolverConfig> config_ = std::make_unique<SolverConfig>();
    std::unique_ptr<SolverState> state_ = std::make_unique<SolverState>();
    std::unique_ptr<SolverWorkspace> workspace_ = std::make_unique<SolverWorkspace>();
    std::unique_ptr<StabiliserOutput> stabilised_ = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceOutput> completed_ = std::make_unique<InferenceOutput>();
    std::unique_ptr<SolverOutput> output_ = std::make_unique<SolverOutput>();
    std::unique_ptr<SolverReport> report_ = std::make_unique<SolverReport>();
};

// From a reference frame outwards: `step` of the way to a face that no weights reach.
std::vector<Vec3> outwards(const FaceWithRbf& face, double step) {
    const std::vector<Vec3> from = face.face().positions(face.face().weights_at(3.0));
    const std::vector<Vec3> to = face.face().positions(std::vector<double>(face.shapes(), 2.0));
    std::vector<Vec3> out;
    for (std::size_t k = 0; k < from.size(); ++k) out.emplace_back(from[k] + step * (to[k] - from[k]));
    return out;
}

TEST(RbfFallback, IsTheRegressionInsideAndTheBoxQpFarOutside) {
    const FaceWithRbf face;
    OneFrame plain(face.pack(SolverKind::kRbf, 0.0F, 0.0F));
    OneFrame falling(face.pack(SolverKind::kRbf, 1.0F, 2.5F));
    OneFrame box(face.pack(SolverKind::kBoxQp, 0.0F, 0.0F));
    EXPECT_EQ(falling.solve_at(outwards(face, 0.0)), plain.solve_at(outwards(face, 0.0)));
    EXPECT_EQ(falling.report().hull_share, 0.0);
    EXPECT_LT(falling.report().hull_distance, 1.0);
    const std::vector<double> far = falling.solve_at(outwards(face, 1.0));
    EXPECT_EQ(falling.report().hull_share, 1.0);
    EXPECT_GT(falling.report().hull_distance, 2.5);
    const std::vector<double> wanted = box.solve_at(outwards(face, 1.0));
    const std::vector<double> regression = plain.solve_at(outwards(face, 1.0));
    EXPECT_EQ(plain.report().hull_share, 0.0) << "off unless the pack says so";
    double apart = 0.0;
    for (std::size_t i = 0; i < far.size(); ++i) {
        EXPECT_NEAR(far[i], wanted[i], 1e-6);
        apart = std::max(apart, std::abs(regression[i] - wanted[i]));
    }
    EXPECT_GT(apart, 0.1) << "the two solvers must differ for this to say anything";
}

double largest_jump(OneFrame& solver, const FaceWithRbf& face, int steps) {
    double largest = 0.0;
    std::vector<double> last;
    for (int s = 0; s <= steps; ++s) {
        const std::vector<double> now = solver.solve_at(outwards(face, static_cast<double>(s) / steps));
        for (std::size_t i = 0; i < last.size(); ++i) largest = std::max(largest, std::abs(now[i] - last[i]));
        last = now;
    }
    return largest;
}

TEST(RbfFallback, GoesOverWithoutAJump) {
    const FaceWithRbf face;
    OneFrame falling(face.pack(SolverKind::kRbf, 1.0F, 2.5F));
    const double coarse = largest_jump(falling, face, 500);
    const double fine = largest_jump(falling, face, 2000);
    EXPECT_GT(coarse, 1e-3);
    EXPECT_LT(fine, 0.3 * coarse) << "a quarter of the step, a quarter of the change; a jump would stay";
}

TEST(RbfFallback, NeverLeavesTheBounds) {
    const FaceWithRbf face;
    OneFrame falling(face.pack(SolverKind::kRbf, 0.5F, 3.0F));
    test::SeededRandom random(62);
    int blended = 0;
    for (int round = 0; round < 3000; ++round) {
        std::vector<Vec3> at = outwards(face, random.uniform(0.0, 0.5));
        const double spread_mm = std::exp(random.uniform(-3.0, 8.0));
        for (Vec3& p : at) {
            for (int axis = 0; axis < 3; ++axis) p[axis] += random.normal(0.0, spread_mm);
        }
        for (const double w : falling.solve_at(at)) ASSERT_TRUE(w >= 0.0 && w <= 1.0) << round;
        const double share = falling.report().hull_share;
        ASSERT_TRUE(share >= 0.0 && share <= 1.0);
        blended += share > 0.0 && share < 1.0 ? 1 : 0;
    }
    EXPECT_GT(blended, 300);
}

}  // namespace
}  // namespace rig
