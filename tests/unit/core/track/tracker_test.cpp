#include "core/track/tracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

const Vec3 kNowhere{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options = {}) : face(options) {
        model = test::shape_model_of(face.pack());
    }

    std::vector<Vec3> truth_at(double time_s) const {
        return test::moved(test::creeping_slip(time_s), face.positions(face.weights_at(time_s)));
    }

    void track_cloud(const std::vector<Vec3>& cloud) {
        sightings->clear();
        add_point_view(cloud, 0.1, *sightings);
        track(*model, config, *sightings, *state, *workspace, *named, *report);
    }
    void check(const std::vector<Vec3>& labelled) {
        check_names(*model, config, labelled, 0.1, *state, *workspace, *sightings, *named, *report);
    }

    test::SyntheticFace face;
    TrackerConfig config;
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<TrackerState> state = std::make_unique<TrackerState>();
    std::unique_ptr<TrackerWorkspace> workspace = std::make_unique<TrackerWorkspace>();
    std::unique_ptr<NamedMarkers> named = std::make_unique<NamedMarkers>();
    std::unique_ptr<TrackerReport> report = std::make_unique<TrackerReport>();
    test::SeededRandom random{91};
};

// A cloud whose entry i is marker[i], or a ghost when -1.
struct Cloud {
    std::vector<Vec3> points;
    std::vector<int> marker;
};

Cloud shuffled_cloud(const std::vector<Vec3>& truth, double drop, double ghosts_per_frame,
                     test::SeededRandom& random) {
    std::vector<std::pair<Vec3, int>> all;
    for (std::size_t k = 0; k < truth.size(); ++k) {
        if (!random.chance(drop)) all.emplace_back(truth[k], static_cast<int>(k));
    }
    for (double left = ghosts_per_frame; random.chance(left); left -= 1.0) {
        all.emplace_back(
            Vec3{random.uniform(-80.0, 80.0), random.uniform(-120.0, 60.0), random.uniform(-60.0, 30.0)}, -1);
    }
    random.shuffle(std::span<std::pair<Vec3, int>>(all));
    Cloud cloud;
    for (const auto& [point, k] : all) {
        cloud.points.push_back(point);
        cloud.marker.push_back(k);
    }
    test::add_noise(cloud.points, 0.1, random);
    return cloud;
}

struct Names {
    int right = 0;
    int wrong = 0;
    int missed = 0;
    int ghosts_named = 0;
};

void count_names(const Scene& s, const Cloud& cloud, Names& names) {
    std::vector<int> name_of(cloud.points.size(), -1);
    for (std::size_t k = 0; k < s.face.marker_count(); ++k) {
        const std::int16_t at = s.report->matches[0][k];
        if (at >= 0) name_of[s.sightings->source[0][static_cast<std::size_t>(at)]] = static_cast<int>(k);
    }
    for (std::size_t i = 0; i < name_of.size(); ++i) {
        if (cloud.marker[i] < 0) {
            names.ghosts_named += name_of[i] >= 0 ? 1 : 0;
        } else if (name_of[i] < 0) {
            ++names.missed;
        } else {
            (name_of[i] == cloud.marker[i] ? names.right : names.wrong) += 1;
        }
    }
}

TEST(Tracker, ShuffledCloudsWithGhostsAndDropoutsAreNamedWithoutAnError) {
    for (const std::size_t markers : {30U, 60U, 102U}) {
        test::SyntheticFaceOptions options;
        options.marker_count = markers;
        Scene s(options);
        Names names;
        int first_tracked = -1;
        for (int frame = 0; frame < 300; ++frame) {
            const Cloud cloud = shuffled_cloud(s.truth_at(frame / 60.0), 0.05, 0.6, s.random);
            s.track_cloud(cloud.points);
            if (s.report->tracking && first_tracked < 0) first_tracked = frame;
            if (s.report->tracking) count_names(s, cloud, names);
        }
        std::printf("%zu markers: right %d wrong %d missed %d ghosts named %d, first frame %d\n", markers,
                    names.right, names.wrong, names.missed, names.ghosts_named, first_tracked);
        EXPECT_GE(first_tracked, 0);
        EXPECT_LE(first_tracked, 9);
        EXPECT_EQ(names.wrong, 0);
        EXPECT_LE(names.missed, names.right / 500);
        EXPECT_LE(names.ghosts_named, names.right / 1000) << "a ghost within the gate of a hidden marker";
    }
}

// A labelled stream exchanges pairs of neighbours for 12 frames: within 5 frames every name is mended or
// withheld, and stays so.
TEST(Tracker, SwapsInALabelledStreamAreRepaired) {
    Scene s;
    struct Swap {
        int begin;
        int end;
        std::size_t a;
        std::size_t b;
    };
    std::vector<Swap> swaps;
    const std::vector<Vec3> rest = s.face.positions(std::vector<double>(s.face.shape_count(), 0.0));
    for (int i = 0; i < 12; ++i) {
        const std::size_t a = s.random.below(60);
        std::size_t b = a == 0 ? 1 : 0;
        for (std::size_t k = 0; k < 60; ++k) {
            if (k != a && (rest[k] - rest[a]).norm() < (rest[b] - rest[a]).norm()) b = k;
        }
        swaps.push_back({20 + 22 * i, 20 + 22 * i + 12, a, b});
    }
    int still_wrong = 0;
    int wrong_at_once = 0;
    int withheld = 0;
    for (int frame = 0; frame < 300; ++frame) {
        const std::vector<Vec3> truth = s.truth_at(frame / 60.0);
        std::vector<Vec3> labelled = truth;
        test::add_noise(labelled, 0.1, s.random);
        for (const Swap& swap : swaps) {
            if (frame >= swap.begin && frame < swap.end) std::swap(labelled[swap.a], labelled[swap.b]);
        }
        s.check(labelled);
        for (std::size_t k = 0; k < 60; ++k) {
            if (!s.named->markers[k].seen) {
                ++withheld;
                continue;
            }
            if ((s.named->markers[k].position_mm - truth[k]).norm() < 1.0) continue;
            ++wrong_at_once;
            for (const Swap& swap : swaps) {
                if ((k == swap.a || k == swap.b) && frame >= swap.begin + 5) ++still_wrong;
            }
        }
    }
    std::printf("swaps: %d wrong names at once, %d after 5 frames, %d withheld\n", wrong_at_once, still_wrong,
                withheld);
    EXPECT_EQ(still_wrong, 0);
    EXPECT_EQ(wrong_at_once, 0);
    EXPECT_LE(withheld, 30);
}

TEST(Tracker, ASwapInTheFirstFrameDoesNotSettle) {
    Scene s;
    for (int frame = 0; frame < 10; ++frame) {
        std::vector<Vec3> labelled = s.truth_at(frame / 60.0);
        const std::vector<Vec3> truth = labelled;
        std::swap(labelled[3], labelled[41]);
        s.check(labelled);
        for (const std::size_t k : {std::size_t{3}, std::size_t{41}}) {
            if (frame < 5 || !s.named->markers[k].seen) continue;
            EXPECT_LT((s.named->markers[k].position_mm - truth[k]).norm(), 1.0) << "frame " << frame;
        }
    }
}

// Two neighbours pass each other at 3 mm, which the face's own shape (moved by helmet and expression) does
// not do: each goes on along its way.
TEST(Tracker, MarkersThatCrossCloselyKeepTheirNames) {
    Scene s;
    const std::vector<Vec3> rest = s.face.positions(std::vector<double>(s.face.shape_count(), 0.1));
    std::size_t a = 0;
    std::size_t b = 1;
    for (std::size_t i = 0; i < 60; ++i) {
        for (std::size_t j = i + 1; j < 60; ++j) {
            if ((rest[i] - rest[j]).norm() < (rest[a] - rest[b]).norm()) {
                a = i;
                b = j;
            }
        }
    }
    const double apart = (rest[a] - rest[b]).norm();
    for (int frame = 0; frame < 120; ++frame) {
        std::vector<Vec3> truth = rest;
        // They close in to 3 mm and part again within a second.
        const double share =
            0.5 * (1.0 - 3.0 / apart) * (frame < 60 ? std::sin(frame * 3.14159 / 60.0) : 0.0);
        const Vec3 between = rest[b] - rest[a];
        truth[a] += share * 0.4 * between;
        truth[b] -= share * 0.4 * between;
        const Cloud cloud = shuffled_cloud(truth, 0.0, 0.0, s.random);
        s.track_cloud(cloud.points);
        Names names;
        count_names(s, cloud, names);
        EXPECT_EQ(s.report->tracking ? names.wrong : 0, 0) << "frame " << frame;
    }
}

// Pressed lips: two neighbours become one sighting between them for 12 frames, then part. Whichever of them
// had the sighting, neither has the other's name afterwards.
TEST(Tracker, MarkersThatMergeKeepTheirNames) {
    for (std::size_t a = 0; a < 60; a += 7) {
        Scene s;
        const std::vector<Vec3> rest = s.face.positions(std::vector<double>(s.face.shape_count(), 0.1));
        std::size_t b = a == 0 ? 1 : 0;
        for (std::size_t k = 0; k < 60; ++k) {
            if (k != a && (rest[k] - rest[a]).norm() < (rest[b] - rest[a]).norm()) b = k;
        }
        int wrong_afterwards = 0;
        int right_at_rest = 0;
        for (int frame = 0; frame < 60; ++frame) {
            const bool merged = frame >= 20 && frame < 32;
            std::vector<Vec3> truth = rest;
            const double share = frame < 52 ? std::max(0.0, 1.0 - std::abs(frame - 26) / 26.0) : 0.0;
            const Vec3 between = truth[b] - truth[a];
            truth[a] += 0.35 * share * between;
            truth[b] -= 0.35 * share * between;
            std::vector<Vec3> points = truth;
            if (merged) {
                points[a] = 0.5 * (truth[a] + truth[b]);
                points[b] = kNowhere;
            }
            test::add_noise(points, 0.1, s.random);
            s.track_cloud(points);
            if (frame < 32 || !s.report->tracking) continue;
            for (const std::size_t k : {a, b}) {
                const std::int16_t at = s.report->matches[0][k];
                if (at < 0) continue;
                const bool right = s.sightings->source[0][static_cast<std::size_t>(at)] == k;
                if (!right) ++wrong_afterwards;
                if (right && frame >= 52) ++right_at_rest;
            }
        }
        EXPECT_EQ(wrong_afterwards, 0) << a << " and " << b;
        // So close a pair is no face; a name may be withheld until it is one again.
        EXPECT_EQ(right_at_rest, 2 * 8) << a << " and " << b;
    }
}

TEST(Tracker, AllMarkersLostAndBackAreFoundWithinTenFrames) {
    Scene s;
    int frame = 0;
    const auto run = [&](int frames, bool visible) {
        for (const int end = frame + frames; frame < end; ++frame) {
            s.track_cloud(visible ? shuffled_cloud(s.truth_at(frame / 60.0), 0.03, 0.5, s.random).points
                                  : std::vector<Vec3>{});
        }
    };
    run(60, true);
    ASSERT_TRUE(s.report->tracking);
    for (const int gap : {4, 20, 90}) {
        run(gap, false);
        EXPECT_FALSE(s.report->tracking);
        EXPECT_EQ(s.report->seen, 0);
        int waited = 0;
        while (!s.report->tracking && waited < 30) {
            run(1, true);
            ++waited;
        }
        EXPECT_LE(waited, 10) << "after " << gap << " dark frames";
        Names names;
        const Cloud cloud = shuffled_cloud(s.truth_at(frame / 60.0), 0.0, 0.0, s.random);
        s.track_cloud(cloud.points);
        count_names(s, cloud, names);
        EXPECT_EQ(names.wrong, 0);
        EXPECT_GE(names.right, 58);
    }
}

TEST(Tracker, ShortLossKeepsTheNames) {
    Scene s;
    for (int frame = 0; frame < 20; ++frame)
        s.track_cloud(shuffled_cloud(s.truth_at(frame / 60.0), 0.0, 0.0, s.random).points);
    for (int frame = 20; frame < 22; ++frame) s.track_cloud({});
    EXPECT_TRUE(s.report->tracking) << "two dark frames are not a loss";
    const Cloud cloud = shuffled_cloud(s.truth_at(22 / 60.0), 0.0, 0.0, s.random);
    s.track_cloud(cloud.points);
    EXPECT_FALSE(s.report->bootstrapped);
    Names names;
    count_names(s, cloud, names);
    EXPECT_EQ(names.wrong, 0);
    EXPECT_EQ(names.missed, 0);
}

TEST(Tracker, DarkFramesSpendNoSecondOpinion) {
    Scene s;
    for (int frame = 0; frame < 6; ++frame)
        s.track_cloud(shuffled_cloud(s.truth_at(frame / 60.0), 0.0, 0.0, s.random).points);
    const std::uint8_t left = s.state->opinion.left;
    ASSERT_GT(left, 2);
    ASSERT_LT(left, kOpinions);
    for (int frame = 6; frame < 8; ++frame) {
        std::vector<Vec3> few = s.truth_at(frame / 60.0);
        few.resize(frame == 6 ? 0 : 5);
        s.track_cloud(few);
    }
    ASSERT_TRUE(s.report->tracking);
    EXPECT_EQ(s.state->opinion.left, left);
    s.track_cloud(s.truth_at(8 / 60.0));
    EXPECT_EQ(s.state->opinion.left, left - 1);
}

// A dot that stands 5 mm beside the place of a marker that came off, and two namings that are equally good
// then.
TEST(Tracker, NamingsThatTakeTurnsBesideAGhostComeToRest) {
    for (const std::size_t marker : {0U, 24U, 48U}) {
        Scene s;
        Vec3 ghost = Vec3::Zero();
        int reconsidered = 0;
        for (int frame = 0; frame < 900; ++frame) {
            const double time_s = frame / 60.0;
            std::vector<Vec3> points =
                test::moved(test::creeping_slip(time_s), s.face.positions(s.face.weights_at(time_s)));
            if (frame == 100)
                ghost = points[marker] + 5.0 * s.face.outward(marker).cross(Vec3{0.3, 1.0, 0.2}).normalized();
            if (frame >= 100) points[marker] = ghost;
            test::add_noise(points, 0.1, s.random);
            s.track_cloud(points);
            reconsidered += frame >= 120 && s.report->reconsidered > 0 ? 1 : 0;
        }
        EXPECT_LE(reconsidered, 40) << marker;
    }
}

class TrackerFromCameras : public testing::TestWithParam<std::size_t> {};

TEST_P(TrackerFromCameras, NamesStayRightOverThreeHundredFrames) {
    test::SyntheticFaceOptions options;
    options.camera_count = GetParam();
    Scene s(options);
    int named_right = 0;
    int named_wrong = 0;
    int wrong_run = 0;
    int longest_wrong = 0;
    int tracked = 0;
    double sum2 = 0.0;
    int measured = 0;
    int far_off = 0;
    for (int frame = 0; frame < 300; ++frame) {
        const std::vector<Vec3> truth = s.truth_at(frame / 60.0);
        s.sightings->clear();
        std::vector<test::SyntheticFace::View> views;
        for (std::size_t c = 0; c < GetParam(); ++c) {
            views.push_back(s.face.observe(c, truth, 0.1, 0.03, 2, s.random));
            add_camera_view(s.face.pack().cameras[c], views.back().observations, 0.15, 210.0, *s.sightings);
        }
        track(*s.model, s.config, *s.sightings, *s.state, *s.workspace, *s.named, *s.report);
        if (!s.report->tracking) continue;
        ++tracked;
        const int wrong_before = named_wrong;
        for (std::size_t c = 0; c < GetParam(); ++c) {
            for (std::size_t k = 0; k < 60; ++k) {
                const std::int16_t at = s.report->matches[c][k];
                if (at < 0) continue;
                const int is = views[c].marker[s.sightings->source[c][static_cast<std::size_t>(at)]];
                if (is == static_cast<int>(k)) ++named_right;
                if (is >= 0 && is != static_cast<int>(k)) ++named_wrong;
            }
        }
        wrong_run = named_wrong > wrong_before ? wrong_run + 1 : 0;
        longest_wrong = std::max(longest_wrong, wrong_run);
        for (std::size_t k = 0; k < 60; ++k) {
            if (s.named->markers[k].views < 2) continue;
            const double error_mm = (s.named->markers[k].position_mm - truth[k]).norm();
            sum2 += error_mm * error_mm / 3.0;
            ++measured;
            if (error_mm > 1.5) ++far_off;
        }
    }
    const double rms_mm = measured == 0 ? 0.0 : std::sqrt(sum2 / measured);
    std::printf(
        "%zu cameras: tracked %d of 300, right %d, wrong %d for at most %d frames; 3D rms %.3f mm, %d of %d "
        "off\n",
        GetParam(), tracked, named_right, named_wrong, longest_wrong, rms_mm, far_off, measured);
    EXPECT_GE(tracked, 290);
    // At the rim a marker that is turned away may be seen in its neighbour's dot: for moments, never for
    // good.
    EXPECT_LE(named_wrong, named_right / 2000);
    EXPECT_LE(longest_wrong, 5);
    EXPECT_LT(rms_mm, 0.2);
    EXPECT_LE(far_off, measured / 500) << "a false dot in the place of a hidden view";
    EXPECT_GT(named_right, tracked * 30 * static_cast<int>(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Cameras, TrackerFromCameras,
                         testing::Values(std::size_t{1}, std::size_t{2}, std::size_t{4}));

TEST(Tracker, NamedMarkersOfALabelledStreamAreFullyKnown) {
    Scene s;
    std::vector<Vec3> labelled = s.truth_at(0.0);
    labelled[7] = kNowhere;
    s.check(labelled);
    EXPECT_EQ(s.report->seen, 59);
    EXPECT_FALSE(s.named->markers[7].seen);
    EXPECT_EQ(s.named->markers[7].information.norm(), 0.0);
    for (std::size_t k = 0; k < 60; ++k) {
        if (k == 7) continue;
        ASSERT_TRUE(s.named->markers[k].seen) << k;
        EXPECT_EQ(s.named->markers[k].views, 0);
        EXPECT_LT((s.named->markers[k].information / 100.0 - Mat3::Identity()).norm(), 1e-12);
        EXPECT_LT((s.named->markers[k].position_mm - labelled[k]).norm(), 0.02);
    }
}

}  // namespace
}  // namespace rig
