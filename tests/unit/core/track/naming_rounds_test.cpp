#include "core/track/naming_rounds.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    Scene() : face({}) {
        model = test::shape_model_of(face.pack());
        truth = test::moved(test::creeping_slip(1.0), face.positions(face.weights_at(1.0)));
        sightings->clear();
        add_point_view(truth, 0.1, *sightings);
        take_leading_modes(*model, workspace->coarse);
    }
    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model;
    std::vector<Vec3> truth;
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<NamingWorkspace> workspace = std::make_unique<NamingWorkspace>();
};

TEST(NamingRounds, AStartNearbyNamesEverySighting) {
    Scene s;
    test::SeededRandom random(5);
    for (int i = 0; i < 20; ++i) {
        ShapeFit start;
        start.pose = test::random_slip(random, 0.05, 4.0);
        const double score = approach({}, *s.sightings, *s.workspace, start);
        EXPECT_GT(score, 0.0);
        EXPECT_LE(score, 60.0);
        run_rounds(*s.model, {}, start, *s.sightings, *s.workspace);
        for (std::size_t k = 0; k < 60; ++k) EXPECT_EQ(s.workspace->matches[0][k], static_cast<int>(k));
        EXPECT_LT(naming_cost_mm2(*s.model, *s.sightings, s.workspace->matches, *s.workspace), 60.0 * 0.1);
    }
}

TEST(NamingRounds, TheCostIsThatOfTheSightings) {
    Scene s;
    Matches none;
    for (auto& view : none) view.fill(-1);
    constexpr double kMost = kNamingGateMm * kNamingGateMm;
    EXPECT_EQ(naming_cost_mm2(*s.model, *s.sightings, none, *s.workspace), 60.0 * kMost);
    for (std::size_t k = 0; k < 60; ++k) s.workspace->predicted_mm[k] = s.truth[k] + Vec3{1.0, 0.0, 0.0};
    Matches some = none;
    some[0][4] = 4;   // 1 mm off
    some[0][5] = 20;  // farther than the gate: no better than no name
    EXPECT_NEAR(naming_cost_mm2(*s.model, *s.sightings, some, *s.workspace), 59.0 * kMost + 1.0, 1e-9);
}

TEST(NamingRounds, GivenNamesPlaceTheFace) {
    Scene s;
    Matches names{};
    for (std::size_t k = 0; k < 60; ++k) names[0][k] = static_cast<std::int16_t>(k);
    fit_to_names(*s.model, {0.2, 15.0}, ShapeFit{}, *s.sightings, names, *s.workspace);
    ASSERT_TRUE(s.workspace->trial.ok);
    double worst = 0.0;
    for (std::size_t k = 0; k < 60; ++k)
        worst = std::max(worst, (s.workspace->predicted_mm[k] - s.truth[k]).norm());
    EXPECT_LT(worst, 1.0);
}

}  // namespace
}  // namespace rig
