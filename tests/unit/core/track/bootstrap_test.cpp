#include "core/track/bootstrap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options) : face(options) {
        model = test::shape_model_of(face.pack());
    }

    // Frames until found, or 0 when not within `frames`.
    int search(int frames) {
        BootstrapState state;
        for (int i = 1; i <= frames; ++i) {
            report = bootstrap(*model, {}, {}, *sightings, state, *workspace, *fit);
            if (report.found) return i;
        }
        return 0;
    }

    // Largest distance of a predicted marker from its true place, mm.
    double worst_mm(const std::vector<Vec3>& truth) const {
        double worst = 0.0;
        for (std::size_t k = 0; k < truth.size(); ++k) {
            worst = std::max(worst, (fit->headset_position(*model, k) - truth[k]).norm());
        }
        return worst;
    }

    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<BootstrapWorkspace> workspace = std::make_unique<BootstrapWorkspace>();
    std::unique_ptr<ShapeFit> fit = std::make_unique<ShapeFit>();
    BootstrapReport report;
};

constexpr double kSixDegrees = 6.0 * std::numbers::pi / 180.0;
// A start is right when every marker is predicted nearer to itself than any neighbour can be: the tracker's
// gate.
constexpr double kRightMm = 3.0;

struct Shares {
    int found = 0;
    int right = 0;
    int slowest_frame = 0;
};

Shares start_from_points(std::size_t markers, int trials, double rotation_rad, double translation_mm) {
    test::SyntheticFaceOptions options;
    options.marker_count = markers;
    Scene s(options);
    test::SeededRandom random(81 + markers);
    Shares shares;
    for (int i = 0; i < trials; ++i) {
        const std::vector<Vec3> truth =
            test::moved(test::random_slip(random, rotation_rad, translation_mm),
                        s.face.positions(s.face.weights_at(random.uniform(0.0, 100.0))));
        std::vector<Vec3> cloud;
        for (const Vec3& point : truth) {
            if (!random.chance(0.05)) cloud.push_back(point);
        }
        test::add_noise(cloud, 0.1, random);
        for (int g = 0; g < 2; ++g) {
            cloud.emplace_back(random.uniform(-80.0, 80.0), random.uniform(-120.0, 60.0),
                               random.uniform(-60.0, 30.0));
        }
        random.shuffle(std::span<Vec3>(cloud));
        s.sightings->clear();
        add_point_view(cloud, 0.1, *s.sightings);
        const int frame = s.search(9);
        if (frame == 0) continue;
        ++shares.found;
        shares.slowest_frame = std::max(shares.slowest_frame, frame);
        if (s.worst_mm(truth) < kRightMm) ++shares.right;
    }
    std::printf("%zu markers: %d found, %d right of %d, slowest after %d frames\n", markers, shares.found,
                shares.right, trials, shares.slowest_frame);
    return shares;
}

TEST(Bootstrap, FindsTheFaceInACloudAtAnyExpectedPose) {
    for (const std::size_t markers : {50U, 60U, 102U}) {
        const Shares shares = start_from_points(markers, 100, kSixDegrees, 8.0);
        EXPECT_GE(shares.found, 97);
        EXPECT_GE(shares.right, 97);
        EXPECT_LE(shares.found - shares.right, 1) << "a wrong start is worse than none";
    }
}

TEST(Bootstrap, SmallSlipsNeedOneFrame) {
    const Shares shares = start_from_points(60, 40, 0.02, 2.0);
    EXPECT_EQ(shares.right, 40);
    EXPECT_EQ(shares.slowest_frame, 1);
}

// Real dots that would be named as another marker by the pose and expression found. A false dot in the place
// of a hidden marker is not counted: one frame cannot tell.
int wrong_names(Scene& s, const std::vector<test::SyntheticFace::View>& views) {
    std::vector<Vec3> predicted;
    for (std::size_t k = 0; k < s.face.marker_count(); ++k)
        predicted.push_back(s.fit->headset_position(*s.model, k));
    auto matches = std::make_unique<Matches>();
    match_views(predicted, *s.sightings, 3.0, s.workspace->naming.matching, *matches);
    int wrong = 0;
    for (std::size_t c = 0; c < views.size(); ++c) {
        for (std::size_t k = 0; k < predicted.size(); ++k) {
            const std::int16_t at = (*matches)[c][k];
            if (at < 0) continue;
            const int is = views[c].marker[s.sightings->source[c][static_cast<std::size_t>(at)]];
            if (is >= 0 && is != static_cast<int>(k)) ++wrong;
        }
    }
    return wrong;
}

struct CameraCase {
    std::size_t cameras;
    int right_at_least;
};

class BootstrapFromCameras : public testing::TestWithParam<CameraCase> {};

TEST_P(BootstrapFromCameras, FindsTheFaceWithHiddenMarkersAndFalseDots) {
    test::SyntheticFaceOptions options;
    options.camera_count = GetParam().cameras;
    Scene s(options);
    test::SeededRandom random(85);
    constexpr int kTrials = 60;
    int most_wrong = 0;
    int found = 0;
    int right = 0;
    for (int i = 0; i < kTrials; ++i) {
        const std::vector<Vec3> truth =
            test::moved(test::random_slip(random, 0.05, 4.0),
                        s.face.positions(s.face.weights_at(random.uniform(0.0, 100.0))));
        s.sightings->clear();
        std::vector<test::SyntheticFace::View> views;
        for (std::size_t c = 0; c < options.camera_count; ++c) {
            views.push_back(s.face.observe(c, truth, 0.1, 0.05, 2, random));
            add_camera_view(s.face.pack().cameras[c], views[c].observations, 0.15, 210.0, *s.sightings);
        }
        if (s.search(9) == 0) continue;
        ++found;
        const int wrong = wrong_names(s, views);
        most_wrong = std::max(most_wrong, wrong);
        if (wrong == 0) ++right;
    }
    std::printf("%zu cameras: %d found, %d right of %d, at most %d wrong names\n", options.camera_count,
                found, right, kTrials, most_wrong);
    // One camera cannot see that a marker is turned away: at the rim of the face such a one may take its
    // neighbour's dot in the first frame. The tracker mends that (tracker_test.cpp); a wrong pose it could
    // not mend.
    EXPECT_EQ(found, kTrials);
    EXPECT_GE(right, GetParam().right_at_least);
    EXPECT_LE(most_wrong, 3);
}

INSTANTIATE_TEST_SUITE_P(Cameras, BootstrapFromCameras,
                         testing::Values(CameraCase{1, 50}, CameraCase{2, 57}, CameraCase{4, 59}));

// Ghosts beside the face, more than usual: no name is missing for them, and all starts come to the same
// names.
TEST(Bootstrap, GhostsThatNoMarkerIsMissingForDoNotDelay) {
    Scene s({});
    test::SeededRandom random(87);
    for (int i = 0; i < 20; ++i) {
        const std::vector<Vec3> truth =
            test::moved(test::random_slip(random, kSixDegrees, 8.0),
                        s.face.positions(s.face.weights_at(random.uniform(0.0, 100.0))));
        std::vector<Vec3> cloud = truth;
        for (int g = 0; g < 6; ++g)
            cloud.emplace_back(random.uniform(-80.0, 80.0), random.uniform(-120.0, 60.0),
                               random.uniform(60.0, 90.0));
        test::add_noise(cloud, 0.1, random);
        s.sightings->clear();
        add_point_view(cloud, 0.1, *s.sightings);
        EXPECT_EQ(s.search(9), 1) << i;
        EXPECT_LT(s.worst_mm(truth), kRightMm) << i;
    }
}

// ... but where one may be, what else it might be is looked for.
TEST(Bootstrap, GhostsBesideHiddenMarkersAreWaitedFor) {
    Scene s({});
    test::SeededRandom random(88);
    std::vector<Vec3> cloud =
        test::moved(test::random_slip(random, 0.02, 2.0), s.face.positions(s.face.weights_at(3.0)));
    for (std::size_t k = 0; k < 60; k += 10) cloud[k] += 7.0 * s.face.outward(k);
    s.sightings->clear();
    add_point_view(cloud, 0.1, *s.sightings);
    EXPECT_GT(s.search(9), 1);
}

TEST(Bootstrap, DoesNotFindAFaceWhereThereIsNone) {
    Scene s({});
    test::SeededRandom random(86);
    for (int i = 0; i < 20; ++i) {
        std::vector<Vec3> cloud;
        const std::size_t count = 1 + random.below(120);
        for (std::size_t p = 0; p < count; ++p) {
            cloud.emplace_back(random.uniform(-90.0, 90.0), random.uniform(-130.0, 70.0),
                               random.uniform(-80.0, 40.0));
        }
        s.sightings->clear();
        add_point_view(cloud, 0.1, *s.sightings);
        EXPECT_EQ(s.search(3), 0) << "from " << count << " random points";
    }
}

TEST(Bootstrap, NothingSeenIsNothingFound) {
    Scene s({});
    s.sightings->clear();
    add_point_view({}, 0.1, *s.sightings);
    EXPECT_EQ(s.search(2), 0);
    EXPECT_EQ(s.report.seen, 0);
    const std::vector<Vec3> coincident(60, Vec3{0.0, -30.0, 0.0});
    s.sightings->clear();
    add_point_view(coincident, 0.1, *s.sightings);
    EXPECT_EQ(s.search(2), 0);
}

}  // namespace
}  // namespace rig
