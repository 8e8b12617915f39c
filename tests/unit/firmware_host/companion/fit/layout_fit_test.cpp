#include "firmware_host/companion/fit/layout_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/firmware_host/companion/fit/fit_scene.hpp"

namespace rig::host {
namespace {

using test::fit_scene;
using test::FitScene;
using test::FitSceneOptions;
using test::layout_distance_mm;

Similarity somewhere() {
    return {
        1.07, Eigen::AngleAxisd(0.8, Vec3(0.3, 1.0, -0.2).normalized()).toRotationMatrix(), {50, -200, 600}};
}

// Neutral positions of the fitted layout on the rig as given.
MarkerLayout unscaled(const LayoutFit& fit) {
    MarkerLayout out = fit.layout;
    for (LayoutMarker& marker : out.markers) {
        for (float& x : marker.neutral_mm) x /= static_cast<float>(fit.rig_scale);
    }
    return out;
}

FitOptions still_head() {
    FitOptions options;
    options.neutral_end = 20;
    options.noise_mm = 0.05;
    options.stabilised = false;
    return options;
}

TEST(LayoutFit, FindsThePlacesInAnyFrameAndScale) {
    FitSceneOptions scene_options;
    scene_options.take_from_face = somewhere();
    const FitScene scene = fit_scene(scene_options);
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, still_head());
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_TRUE(fit->converged);
    EXPECT_FALSE(fit->projection_refused);
    EXPECT_GT(fit->rounds.front().rms_mm, 1.2);  // 1.5 mm misplaced
    EXPECT_LT(fit->rounds.back().rms_mm, 0.25);
    EXPECT_LE(fit->final_rms_mm, fit->rounds.back().rms_mm + 1e-6);
    EXPECT_NEAR(fit->rig_scale, 1.07, 0.01);
    EXPECT_LT(layout_distance_mm(unscaled(*fit), scene.tiny.layout), 0.5);
    for (std::size_t k = 0; k < fit->markers.size(); ++k) {
        EXPECT_EQ(fit->layout.markers[k].name, scene.rough.markers[k].name);
        EXPECT_EQ(fit->markers[k].frames, 320U);
    }
}

TEST(LayoutFit, ThrivesWithHiddenMarkersAndAMovingHead) {
    FitSceneOptions scene_options;
    scene_options.hidden_share = 0.15;
    scene_options.slip_mm = 2.0;
    const FitScene scene = fit_scene(scene_options);
    FitOptions options = still_head();
    options.stabilised = true;
    options.scaled = false;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_EQ(fit->rig_scale, 1.0);
    EXPECT_LT(fit->rounds.back().rms_mm, 0.3 * fit->rounds.front().rms_mm);
    EXPECT_LT(layout_distance_mm(fit->layout, scene.tiny.layout), 0.8);
}

TEST(LayoutFit, LeavesALayoutThatIsRightWhereItIs) {
    FitSceneOptions scene_options;
    scene_options.misplaced_mm = 0.0;
    const FitScene scene = fit_scene(scene_options);
    const auto fit = fit_layout(scene.tiny.rig, scene.tiny.layout, scene.take, still_head());
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_LT(layout_distance_mm(unscaled(*fit), scene.tiny.layout), 0.1);
    for (const LayoutMarker& marker : fit->layout.markers) {
        for (const float o : marker.offset_mm) EXPECT_LT(std::abs(o), 0.05F);
    }
}

TEST(LayoutFit, NeutralFramesThatAreNotNeutralDoNotSpoilIt) {
    FitSceneOptions scene_options;
    scene_options.misplaced_mm = 0.5;
    const FitScene scene = fit_scene(scene_options);
    FitOptions options = still_head();
    options.neutral_begin = 60;  // in the middle of the performance
    options.neutral_end = 61;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_TRUE(fit->projection_refused);
    EXPECT_GT(fit->rounds[1].rms_mm, fit->rounds[0].rms_mm);
    EXPECT_LT(fit->rounds.back().rms_mm, 0.5 * fit->rounds[0].rms_mm);
    EXPECT_LT(layout_distance_mm(unscaled(*fit), scene.tiny.layout), 0.4);
}

TEST(LayoutFit, OffsetsCarryWhatTheMeshCannot) {
    FitSceneOptions scene_options;
    const FitScene scene = fit_scene(scene_options);
    MarkerTake take = scene.take;
    const Float3& normal = scene.tiny.layout.markers[4].normal;
    const Vec3 outward(static_cast<double>(normal[0]), static_cast<double>(normal[1]),
                       static_cast<double>(normal[2]));
    for (std::size_t f = 0; f < take.frame_count; ++f)
        take.positions_mm[f * take.marker_count + 4] += 2.0 * outward;  // a ball on a stalk
    FitOptions options = still_head();
    options.scaled = false;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    const Float3& found = fit->layout.markers[4].offset_mm;
    const Vec3 offset(static_cast<double>(found[0]), static_cast<double>(found[1]),
                      static_cast<double>(found[2]));
    // One marker of thirty turns the alignment its way by its leverage, up to a fifth at the rim.
    EXPECT_NEAR(offset.dot(outward), 2.0, 0.4);
    EXPECT_LT((offset - offset.dot(outward) * outward).norm(), 0.3);
    EXPECT_GT(fit->markers[4].rms_mm, 1.5);
    EXPECT_LT(fit->final_rms_mm, 0.6 * fit->rounds.back().rms_mm);
    EXPECT_LT(fit->final_rms_mm, 0.2);
}

TEST(LayoutFit, TheSourcesProjectionWorksToo) {
    const FitScene scene = fit_scene({});
    FitOptions options = still_head();
    options.placement = Placement::kNeutral;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_LT(fit->rounds.back().rms_mm, 0.3 * fit->rounds.front().rms_mm);
}

TEST(LayoutFit, IsTheSameEveryTime) {
    const FitScene scene = fit_scene({});
    const auto first = fit_layout(scene.tiny.rig, scene.rough, scene.take, still_head());
    const auto second = fit_layout(scene.tiny.rig, scene.rough, scene.take, still_head());
    ASSERT_TRUE(first && second);
    for (std::size_t k = 0; k < first->layout.markers.size(); ++k) {
        EXPECT_EQ(first->layout.markers[k].vertices, second->layout.markers[k].vertices);
        EXPECT_EQ(first->layout.markers[k].barycentric, second->layout.markers[k].barycentric);
        EXPECT_EQ(first->layout.markers[k].offset_mm, second->layout.markers[k].offset_mm);
    }
}

TEST(LayoutFit, TellsHowFarItIs) {
    const FitScene scene = fit_scene({});
    double last = -1.0;
    std::string stage;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, still_head(),
                                [&](double share, const std::string& what) {
                                    EXPECT_GE(share, last);
                                    EXPECT_LE(share, 1.0);
                                    last = share;
                                    stage = what;
                                });
    ASSERT_TRUE(fit);
    EXPECT_EQ(stage, "round " + std::to_string(fit->rounds.size() - 1));
}

TEST(LayoutFit, SaysWhatIsWrong) {
    const FitScene scene = fit_scene({});
    const auto fault = [&](auto change) {
        FitScene changed = scene;
        FitOptions options = still_head();
        change(changed, options);
        const auto fit = fit_layout(changed.tiny.rig, changed.rough, changed.take, options);
        return fit ? std::string() : fit.error().message;
    };
    const auto contains = [](const std::string& text, const char* part) {
        return text.find(part) != std::string::npos;
    };
    const Vec3 nan = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    EXPECT_TRUE(contains(fault([](FitScene& s, FitOptions&) { s.rough.markers.pop_back(); }), "30 markers"));
    EXPECT_TRUE(
        contains(fault([](FitScene&, FitOptions& o) { o.landmarks = {"m1", "m2", "nose"}; }), "'nose'"));
    EXPECT_TRUE(
        contains(fault([](FitScene&, FitOptions& o) { o.landmarks = {"m1", "m2"}; }), "three landmarks"));
    EXPECT_TRUE(contains(fault([](FitScene&, FitOptions& o) { o.neutral_end = 999; }), "0:999"));
    EXPECT_TRUE(contains(fault([](FitScene&, FitOptions& o) { o.neutral_begin = 30; }), "empty"));
    EXPECT_TRUE(contains(fault([](FitScene&, FitOptions& o) { o.candidates = 0; }), "triangles"));
    EXPECT_TRUE(contains(fault([](FitScene&, FitOptions& o) { o.most_rounds = 0; }), "rounds"));
    EXPECT_TRUE(contains(fault([](FitScene&, FitOptions& o) { o.noise_mm = -1.0; }), "noise"));
    EXPECT_TRUE(contains(
        fault([](FitScene&, FitOptions& o) { o.threshold_mm = std::numeric_limits<double>::quiet_NaN(); }),
        "threshold"));
    EXPECT_TRUE(contains(fault([&](FitScene& s, FitOptions&) {
                             for (std::size_t f = 0; f < 20; ++f) s.take.positions_mm[f * 30 + 3] = nan;
                         }),
                         "--neutral"));
    EXPECT_TRUE(contains(fault([&](FitScene& s, FitOptions&) {
                             for (std::size_t f = 5; f < s.take.frame_count; ++f)
                                 s.take.positions_mm[f * 30 + 3] = nan;
                         }),
                         "5 frames"));
    // Two markers swapped throughout: tens of millimetres off.
    EXPECT_TRUE(contains(fault([](FitScene& s, FitOptions&) {
                             for (Vec3& p : s.take.positions_mm) p = Vec3(p[0], p[1], p[2] + 1.0);
                             for (std::size_t f = 0; f < s.take.frame_count; ++f)
                                 s.take.positions_mm[f * 30 + 2] += Vec3(0, 0, 80);
                         }),
                         "mm from the mesh"));
}

TEST(ScaledRig, ScalesEveryLength) {
    const FitScene scene = fit_scene({});
    const Rig twice = scaled_rig(scene.tiny.rig, 2.0);
    EXPECT_EQ(twice.vertices_mm[5][0], 2.0F * scene.tiny.rig.vertices_mm[5][0]);
    EXPECT_EQ(twice.shapes[1].delta_mm[3][2], 2.0F * scene.tiny.rig.shapes[1].delta_mm[3][2]);
    EXPECT_EQ(twice.triangles, scene.tiny.rig.triangles);
}

}  // namespace
}  // namespace rig::host
