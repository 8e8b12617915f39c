// Adversarial frames: what is seen flips every frame, targets jump from one extreme to the other, priors pull
// against both, and the shapes come in families that hardly differ. Each frame's multiply-adds are counted
// and stay below the compiled-in cap; the answer stays finite and inside its bounds.
// RIG_SOLVER_FRAMES=1000000 makes as many of them as one likes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "core/solve/normal_equations.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

std::size_t frames() {
    const char* text = std::getenv("RIG_SOLVER_FRAMES");
    return text != nullptr ? static_cast<std::size_t>(std::stoul(text)) : 6000;
}

// Shapes in families whose members differ by a thousandth or nothing at all.
struct Scene {
    Scene(std::size_t markers, std::size_t shapes, bool bounded, test::SeededRandom& random)
        : neutral(3 * markers),
          basis(3 * markers * shapes),
          gamma(shapes),
          low(shapes, 0.0F),
          high(shapes, 1.0F) {
        for (float& x : neutral) x = static_cast<float>(random.normal(0.0, 40.0));
        for (std::size_t i = 0; i < shapes; ++i) {
            const bool head = i % 4 == 0;
            const double stray = random.chance(0.2) ? 0.0 : 1e-3;
            for (std::size_t r = 0; r < 3 * markers; ++r) {
                const double own = random.normal(0.0, 3.0);
                basis[r * shapes + i] = static_cast<float>(
                    head ? own : static_cast<double>(basis[r * shapes + i - 1]) + stray * own);
            }
            gamma[i] = random.chance(0.5) ? 0.0F : static_cast<float>(random.uniform(0.0, 500.0));
        }
        if (!bounded) high.assign(shapes, std::numeric_limits<float>::infinity());
        pack.marker_count = static_cast<std::uint16_t>(markers);
        pack.shape_count = static_cast<std::uint16_t>(shapes);
        pack.neutral_mm = neutral;
        pack.basis_mm = basis;
        pack.weight_low = low;
        pack.weight_high = high;
        pack.temporal_gamma = gamma;
        pack.ridge_mm2 = bounded && random.chance(0.5) ? 0.01F : 0.0F;
        pack.sparsity_mm2 = random.chance(0.5) ? 0.1F : 0.0F;
        positions.resize(markers);
        weights.assign(markers, Mat3::Identity());
        previous.assign(shapes, 0.0);
    }

    void next_frame(std::size_t frame, test::SeededRandom& random) {
        const double sign = frame % 2 == 0 ? 1.0 : -1.0;
        const int sight = static_cast<int>(random.below(4));
        const double size = random.chance(0.1) ? 1e3 : 5.0;
        for (std::size_t k = 0; k < positions.size(); ++k) {
            for (std::size_t a = 0; a < 3; ++a)
                positions[k][static_cast<Eigen::Index>(a)] =
                    static_cast<double>(neutral[3 * k + a]) + sign * random.normal(size, size);
            Vec3 ray{random.normal(0.0, 1.0), random.normal(0.0, 1.0), -1.0};
            ray.normalize();
            const bool seen = sight == 0 || (sight == 1 ? (k + frame) % 2 == 0 : random.chance(0.8));
            weights[k] = Mat3::Zero();
            if (!seen) continue;
            weights[k] = sight == 3
                             ? Mat3(random.uniform(0.1, 4.0) * (Mat3::Identity() - ray * ray.transpose()))
                             : Mat3(Mat3::Identity());
        }
        for (std::size_t i = 0; i < previous.size(); ++i)
            previous[i] = (i + frame) % 2 == 0 ? 0.0 : (random.chance(0.1) ? 50.0 : 1.0);
        gamma_scale = random.chance(0.2) ? random.uniform(0.0, 1.0) : gamma_scale;
    }

    std::vector<float> neutral, basis, gamma, low, high;
    SolvePack pack;
    std::vector<Vec3> positions;
    std::vector<Mat3> weights;
    std::vector<double> previous;
    double gamma_scale = 1.0;
};

template <typename Real>
class SolverWork : public testing::Test {
  public:
    struct Most {
        double normal_share = 0.0, qp_share = 0.0;  // of the caps
        std::uint16_t iterations = 0;
        std::size_t unfinished = 0;
    };

    void run(Scene& scene, std::size_t count, test::SeededRandom& random) {
        build_normal_tables(scene.pack, *tables);
        state->valid = false;
        qp->warm = false;
        const std::size_t n = scene.pack.shape_count;
        const std::uint64_t normal_cap = normal_work_cap(scene.pack.marker_count, n);
        const std::vector<Real> low(scene.low.begin(), scene.low.end()),
            high(scene.high.begin(), scene.high.end());
        std::vector<Real> w(n, Real(0));
        for (std::size_t f = 0; f < count; ++f) {
            scene.next_frame(f, random);
            build_normal_equations<Real>(scene.pack, *tables,
                                         {scene.positions, scene.weights, scene.previous, scene.gamma_scale},
                                         *state, *qp, *equations);
            ASSERT_LE(equations->work, normal_cap) << "frame " << f;
            for (std::size_t i = 0; i < n; ++i) {
                if (random.chance(0.2)) w[i] = static_cast<Real>(scene.previous[i]);
            }
            const std::size_t stride = row_stride(n);
            const BoxQpReport report = solve_box_qp({n,
                                                     stride,
                                                     {state->hessian.data(), n * stride},
                                                     equations->linear,
                                                     low,
                                                     high,
                                                     state->version},
                                                    {}, *qp, *workspace, std::span<Real>(w));
            ASSERT_LE(report.work, box_qp_work_cap(n)) << "frame " << f;
            ASSERT_LE(report.iterations, BoxQpConfig{}.iteration_cap);
            for (std::size_t i = 0; i < n; ++i) {
                ASSERT_TRUE(std::isfinite(w[i]) && w[i] >= low[i] && w[i] <= high[i]) << "frame " << f;
            }
            most.normal_share = std::max(
                most.normal_share, static_cast<double>(equations->work) / static_cast<double>(normal_cap));
            most.qp_share = std::max(
                most.qp_share, static_cast<double>(report.work) / static_cast<double>(box_qp_work_cap(n)));
            most.iterations = std::max(most.iterations, report.iterations);
            most.unfinished += report.optimal ? 0 : 1;
        }
    }

    void print() const {
        std::printf("at most %.3f of the cap on H, %.3f of the QP's, %u iterations; %zu frames not optimal\n",
                    most.normal_share, most.qp_share, most.iterations, most.unfinished);
    }

    Most most;
    std::unique_ptr<NormalTables<Real>> tables = std::make_unique<NormalTables<Real>>();
    std::unique_ptr<NormalState<Real>> state = std::make_unique<NormalState<Real>>();
    std::unique_ptr<NormalEquations<Real>> equations = std::make_unique<NormalEquations<Real>>();
    std::unique_ptr<BoxQpState<Real>> qp = std::make_unique<BoxQpState<Real>>();
    std::unique_ptr<BoxQpWorkspace<Real>> workspace = std::make_unique<BoxQpWorkspace<Real>>();
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(SolverWork, Precisions);

TYPED_TEST(SolverWork, NeverAboveTheCapOverAdversarialFrames) {
    test::SeededRandom random(41);
    constexpr std::size_t kFramesEach = 50;
    for (std::size_t done = 0; done < frames() && !this->HasFatalFailure(); done += kFramesEach) {
        Scene scene(4 + random.below(12), 2 + random.below(22), random.chance(0.5), random);
        this->run(scene, kFramesEach, random);
    }
    this->print();
}

TYPED_TEST(SolverWork, NeverAboveTheCapWithTheMostShapesAndMarkers) {
    test::SeededRandom random(42);
    Scene scene(kMaxMarkers, kMaxShapes, true, random);
    this->run(scene, 8, random);
    this->print();
}

}  // namespace
}  // namespace rig
