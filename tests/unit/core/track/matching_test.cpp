#include "core/track/matching.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(std::size_t cameras) {
        test::SyntheticFaceOptions options;
        options.camera_count = cameras;
        options.marker_count = 40;
        face = std::make_unique<test::SyntheticFace>(options);
        truth = face->positions(face->weights_at(0.3));
    }

    void look(double sigma_px, double hide, int false_dots) {
        sightings->clear();
        views.clear();
        for (std::size_t c = 0; c < face->pack().camera_count; ++c) {
            views.push_back(face->observe(c, truth, sigma_px, hide, false_dots, random));
            add_camera_view(face->pack().cameras[c], views.back().observations, 0.15, 210.0, *sightings);
        }
    }

    test::SeededRandom random{71};
    std::unique_ptr<test::SyntheticFace> face;
    std::vector<Vec3> truth;
    std::vector<test::SyntheticFace::View> views;
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<MatchingWorkspace> workspace = std::make_unique<MatchingWorkspace>();
    std::unique_ptr<Matches> matches = std::make_unique<Matches>();
    std::unique_ptr<NamedMarkers> named = std::make_unique<NamedMarkers>();
};

TEST(Matching, NamesEveryViewFromNearbyPredictions) {
    Scene s(4);
    s.look(0.1, 0.15, 10);
    std::vector<Vec3> predicted = s.truth;
    test::add_noise(predicted, 0.5, s.random);
    match_views(predicted, *s.sightings, 4.0, *s.workspace, *s.matches);
    for (std::size_t view = 0; view < 4; ++view) {
        std::vector<int> expected(40, -1);
        for (std::size_t i = 0; i < s.views[view].marker.size(); ++i) {
            if (s.views[view].marker[i] >= 0)
                expected[static_cast<std::size_t>(s.views[view].marker[i])] = static_cast<int>(i);
        }
        for (std::size_t k = 0; k < 40; ++k) {
            if (expected[k] >= 0) {
                EXPECT_EQ((*s.matches)[view][k], expected[k]) << "view " << view << " marker " << k;
            }
        }
    }
}

TEST(Matching, InformationTellsHowManyViewsMeasured) {
    Scene s(2);
    s.look(0.1, 0.1, 0);
    match_views(s.truth, *s.sightings, 3.0, *s.workspace, *s.matches);
    combine_views(s.truth, *s.sightings, 1.5, *s.matches, *s.named);
    int with_one = 0;
    int with_two = 0;
    for (std::size_t k = 0; k < 40; ++k) {
        const NamedMarker& marker = s.named->markers[k];
        const int views = ((*s.matches)[0][k] >= 0 ? 1 : 0) + ((*s.matches)[1][k] >= 0 ? 1 : 0);
        EXPECT_EQ(marker.views, views);
        EXPECT_EQ(marker.seen, views > 0);
        if (views == 0) {
            EXPECT_EQ(marker.information.norm(), 0.0);
            continue;
        }
        const double scale = marker.information.trace() / 3.0;
        const double relative = marker.information.determinant() / (scale * scale * scale);
        if (views == 1) {
            ++with_one;
            EXPECT_LT(std::fabs(relative), 1e-9) << "one ray says nothing about depth";
        } else {
            ++with_two;
            EXPECT_GT(relative, 0.05);
            EXPECT_LT((marker.position_mm - s.truth[k]).norm(), 0.6);
        }
    }
    EXPECT_GT(with_one, 3);
    EXPECT_GT(with_two, 5);
}

// A false dot beside a marker in one view: the views disagree, the one farther from the prediction goes.
TEST(Matching, DisagreeingViewIsDropped) {
    Scene s(2);
    s.look(0.0, 0.0, 0);
    match_views(s.truth, *s.sightings, 3.0, *s.workspace, *s.matches);
    std::size_t marker = 0;
    while ((*s.matches)[0][marker] < 0 || (*s.matches)[1][marker] < 0) ++marker;
    const auto at = static_cast<std::size_t>((*s.matches)[1][marker]);
    Sighting& wrong = s.sightings->views[1][at];
    wrong.direction = (wrong.direction + Vec3{0.0, 0.02, 0.0}).normalized();  // 4 mm off
    combine_views(s.truth, *s.sightings, 1.5, *s.matches, *s.named);
    EXPECT_EQ((*s.matches)[1][marker], -1);
    EXPECT_GE((*s.matches)[0][marker], 0);
    EXPECT_EQ(s.named->markers[marker].views, 1);
    EXPECT_LT((s.named->markers[marker].position_mm - s.truth[marker]).norm(), 0.01);
}

// A measured 3D point is what it is, however noisy its stream and however far off the prediction.
TEST(Matching, PredictionDoesNotPullAMeasuredPoint) {
    for (const double sigma_mm : {0.05, 0.3, 2.0}) {
        auto sightings = std::make_unique<SightingSet>();
        const std::vector<Vec3> points{{10.0, 0.0, 0.0}, {-20.0, 5.0, 3.0}};
        add_point_view(points, sigma_mm, *sightings);
        const std::vector<Vec3> predicted{{12.0, 0.0, 0.0}, {-20.0, 7.0, 3.0}};
        auto workspace = std::make_unique<MatchingWorkspace>();
        auto matches = std::make_unique<Matches>();
        auto named = std::make_unique<NamedMarkers>();
        match_views(predicted, *sightings, 5.0, *workspace, *matches);
        combine_views(predicted, *sightings, 1.5, *matches, *named);
        for (std::size_t k = 0; k < 2; ++k) {
            ASSERT_TRUE(named->markers[k].seen);
            EXPECT_EQ(named->markers[k].views, 0);
            EXPECT_LT((named->markers[k].position_mm - points[k]).norm(), 0.003) << "sigma " << sigma_mm;
            EXPECT_LT((named->markers[k].information * sigma_mm * sigma_mm - Mat3::Identity()).norm(), 1e-12);
        }
    }
}

// What the matches of a view cost, markers that stay alone included; checks that they are allowed.
// Squared distance of marker k from a sighting, at the exposure of its row.
double cost_at_row(std::span<const Vec3> predicted, std::span<const Vec3> velocity, std::size_t k,
                   const Sighting& sighting) {
    Vec3 at = predicted[k];
    if (!velocity.empty()) at += sighting.delay_us * velocity[k];
    return std::max(0.0, sighting.squared_distance_mm2(at));
}

// Of a match: cost[k * sightings + j] of its pairs, the gate's for markers that stay alone.
double cost_of(std::span<const std::int16_t> match, std::span<const double> cost, double gate_mm) {
    const std::size_t sightings = cost.size() / match.size();
    double sum = 0.0;
    std::vector<bool> used(sightings, false);
    for (std::size_t k = 0; k < match.size(); ++k) {
        if (match[k] < 0) {
            sum += gate_mm * gate_mm;
            continue;
        }
        const auto at = static_cast<std::size_t>(match[k]);
        EXPECT_FALSE(used[at]) << "a sighting is used once";
        used[at] = true;
        EXPECT_LT(cost[k * sightings + at], gate_mm * gate_mm);
        sum += cost[k * sightings + at];
    }
    return sum;
}

TEST(Matching, GroupsFindTheOptimumOfAllPairs) {
    Scene s(2);
    auto whole = std::make_unique<AssignmentWorkspace>();
    for (int round = 0; round < 120; ++round) {
        s.look(0.5, 0.1, round % 20);
        add_point_view(s.truth, 0.1, *s.sightings);
        std::vector<Vec3> cloud = s.truth;
        test::add_noise(cloud, 2.0, s.random);
        add_point_view(cloud, 0.1, *s.sightings);
        if (round % 4 == 1) {
            for (Sighting& sighting : s.sightings->views[0]) sighting.point_mm += 20.0 * sighting.direction;
        } else if (round % 4 == 2) {
            for (Sighting& sighting : s.sightings->views[0]) {
                if (s.random.chance(0.3)) sighting.direction = -sighting.direction;
            }
        }
        std::vector<Vec3> predicted = s.truth;
        test::add_noise(predicted, 0.3 * (round % 12), s.random);
        if (round % 5 == 0) predicted[7] = Vec3{1e9, -1e9, 1e9};
        if (round % 5 == 1) predicted[8] = s.face->pack().cameras[0].centre_mm;
        const double gate_mm = 1.0 + 1.5 * (round % 11);
        // Every other round with a rolling shutter: rows up to 5 ms off, markers at up to 0.3 m/s.
        std::vector<Vec3> velocity(round % 2 == 0 ? 0 : predicted.size(), Vec3::Zero());
        test::add_noise(velocity, 1e-4, s.random);
        for (Sighting& sighting : s.sightings->views[0]) sighting.delay_us = s.random.uniform(-5e3, 5e3);
        match_views(predicted, *s.sightings, gate_mm, *s.workspace, *s.matches, velocity);
        for (std::size_t view = 0; view < 4; ++view) {
            const auto& seen = s.sightings->views[view];
            std::vector<double> cost;
            for (std::size_t k = 0; k < predicted.size(); ++k) {
                for (const Sighting& sighting : seen)
                    cost.push_back(cost_at_row(predicted, velocity, k, sighting));
            }
            AssignmentProblem problem{predicted.size(), seen.size(), cost, gate_mm * gate_mm};
            std::vector<std::int16_t> best(predicted.size());
            solve_assignment(problem, *whole, best);
            const double least = cost_of(best, cost, gate_mm);
            const double got = cost_of(std::span((*s.matches)[view]).first(predicted.size()), cost, gate_mm);
            ASSERT_NEAR(got, least, 1e-9 * least) << "round " << round << " view " << view;
        }
    }
}

TEST(Matching, PredictionsThatAreNoNumbersStayAlone) {
    Scene s(1);
    s.look(0.1, 0.0, 0);
    std::vector<Vec3> predicted = s.truth;
    predicted[0] = Vec3::Constant(std::nan(""));
    predicted[1] = Vec3::Constant(HUGE_VAL);
    match_views(predicted, *s.sightings, 4.0, *s.workspace, *s.matches);
    EXPECT_EQ((*s.matches)[0][0], -1);
    EXPECT_EQ((*s.matches)[0][1], -1);
}

}  // namespace
}  // namespace rig
