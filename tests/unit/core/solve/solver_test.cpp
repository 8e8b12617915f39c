#include "core/solve/solver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options, double rate_hz = 60.0) : face(options) {
        configure_solver(face.pack(), rate_hz, *workspace, *config);
    }

    // All markers at these face-frame positions with information I / noise^2, except the hidden ones.
    void see(const std::vector<Vec3>& positions, const std::vector<bool>& hidden = {}) {
        const double noise = static_cast<double>(config->pack.noise_mm);
        stabilised->count = static_cast<std::uint16_t>(positions.size());
        completed->count = stabilised->count;
        for (std::size_t k = 0; k < positions.size(); ++k) {
            StabilisedMarker& marker = stabilised->markers[k];
            marker = StabilisedMarker{};
            completed->position_mm[k] = positions[k];
            if (!hidden.empty() && hidden[k]) continue;
            marker.seen = true;
            marker.position_mm = positions[k];
            marker.information = Mat3::Identity() / (noise * noise);
        }
    }
    void run(std::int64_t capture_us) {
        solve(*config, *stabilised, *completed, capture_us, *state, *workspace, *output, *report);
    }
    std::vector<double> weights() const {
        return {output->weights.begin(),
                output->weights.begin() + static_cast<std::ptrdiff_t>(face.shape_count())};
    }

    test::SyntheticFace face;
    std::unique_ptr<SolverConfig> config = std::make_unique<SolverConfig>();
    std::unique_ptr<SolverState> state = std::make_unique<SolverState>();
    std::unique_ptr<SolverWorkspace> workspace = std::make_unique<SolverWorkspace>();
    std::unique_ptr<StabiliserOutput> stabilised = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceOutput> completed = std::make_unique<InferenceOutput>();
    std::unique_ptr<SolverOutput> output = std::make_unique<SolverOutput>();
    std::unique_ptr<SolverReport> report = std::make_unique<SolverReport>();
};

test::SyntheticFaceOptions options(SolverKind kind, double gamma = 0.0) {
    test::SyntheticFaceOptions o;
    o.solver = kind;
    o.temporal_gamma_mm2 = gamma;
    o.ridge_mm2 = 1e-9;
    return o;
}

TEST(Solver, CleanMarkersGiveTheWeightsBack) {
    for (const SolverKind kind : {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp}) {
        Scene s(options(kind));
        for (int frame = 0; frame < 50; ++frame) {
            const std::vector<double> truth = s.face.weights_at(frame / 60.0);
            s.see(s.face.positions(truth));
            s.run(frame * 16'667);
            ASSERT_TRUE(s.report->solved && s.report->optimal);
            for (std::size_t i = 0; i < truth.size(); ++i) ASSERT_NEAR(s.output->weights[i], truth[i], 1e-5);
            ASSERT_LT(s.report->kkt, 1e-9);
            ASSERT_LT(s.report->residual_rms_mm, 1e-5);
            ASSERT_EQ(s.report->markers_used, 60);
        }
    }
}

TEST(Solver, ObjectiveIsTheEnergyOfTheAnswer) {
    test::SeededRandom random(131);
    Scene s(options(SolverKind::kBoxQp, 2.0));
    std::vector<double> previous;
    for (int frame = 0; frame < 10; ++frame) {
        std::vector<Vec3> seen = s.face.positions(s.face.weights_at(frame / 60.0));
        test::add_noise(seen, 0.3, random);
        s.see(seen);
        s.run(frame * 16'667);
        const std::vector<double> w = s.weights();
        const std::vector<Vec3> at = s.face.positions(w);
        double energy = 0.0;
        for (std::size_t k = 0; k < 60; ++k) energy += (at[k] - seen[k]).squaredNorm();
        if (frame > 0) {
            for (std::size_t i = 0; i < w.size(); ++i)
                energy += 2.0 * (w[i] - previous[i]) * (w[i] - previous[i]);
        }
        EXPECT_NEAR(s.report->objective_mm2, energy, 1e-4 * energy + 1e-6) << frame;
        previous = w;
    }
}

TEST(Solver, TemporalPriorFadesWithTheGapAndEndsAfterALoss) {
    Scene s(options(SolverKind::kBoxQp, 1e6));  // so strong that the weights all but stand still
    const std::vector<double> start(30, 0.2);
    const std::vector<double> target(30, 0.8);
    s.see(s.face.positions(start));
    s.run(0);
    s.see(s.face.positions(target));
    s.run(16'667);
    for (std::size_t i = 0; i < 30; ++i) EXPECT_NEAR(s.output->weights[i], 0.2, 0.01) << "pulled";
    s.run(16'667 + 260'000);
    for (std::size_t i = 0; i < 30; ++i)
        EXPECT_NEAR(s.output->weights[i], 0.8, 1e-4) << "after 260 ms it is forgotten";
}

TEST(Solver, TimesThatRunBackOrOverflowStartAnew) {
    Scene s(options(SolverKind::kBoxQp, 1e6));
    constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
    constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
    double w = 0.1;
    for (const std::int64_t at :
         {std::int64_t{0}, std::int64_t{-1'000}, kLast, kFirst, kLast, std::int64_t{5}}) {
        w = w < 0.5 ? 0.8 : 0.2;
        s.see(s.face.positions(std::vector<double>(30, w)));
        s.run(at);
        for (std::size_t i = 0; i < 30; ++i) EXPECT_NEAR(s.output->weights[i], w, 1e-4) << "at " << at;
    }
}

TEST(Solver, FewerThanFourMarkersKeepThePreviousWeights) {
    Scene s(options(SolverKind::kBoxQp));
    const std::vector<double> truth = s.face.weights_at(0.7);
    s.see(s.face.positions(truth));
    s.run(0);
    const std::vector<double> before = s.weights();
    std::vector<bool> hidden(60, true);
    hidden[3] = hidden[20] = hidden[40] = false;
    s.see(s.face.positions(s.face.weights_at(3.0)), hidden);
    s.run(16'667);
    EXPECT_FALSE(s.report->solved);
    EXPECT_EQ(s.weights(), before);
    EXPECT_EQ(s.report->markers_used, 3);
}

TEST(Solver, WeightsStayInTheRangeThatThePackDeclares) {
    test::SeededRandom random(132);
    for (const SolverKind kind : {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp}) {
        test::SyntheticFaceOptions o = options(kind);
        o.duplicate_columns = 2;
        o.zero_columns = 1;
        Scene s(o);
        for (int frame = 0; frame < 100; ++frame) {
            std::vector<Vec3> wild = s.face.positions(std::vector<double>(30, 0.5));
            test::add_noise(wild, 60.0, random);
            s.see(wild);
            s.run(frame * 16'667);
            for (std::size_t i = 0; i < 30; ++i) {
                ASSERT_GE(s.output->weights[i], 0.0);
                ASSERT_LE(s.output->weights[i], 1.0);
            }
        }
    }
}

TEST(Solver, ConfidenceFollowsWhatIsSeen) {
    Scene s(options(SolverKind::kBoxQp));
    const std::vector<Vec3> positions = s.face.positions(s.face.weights_at(0.0));
    s.see(positions);
    s.run(0);
    for (std::size_t i = 0; i < 30; ++i)
        EXPECT_NEAR(s.output->confidence[i], s.config->full_confidence[i], 1e-5);
    std::vector<bool> hidden(60, false);
    for (std::size_t k = 0; k < 60; ++k) hidden[k] = positions[k][1] < -30.0;
    s.see(positions, hidden);
    s.run(16'667);
    int lower = 0;
    for (std::size_t i = 0; i < 30; ++i) {
        EXPECT_LE(s.output->confidence[i], s.config->full_confidence[i] + 1e-5F);
        lower += s.output->confidence[i] < 0.5F * s.config->full_confidence[i] ? 1 : 0;
    }
    EXPECT_GT(lower, 3);
}

// Two cameras see every marker; then one goes dark, and the other still sees every marker: less is known.
TEST(Solver, ConfidenceFallsWhenOnlyTheDepthIsLost) {
    Scene s(options(SolverKind::kBoxQp));
    const std::vector<Vec3> positions = s.face.positions(s.face.weights_at(0.0));
    s.see(positions);
    s.run(0);
    const std::array<float, kMaxShapes> before = s.output->confidence;
    const Vec3 ray{0.0, 0.0, -1.0};
    for (std::size_t k = 0; k < 60; ++k) {
        s.stabilised->markers[k].information = (Mat3::Identity() - ray * ray.transpose()) * 100.0;
    }
    s.run(16'667);
    int lower = 0;
    for (std::size_t i = 0; i < 30; ++i) {
        EXPECT_LE(s.output->confidence[i], before[i] + 1e-6F);
        lower += s.output->confidence[i] < before[i] - 1e-4F ? 1 : 0;
    }
    EXPECT_GT(lower, 20);
}

}  // namespace
}  // namespace rig
