// Whatever an artist sets and whatever comes in, every weight is finite, inside the pack's range and inside
// the artist's; neutral controls change no bit. All four solvers, random and extreme sets, NaN among the
// markers.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

using test::SeededRandom;

constexpr std::size_t kMarkers = 24;
constexpr std::size_t kShapes = 16;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A face whose pack may name any solver; the RBF's numbers are random.
class Face {
  public:
    explicit Face(SolverKind kind) : face_(options(kind)), pack_(face_.pack()) {
        pack_.sparsity_mm2 = 0.1F;
        if (kind != SolverKind::kRbf) return;
        SeededRandom random(41);
        const auto fill = [&](std::vector<float>& into, std::size_t count, double spread, double middle) {
            for (std::size_t i = 0; i < count; ++i)
                into.push_back(static_cast<float>(middle + random.uniform(-spread, spread)));
            return std::span<const float>(into);
        };
        pack_.rbf.dimension_count = 2;
        pack_.rbf.centre_count = 5;
        basis_.assign(2 * 3 * kMarkers, 0.0F);
        basis_[0] = 1.0F;
        basis_[3 * kMarkers + 1] = 1.0F;
        pack_.rbf.mean_mm = pack_.neutral_mm;
        pack_.rbf.basis = basis_;
        pack_.rbf.centres = fill(centres_, 10, 3.0, 0.0);
        pack_.rbf.widths_mm = fill(widths_, 5, 1.0, 3.0);
        pack_.rbf.weights = fill(weights_, 5 * kShapes, 0.8, 0.2);
        pack_.rbf.offset = fill(offset_, kShapes, 0.1, 0.1);
    }
    [[nodiscard]] const SolvePack& pack() const { return pack_; }
    [[nodiscard]] std::vector<Vec3> at(int frame) const {
        return face_.positions(face_.weights_at(frame / 60.0));
    }

  private:
    static test::SyntheticFaceOptions options(SolverKind kind) {
        test::SyntheticFaceOptions o;
        o.marker_count = kMarkers;
        o.shape_count = kShapes;
        o.duplicate_columns = 1;
        o.zero_columns = 1;
        o.temporal_gamma_mm2 = 1.0;
        o.solver = kind;
        return o;
    }
    test::SyntheticFace face_;
    SolvePack pack_;
    std::vector<float> basis_, centres_, widths_, weights_, offset_;
};

ControlSet random_controls(SeededRandom& random) {
    ControlSet set;
    const auto factor = [&] {
        return static_cast<float>(random.chance(0.2)   ? 0.0
                                  : random.chance(0.2) ? 1e4
                                                       : random.uniform(0.0, 20.0));
    };
    for (ShapeControls& shape : set.shapes) {
        if (random.chance(0.4)) shape.sparsity = factor();
        if (random.chance(0.4)) shape.ridge = factor();
        if (random.chance(0.4)) shape.temporal = factor();
        if (random.chance(0.4)) shape.multiplier = random.chance(0.5) ? -factor() : factor();
        if (random.chance(0.4))
            shape.offset = static_cast<float>(random.chance(0.3) ? -1000.0 : random.normal(0.0, 1.0));
        if (random.chance(0.4)) {
            const auto a = static_cast<float>(random.normal(0.3, random.chance(0.2) ? 100.0 : 0.4));
            const auto b = static_cast<float>(random.normal(0.3, 0.4));
            shape.low = std::clamp(std::min(a, b), -1000.0F, 1000.0F);
            shape.high = std::clamp(std::max(a, b), -1000.0F, 1000.0F);
        }
    }
    for (std::uint16_t i = 0; i + 1U < kShapes; ++i) {
        const auto other = static_cast<std::uint16_t>((i + 1U + random.below(kShapes - 1U)) % kShapes);
        if (random.chance(0.3)) static_cast<void>(set.symmetry.push_back({i, other, factor()}));
        if (random.chance(0.3)) static_cast<void>(set.cancel.push_back({i, other}));
    }
    return set;
}

class ControlProperties : public testing::TestWithParam<SolverKind> {};

TEST_P(ControlProperties, EveryOutputIsFiniteAndInEveryRange) {
    const Face face(GetParam());
    const auto pipeline = std::make_unique<Pipeline>();
    SeededRandom random(42);
    int solved = 0;
    for (int run = 0; run < 12; ++run) {
        PipelineConfig config;
        config.filter = run % 3 != 0;
        config.smoothing = same_filter({FilterKind::kSavitzkyGolay, 9}, 2);
        if (run % 2 == 0) config.smoothing = FilterChoice{};
        ASSERT_TRUE(pipeline->configure(face.pack(), config).has_value());
        ControlSet set;
        FaceState state;
        FrameReport report;
        for (int frame = 0; frame < 150; ++frame) {
            if (frame % 15 == 7) {
                set = random_controls(random);
                ASSERT_TRUE(pipeline->set_controls(set).has_value());
            }
            std::vector<Vec3> points = face.at(frame);
            for (Vec3& p : points) {
                if (random.chance(0.1)) p = Vec3{kNan, 0.0, 0.0};
                if (random.chance(0.02)) p = Vec3{random.normal(0.0, 1e5), 1e300, -1e38};
            }
            if (frame % 40 > 35) points.assign(kMarkers, Vec3{kNan, kNan, kNan});
            pipeline->step(LabelledFrame{frame * 16'667, points}, state, report);
            solved += report.solved ? 1 : 0;
            ASSERT_TRUE(std::isfinite(report.objective_mm2) && std::isfinite(report.kkt));
            for (std::size_t i = 0; i < kShapes; ++i) {
                const float low =
                    std::clamp(set.shapes[i].low, face.pack().weight_low[i], face.pack().weight_high[i]);
                const float high =
                    std::clamp(set.shapes[i].high, face.pack().weight_low[i], face.pack().weight_high[i]);
                ASSERT_TRUE(state.weights[i] >= low && state.weights[i] <= high)
                    << "run " << run << " frame " << frame << " shape " << i << ": " << state.weights[i];
            }
        }
    }
    EXPECT_GT(solved, 1000);
}

TEST_P(ControlProperties, NeutralControlsChangeNoBit) {
    const Face face(GetParam());
    for (const bool filter : {false, true}) {
        const auto plain = std::make_unique<Pipeline>();
        const auto neutral = std::make_unique<Pipeline>();
        PipelineConfig config;
        config.filter = filter;
        ASSERT_TRUE(plain->configure(face.pack(), config) && neutral->configure(face.pack(), config));
        SeededRandom random(43);
        FaceState a;
        FaceState b;
        FrameReport of_a;
        FrameReport of_b;
        for (int frame = 0; frame < 200; ++frame) {
            std::vector<Vec3> points = face.at(frame);
            test::add_noise(points, 0.2, random);
            plain->step(LabelledFrame{frame * 16'667, points}, a, of_a);
            // Also after others were set and taken back, when nothing of them can be left.
            if (frame == 0 || frame % 10 == 5) {
                ASSERT_TRUE(neutral->set_controls(ControlSet{}).has_value());
            }
            neutral->step(LabelledFrame{frame * 16'667, points}, b, of_b);
            ASSERT_EQ(of_a.iterations, of_b.iterations);
            ASSERT_EQ(std::bit_cast<std::uint64_t>(of_a.objective_mm2),
                      std::bit_cast<std::uint64_t>(of_b.objective_mm2));
            for (std::size_t i = 0; i < kShapes; ++i) {
                ASSERT_EQ(std::bit_cast<std::uint32_t>(a.weights[i]),
                          std::bit_cast<std::uint32_t>(b.weights[i]))
                    << frame;
                ASSERT_EQ(a.confidence[i], b.confidence[i]);
            }
        }
    }
}

// Cancel pairs hold for RBF too, and symmetry ties its answer.
TEST_P(ControlProperties, PairsHoldForEverySolver) {
    const Face face(GetParam());
    const auto pipeline = std::make_unique<Pipeline>();
    PipelineConfig config;
    config.filter = false;
    ASSERT_TRUE(pipeline->configure(face.pack(), config).has_value());
    ControlSet set;
    static_cast<void>(set.cancel.push_back({0, 1}));
    static_cast<void>(set.symmetry.push_back({2, 3, 1e4F}));
    ASSERT_TRUE(pipeline->set_controls(set).has_value());
    FaceState state;
    FrameReport report;
    bool any = false;
    for (int frame = 0; frame < 300; ++frame) {
        const std::vector<Vec3> points = face.at(frame);
        pipeline->step(LabelledFrame{frame * 16'667, points}, state, report);
        ASSERT_TRUE(state.weights[0] == 0.0F || state.weights[1] == 0.0F) << frame;
        any = any || state.weights[0] > 0.05F || state.weights[1] > 0.05F;
        if (GetParam() != SolverKind::kLeastSquares) {  // clamped after the solve, so only nearly
            ASSERT_NEAR(state.weights[2], state.weights[3], 1e-2F) << frame;
        }
    }
    EXPECT_TRUE(any);
}

INSTANTIATE_TEST_SUITE_P(Solvers, ControlProperties,
                         testing::Values(SolverKind::kLeastSquares, SolverKind::kNonNegative,
                                         SolverKind::kBoxQp, SolverKind::kRbf));

}  // namespace
}  // namespace rig
