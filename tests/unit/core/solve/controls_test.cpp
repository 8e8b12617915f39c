#include "core/solve/controls.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/solve/solver.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

using test::SeededRandom;
using test::SyntheticFace;
using test::SyntheticFaceOptions;

constexpr std::size_t kShapes = 12;

SyntheticFaceOptions options(SolverKind kind = SolverKind::kBoxQp) {
    SyntheticFaceOptions o;
    o.marker_count = 24;
    o.shape_count = kShapes;
    o.solver = kind;
    o.temporal_gamma_mm2 = 0.0;
    return o;
}

ControlEdit of_shapes(ControlKind kind, std::vector<std::size_t> shapes, float value, float high = 0.0F) {
    ControlEdit edit{kind, value, high, 0, 0, {}};
    for (const std::size_t i : shapes) put_in(edit.shapes, i);
    return edit;
}

ControlEdit of_pair(ControlKind kind, std::uint16_t a, std::uint16_t b, float value) {
    return {kind, value, 0.0F, a, b, {}};
}

ControlSet set_of(const std::vector<ControlEdit>& edits) {
    ControlSet set;
    for (const ControlEdit& edit : edits) EXPECT_TRUE(edit_controls(edit, kShapes, set).has_value());
    return set;
}

std::unique_ptr<Controls> prepared(const SolvePack& pack, const ControlSet& set) {
    auto controls = std::make_unique<Controls>();
    prepare_controls(pack, set, *controls);
    return controls;
}

// A solver with controls, fed one frame after the other.
struct Scene {
    explicit Scene(const SyntheticFaceOptions& o) : face(o) {
        configure_solver(face.pack(), 60.0, *workspace, *config);
    }
    void set(const std::vector<ControlEdit>& edits) {
        prepare_controls(config->pack, set_of(edits), config->controls);
    }
    void see(const std::vector<Vec3>& positions) {
        const double noise = static_cast<double>(config->pack.noise_mm);
        stabilised->count = static_cast<std::uint16_t>(positions.size());
        for (std::size_t k = 0; k < positions.size(); ++k) {
            stabilised->markers[k] = StabilisedMarker{};
            stabilised->markers[k].seen = true;
            stabilised->markers[k].position_mm = positions[k];
            stabilised->markers[k].information = Mat3::Identity() / (noise * noise);
        }
        solve(*config, *stabilised, *completed, frame++ * 16'667, *state, *workspace, *output, *report);
    }
    double w(std::size_t i) const { return output->weights[i]; }
    // E at any weights, from the positions themselves.
    double energy(const std::vector<Vec3>& seen, std::span<const double> weights) const {
        const std::vector<Vec3> at = face.positions(weights);
        double sum = 0.0;
        for (std::size_t k = 0; k < at.size(); ++k) sum += (at[k] - seen[k]).squaredNorm();
        for (const double each : weights) sum += static_cast<double>(config->pack.ridge_mm2) * each * each;
        return sum;
    }

    SyntheticFace face;
    std::unique_ptr<SolverConfig> config = std::make_unique<SolverConfig>();
    std::unique_ptr<SolverState> state = std::make_unique<SolverState>();
    std::unique_ptr<SolverWorkspace> workspace = std::make_unique<SolverWorkspace>();
    std::unique_ptr<StabiliserOutput> stabilised = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceOutput> completed = std::make_unique<InferenceOutput>();
    std::unique_ptr<SolverOutput> output = std::make_unique<SolverOutput>();
    std::unique_ptr<SolverReport> report = std::make_unique<SolverReport>();
    int frame = 0;
};

std::vector<double> weights_with(std::vector<std::pair<std::size_t, double>> on) {
    std::vector<double> w(kShapes, 0.0);
    for (const auto& [i, value] : on) w[i] = value;
    return w;
}

TEST(Controls, NeutralDoesNothing) {
    const SyntheticFace face(options());
    const auto controls = prepared(face.pack(), ControlSet{});
    EXPECT_FALSE(controls->acts_on_problem);
    EXPECT_FALSE(controls->acts_on_output);
    std::vector<double> hessian(kShapes * kShapes, 0.1);
    std::vector<double> linear(kShapes, 0.2);
    std::vector<double> low(kShapes, -std::numeric_limits<double>::infinity());
    std::vector<double> high(kShapes, 3.0);
    double constant = 0.3;
    add_control_curvature(*controls, 1.0, hessian, kShapes);
    add_control_pull(*controls, 1.0, std::vector<double>(kShapes, 0.5), linear, constant);
    narrow_bounds(*controls, low, high);
    CancelState state;
    EXPECT_FALSE(cancel_pairs(*controls, std::vector<double>(kShapes, 1.0), low, high, state));
    std::vector<double> weights{-0.0, 0.25, 7.0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    control_output(*controls, weights);
    EXPECT_TRUE(std::signbit(weights[0]));
    EXPECT_EQ(weights[2], 7.0) << "the solver's own clamp is not repeated";
    for (const double x : hessian) EXPECT_EQ(x, 0.1);
    for (const double x : linear) EXPECT_EQ(x, 0.2);
    EXPECT_EQ(low[0], -std::numeric_limits<double>::infinity());
    EXPECT_EQ(constant, 0.3);
}

// 2 (1/2 w^T H w + q^T w) + c grows by exactly the terms of the header's formula, for packs with and without
// terms of their own.
void expect_the_formula(bool pack_has_terms) {
    SyntheticFaceOptions o = options();
    o.temporal_gamma_mm2 = pack_has_terms ? 0.3 : 0.0;
    o.ridge_mm2 = pack_has_terms ? 0.02 : 0.0;
    const SyntheticFace face(o);
    SolvePack pack = face.pack();
    pack.sparsity_mm2 = pack_has_terms ? 0.5F : 0.0F;
    const auto controls = prepared(
        pack,
        set_of({of_shapes(ControlKind::kSparsity, {0, 3}, 4.0F), of_shapes(ControlKind::kRidge, {3}, 7.0F),
                of_shapes(ControlKind::kTemporal, {5}, 3.0F), of_shapes(ControlKind::kTemporal, {6}, 0.0F),
                of_pair(ControlKind::kSymmetry, 1, 2, 0.5F)}));
    const double s2 = static_cast<double>(pack.noise_mm) * static_cast<double>(pack.noise_mm);
    const auto sigma = [&](std::size_t i) { return static_cast<double>(pack.prior_sigma[i]); };
    const double column1 = face.column_length(1);
    const double column2 = face.column_length(2);
    SeededRandom random(31);
    for (int round = 0; round < 50; ++round) {
        std::vector<double> hessian(kShapes * kShapes, 0.0);
        std::vector<double> linear(kShapes, 0.0);
        std::vector<double> previous(kShapes);
        std::vector<double> w(kShapes);
        for (std::size_t i = 0; i < kShapes; ++i) {
            w[i] = random.uniform(0.0, 1.0);
            previous[i] = random.uniform(0.0, 1.0);
        }
        const double g = random.uniform(0.2, 1.0);
        double constant = 0.0;
        add_control_curvature(*controls, g, hessian, kShapes);
        add_control_pull(*controls, g, previous, linear, constant);
        double got = constant;
        for (std::size_t i = 0; i < kShapes; ++i) {
            got += 2.0 * linear[i] * w[i];
            for (std::size_t j = 0; j < kShapes; ++j) got += w[i] * hessian[i * kShapes + j] * w[j];
        }
        const auto beta = [&](std::size_t i) {
            return 3.0 * (pack_has_terms ? 0.5 : 2.0 * std::sqrt(2.0) * s2 / sigma(i));
        };
        const double eps =
            6.0 * (pack_has_terms ? static_cast<double>(pack.ridge_mm2) : s2 / (sigma(3) * sigma(3)));
        const auto pull = [&](std::size_t i) { return g * std::pow(w[i] - previous[i], 2); };
        const double own = static_cast<double>(pack.temporal_gamma[5]);
        const double more = 2.0 * (pack_has_terms ? own : 100.0 * s2 / (sigma(5) * sigma(5)));
        const double less = pack_has_terms ? own : 0.0;
        const double together =
            0.5 * 0.5 * (column1 * column1 + column2 * column2) * std::pow(w[1] - w[2], 2);
        const double wanted =
            beta(0) * w[0] + beta(3) * w[3] + eps * w[3] * w[3] + more * pull(5) - less * pull(6) + together;
        ASSERT_NEAR(got, wanted, 1e-12 * (1.0 + std::fabs(wanted)));
    }
}

TEST(Controls, AddExactlyTheTermsOfTheFormula) {
    expect_the_formula(true);
    expect_the_formula(false);
}

TEST(Controls, TheAnswerIsTheOptimumOfTheControlledProblem) {
    SeededRandom random(32);
    Scene s(options());
    s.set({of_shapes(ControlKind::kRidge, {0, 1, 2}, 50.0F), of_pair(ControlKind::kSymmetry, 3, 4, 0.7F),
           of_shapes(ControlKind::kRange, {5}, 0.1F, 0.4F)});
    const double ridge = 49.0 * static_cast<double>(s.config->pack.ridge_mm2);
    const double pull =
        0.7 * 0.5 * (std::pow(s.face.column_length(3), 2) + std::pow(s.face.column_length(4), 2));
    const auto energy = [&](const std::vector<Vec3>& seen, std::span<const double> w) {
        return s.energy(seen, w) + ridge * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) +
               pull * (w[3] - w[4]) * (w[3] - w[4]);
    };
    for (int round = 0; round < 20; ++round) {
        std::vector<Vec3> seen = s.face.positions(s.face.random_weights(random));
        test::add_noise(seen, 0.3, random);
        s.see(seen);
        ASSERT_TRUE(s.report->optimal);
        ASSERT_LT(s.report->kkt, 1e-9);
        std::vector<double> best(s.output->weights.begin(), s.output->weights.begin() + kShapes);
        const double least = energy(seen, best);
        ASSERT_NEAR(s.report->objective_mm2, least, 1e-6 * (1.0 + least));
        ASSERT_TRUE(best[5] >= static_cast<double>(0.1F) && best[5] <= static_cast<double>(0.4F));
        for (int step = 0; step < 200; ++step) {
            std::vector<double> other = best;
            for (double& x : other) x = std::clamp(x + random.normal(0.0, 0.02), 0.0, 1.0);
            other[5] = std::clamp(other[5], static_cast<double>(0.1F), static_cast<double>(0.4F));
            ASSERT_GE(energy(seen, other), least - 1e-9);
        }
    }
}

TEST(Controls, EachPullsInItsDirection) {
    const auto truth = weights_with({{0, 0.6}, {1, 0.3}, {2, 0.9}});
    const auto solved = [&](const std::vector<ControlEdit>& edits, int frames = 1) {
        Scene s(options());
        s.see(s.face.positions(weights_with({})));
        s.set(edits);
        for (int i = 0; i < frames; ++i) s.see(s.face.positions(truth));
        return s.output->weights;
    };
    const auto plain = solved({});
    EXPECT_NEAR(plain[0], 0.6, 1e-3);
    EXPECT_LT(solved({of_shapes(ControlKind::kSparsity, {0}, 5000.0F)})[0], plain[0] - 0.01);
    EXPECT_LT(solved({of_shapes(ControlKind::kRidge, {0}, 1e4F)})[0], plain[0]);
    const double after_one = solved({of_shapes(ControlKind::kTemporal, {0}, 1000.0F)})[0];
    EXPECT_LT(after_one, plain[0] - 0.1);
    EXPECT_GT(solved({of_shapes(ControlKind::kTemporal, {0}, 1000.0F)}, 5)[0], after_one);
    const auto tied = solved({of_pair(ControlKind::kSymmetry, 0, 1, 100.0F)});
    EXPECT_LT(std::fabs(tied[0] - tied[1]), 0.01);
    EXPECT_NEAR(solved({of_shapes(ControlKind::kRange, {2}, 0.0F, 0.5F)})[2], 0.5, 1e-9);
}

TEST(Controls, RangesBoundEverySolver) {
    SeededRandom random(33);
    for (const SolverKind kind : {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp}) {
        Scene s(options(kind));
        s.set({of_shapes(ControlKind::kRange, {1}, 0.25F, 0.5F),
               of_shapes(ControlKind::kRange, {2}, -5.0F, -2.0F)});
        for (int round = 0; round < 30; ++round) {
            std::vector<Vec3> seen = s.face.positions(s.face.random_weights(random));
            test::add_noise(seen, 5.0, random);
            s.see(seen);
            ASSERT_TRUE(s.w(1) >= 0.25 && s.w(1) <= 0.5);
            ASSERT_EQ(s.w(2), 0.0) << "beyond the pack's range its nearest end stands";
        }
    }
}

TEST(Controls, CancelledShapesAreNeverOnTogether) {
    SeededRandom random(34);
    for (const SolverKind kind : {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp}) {
        Scene s(options(kind));
        // A chain: 0-1, 1-2, and 3-4 apart.
        s.set({of_pair(ControlKind::kCancel, 0, 1, 1.0F), of_pair(ControlKind::kCancel, 1, 2, 1.0F),
               of_pair(ControlKind::kCancel, 3, 4, 1.0F)});
        int both_wanted = 0;
        for (int round = 0; round < 200; ++round) {
            const std::vector<double> truth = s.face.random_weights(random);
            both_wanted += truth[0] > 0.1 && truth[1] > 0.1 ? 1 : 0;
            std::vector<Vec3> seen = s.face.positions(truth);
            test::add_noise(seen, 0.5, random);
            s.see(seen);
            for (const auto& [a, b] : {std::pair{0U, 1U}, {1U, 2U}, {3U, 4U}}) {
                ASSERT_TRUE(std::max(s.w(a), 0.0) == 0.0 || std::max(s.w(b), 0.0) == 0.0)
                    << round << ": " << s.w(a) << " and " << s.w(b);
            }
            ASSERT_TRUE(s.report->optimal);
        }
        EXPECT_GT(both_wanted, 20);
    }
}

// The second solve is the optimum with the loser at rest, not the first answer with a weight struck out.
TEST(Controls, TheRestIsSolvedAgainWithoutTheLoser) {
    const SyntheticFaceOptions o = options();
    Scene s(o);
    const auto seen = s.face.positions(weights_with({{0, 0.5}, {1, 0.4}, {7, 0.3}}));
    s.set({of_pair(ControlKind::kCancel, 0, 1, 1.0F)});
    s.see(seen);
    EXPECT_EQ(s.w(1), 0.0);
    Scene fixed(o);
    fixed.set({of_shapes(ControlKind::kRange, {1}, 0.0F, 0.0F)});
    fixed.see(seen);
    for (std::size_t i = 0; i < kShapes; ++i) EXPECT_NEAR(s.w(i), fixed.w(i), 1e-9);
}

TEST(Controls, CancelPairsDoNotFlicker) {
    const SyntheticFace face(options());
    const auto controls = prepared(face.pack(), set_of({of_pair(ControlKind::kCancel, 0, 1, 1.0F)}));
    CancelState state;
    std::vector<double> low(kShapes, 0.0);
    std::vector<double> high(kShapes, 1.0);
    SeededRandom random(35);
    // 0 for the first shape, 1 for the second.
    const auto stays = [&](double first, double second) {
        std::vector<double> bottom = low;
        std::vector<double> top = high;
        const bool again =
            cancel_pairs(*controls, weights_with({{0, first}, {1, second}}), bottom, top, state);
        EXPECT_TRUE(again);
        EXPECT_NE(top[0] == 0.0, top[1] == 0.0);
        return top[0] == 0.0 ? 1 : 0;
    };
    EXPECT_EQ(stays(0.3, 0.2), 0);
    int changes = 0;
    for (int frame = 0; frame < 1000; ++frame)
        changes += stays(0.3 + random.normal(0.0, 0.01), 0.3 + random.normal(0.0, 0.01));
    EXPECT_EQ(changes, 0) << "noise is no reason";
    EXPECT_EQ(stays(0.3, 0.39), 0);
    EXPECT_EQ(stays(0.3, 0.40), 1) << "a quarter and 0.02 more is";
    EXPECT_EQ(stays(0.3, 0.30), 1);
    EXPECT_EQ(stays(0.39, 0.30), 1);
    EXPECT_EQ(stays(0.4, 0.1), 0);
    // Off already: nothing to solve again, and who is on stays.
    std::vector<double> bottom = low;
    std::vector<double> top = high;
    EXPECT_FALSE(cancel_pairs(*controls, weights_with({{1, 0.05}}), bottom, top, state));
    EXPECT_EQ(top[0], 1.0);
    EXPECT_EQ(stays(0.05, 0.05), 1);
}

TEST(Controls, RestIsTheEndOfTheRangeNextToZero) {
    const SyntheticFace face(options());
    const auto controls = prepared(face.pack(), set_of({of_pair(ControlKind::kCancel, 0, 1, 1.0F)}));
    CancelState state;
    std::vector<double> low(kShapes, 0.25);
    std::vector<double> high(kShapes, 1.0);
    std::vector<double> w(kShapes, 0.25);
    EXPECT_FALSE(cancel_pairs(*controls, w, low, high, state));
    w[0] = 0.5;
    w[1] = 0.75;
    EXPECT_TRUE(cancel_pairs(*controls, w, low, high, state));
    // The first frame had the first one staying, and 0.5 from rest against 0.25 is enough to take over.
    EXPECT_EQ(low[0], 0.25);
    EXPECT_EQ(high[0], 0.25);
    EXPECT_EQ(high[1], 1.0);
}

TEST(Controls, OutputIsMultipliedShiftedAndClamped) {
    const SyntheticFace face(options());
    const auto controls = prepared(face.pack(), set_of({of_shapes(ControlKind::kMultiplier, {0}, 1.5F),
                                                        of_shapes(ControlKind::kOffset, {0, 1}, 0.25F),
                                                        of_shapes(ControlKind::kRange, {2}, 0.0F, 0.5F),
                                                        of_shapes(ControlKind::kMultiplier, {3}, -1e4F)}));
    std::vector<double> w(kShapes, 0.4);
    control_output(*controls, w);
    EXPECT_DOUBLE_EQ(w[0], 0.85);
    EXPECT_DOUBLE_EQ(w[1], 0.65);
    EXPECT_EQ(w[2], 0.4);
    EXPECT_EQ(w[3], 0.0);
    EXPECT_EQ(w[4], 0.4);
    w.assign(kShapes, 0.9);
    control_output(*controls, w);
    EXPECT_EQ(w[0], 1.0);
    EXPECT_EQ(w[2], 0.5);
}

TEST(Controls, EditsAreCheckedAndLeaveTheSetAlone) {
    ControlSet set;
    EXPECT_EQ(edit_controls(of_shapes(ControlKind::kRidge, {kShapes}, 1.0F), kShapes, set).error(),
              ControlError::kShape);
    EXPECT_EQ(edit_controls(of_shapes(ControlKind::kRidge, {0}, -1.0F), kShapes, set).error(),
              ControlError::kValue);
    EXPECT_EQ(edit_controls(of_pair(ControlKind::kCancel, 0, kShapes, 1.0F), kShapes, set).error(),
              ControlError::kShape);
    EXPECT_EQ(set.shapes, ControlSet{}.shapes);
    EXPECT_TRUE(edit_controls(of_pair(ControlKind::kSymmetry, 0, 1, 2.0F), kShapes, set).has_value());
    EXPECT_TRUE(edit_controls(of_pair(ControlKind::kSymmetry, 2, 3, 1.0F), kShapes, set).has_value());
    EXPECT_TRUE(edit_controls(of_pair(ControlKind::kSymmetry, 1, 0, 5.0F), kShapes, set).has_value());
    ASSERT_EQ(set.symmetry.size(), 2U);
    EXPECT_EQ(set.symmetry[0].strength, 5.0F);
    EXPECT_TRUE(edit_controls(of_pair(ControlKind::kSymmetry, 0, 1, 0.0F), kShapes, set).has_value());
    ASSERT_EQ(set.symmetry.size(), 1U);
    EXPECT_EQ(set.symmetry[0].left, 2);
    EXPECT_TRUE(edit_controls(of_pair(ControlKind::kSymmetry, 0, 1, 0.0F), kShapes, set).has_value());
    ControlSet full;
    for (std::uint16_t i = 0; i < kMaxControlPairs; ++i)
        EXPECT_TRUE(edit_controls(of_pair(ControlKind::kCancel, i, 200, 1.0F), kMaxShapes, full).has_value());
    EXPECT_EQ(edit_controls(of_pair(ControlKind::kCancel, 201, 200, 1.0F), kMaxShapes, full).error(),
              ControlError::kPairs);
}

TEST(Controls, ChecksFindWhatEditsCannotMake) {
    const auto fault = [](auto change) {
        ControlSet set;
        change(set);
        const auto checked = check_controls(set, kShapes);
        return checked ? -1 : static_cast<int>(checked.error());
    };
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(fault([](ControlSet&) {}), -1);
    EXPECT_EQ(fault([](ControlSet& s) { s.shapes[0].sparsity = kNan; }),
              static_cast<int>(ControlError::kValue));
    EXPECT_EQ(fault([](ControlSet& s) { s.shapes[1].multiplier = -2e4F; }),
              static_cast<int>(ControlError::kValue));
    EXPECT_EQ(fault([](ControlSet& s) { s.shapes[2].low = 0.5F, s.shapes[2].high = 0.25F; }),
              static_cast<int>(ControlError::kValue));
    EXPECT_EQ(fault([](ControlSet& s) { s.shapes[2].high = kNan; }), static_cast<int>(ControlError::kValue));
    EXPECT_EQ(fault([](ControlSet& s) { s.shapes[kShapes].offset = kNan; }), -1) << "no such shape";
    EXPECT_EQ(fault([](ControlSet& s) { static_cast<void>(s.symmetry.push_back({1, 1, 1.0F})); }),
              static_cast<int>(ControlError::kShape));
    EXPECT_EQ(fault([](ControlSet& s) { static_cast<void>(s.symmetry.push_back({0, 1, kNan})); }),
              static_cast<int>(ControlError::kValue));
    EXPECT_EQ(fault([](ControlSet& s) { static_cast<void>(s.cancel.push_back({0, kShapes})); }),
              static_cast<int>(ControlError::kShape));
}

TEST(Controls, AMeasurementProblemHasTheMeasurementAsItsOptimum) {
    const SyntheticFace face(options());
    const auto controls = prepared(face.pack(), ControlSet{});
    std::vector<double> y(kShapes);
    for (std::size_t i = 0; i < kShapes; ++i) y[i] = 0.05 * static_cast<double>(i);
    std::vector<double> hessian(kShapes * kShapes, 9.0);
    std::vector<double> linear(kShapes, 9.0);
    double constant = 9.0;
    measurement_curvature(*controls, hessian, kShapes);
    measurement_pull(*controls, y, linear, constant);
    double energy = constant;
    for (std::size_t i = 0; i < kShapes; ++i) {
        for (std::size_t j = 0; j < kShapes; ++j) {
            if (i != j) {
                EXPECT_EQ(hessian[i * kShapes + j], 0.0);
            }
        }
        EXPECT_NEAR(-linear[i] / hessian[i * kShapes + i], y[i], 1e-15);
        energy += hessian[i * kShapes + i] * y[i] * y[i] + 2.0 * linear[i] * y[i];
    }
    EXPECT_NEAR(energy, 0.0, 1e-12 * constant);
}

TEST(Controls, VersionsTellSetsApart) {
    const SyntheticFace face(options());
    Controls controls;
    prepare_controls(face.pack(), ControlSet{}, controls);
    const std::uint32_t first = controls.version;
    prepare_controls(face.pack(), ControlSet{}, controls);
    EXPECT_NE(controls.version, first);
}

}  // namespace
}  // namespace rig
