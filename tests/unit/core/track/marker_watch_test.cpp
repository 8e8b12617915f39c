#include "core/track/marker_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "core/track/tracker.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A face that talks, tracked from a cloud or from cameras; one marker may be made to misbehave.
struct Scene {
    explicit Scene(std::size_t camera_count = 0)
        : face({.camera_count = camera_count}), cameras(camera_count) {
        model = test::shape_model_of(face.pack());
    }
    void step(int frame, std::size_t marker, bool gone, const Vec3& slide_mm) {
        const Rigid pose = test::creeping_slip(frame / 60.0);
        std::vector<Vec3> points = face.positions(face.weights_at(frame / 60.0));
        points[marker] += slide_mm;
        points = test::moved(pose, points);
        if (gone) points[marker] = Vec3::Constant(cameras == 0 ? kNan : -1e4);
        sightings->clear();
        if (cameras == 0) {
            test::add_noise(points, 0.1, random);
            add_point_view(points, 0.1, *sightings);
        }
        for (std::size_t c = 0; c < cameras; ++c) {
            const auto view = face.observe(c, points, 0.1, 0.02, 1, random);
            add_camera_view(face.pack().cameras[c], view.observations, 0.15, 210.0, *sightings);
        }
        track(*model, config, *sightings, *state, *workspace, *named, *report);
    }
    // Markers in trouble but this one.
    int others(std::size_t marker) const {
        int count = 0;
        for (std::size_t k = 0; k < 60; ++k)
            count += k != marker && state->watch.trouble[k] != MarkerTrouble::kNone ? 1 : 0;
        return count;
    }

    test::SyntheticFace face;
    std::size_t cameras;
    std::unique_ptr<ShapeModel> model;
    TrackerConfig config;
    test::SeededRandom random{77};
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<TrackerState> state = std::make_unique<TrackerState>();
    std::unique_ptr<TrackerWorkspace> workspace = std::make_unique<TrackerWorkspace>();
    std::unique_ptr<NamedMarkers> named = std::make_unique<NamedMarkers>();
    std::unique_ptr<TrackerReport> report = std::make_unique<TrackerReport>();
};

// A unit vector along the surface.
Vec3 along_surface(const Scene& s, std::size_t marker) {
    return s.face.outward(marker).cross(Vec3{0.3, 1.0, 0.2}).normalized();
}

TEST(MarkerWatch, AMarkerThatCameOffIsFlaggedAfterFiveSecondsAndAHiddenOneIsNot) {
    for (const std::size_t marker : {3U, 17U, 31U, 44U}) {
        Scene s;
        for (int frame = 0; frame < 100 + 310; ++frame) {
            s.step(frame, marker, frame >= 100, Vec3::Zero());
            if (frame < 100 + 295) {
                EXPECT_EQ(s.report->fallen, 0) << marker << " at " << frame;
            }
        }
        EXPECT_EQ(s.state->watch.trouble[marker], MarkerTrouble::kFallen) << marker;
        EXPECT_EQ(s.others(marker), 0);
        // Put back on: believed after half a second, not before.
        for (int frame = 410; frame < 439; ++frame) {
            s.step(frame, marker, false, Vec3::Zero());
            EXPECT_FALSE(s.named->markers[marker].seen) << frame;
        }
        for (int frame = 439; frame < 442; ++frame) s.step(frame, marker, false, Vec3::Zero());
        EXPECT_TRUE(s.named->markers[marker].seen);
        EXPECT_EQ(s.report->fallen, 0);
    }
}

TEST(MarkerWatch, AMarkerHiddenForTwoSecondsIsNoTrouble) {
    Scene s;
    for (int frame = 0; frame < 400; ++frame) {
        s.step(frame, 17, frame >= 100 && frame < 220, Vec3::Zero());
        EXPECT_EQ(s.report->fallen + s.report->slid, 0) << frame;
    }
    EXPECT_TRUE(s.named->markers[17].seen);
}

class MarkerThatSlides : public testing::TestWithParam<int> {};

// By 3 mm, within so many frames; 1 is a knock, which takes the name away at first.
TEST_P(MarkerThatSlides, IsFlaggedWithItsWeightReducedAndTheOthersAreNot) {
    const int lasts = GetParam();
    for (const std::size_t marker : {5U, 17U, 28U, 44U}) {
        Scene s;
        const Vec3 slide = 3.0 * along_surface(s, marker);
        int flagged = -1;
        for (int frame = 0; frame < 1000; ++frame) {
            const double share = std::clamp((frame - 100) / static_cast<double>(lasts), 0.0, 1.0);
            s.step(frame, marker, false, share * slide);
            if (frame < 100) {
                EXPECT_EQ(s.report->slid, 0);
            }
            if (flagged < 0 && s.state->watch.trouble[marker] == MarkerTrouble::kSlid) flagged = frame;
        }
        std::printf("marker %zu, over %d frames: flagged after %d\n", marker, lasts, flagged - 100);
        EXPECT_GE(flagged, 0) << marker;
        EXPECT_EQ(s.others(marker), 0);
        ASSERT_TRUE(s.named->markers[marker].seen);
        EXPECT_NEAR(s.named->markers[marker].information(0, 0), 100.0 * kSlidTrust, 1e-6);
        // Pressed back: the flag goes.
        for (int frame = 1000; frame < 2000; ++frame) s.step(frame, marker, false, Vec3::Zero());
        EXPECT_EQ(s.report->slid, 0) << marker;
    }
}
INSTANTIATE_TEST_SUITE_P(Frames, MarkerThatSlides, testing::Values(1, 300));

TEST(MarkerWatch, TheNeutralExplainsAnOffset) {
    Scene s;
    const std::size_t marker = 17;
    const Vec3 slide = 2.2 * along_surface(s, marker);
    std::vector<Vec3> offsets(60, Vec3::Zero());
    for (int frame = 0; frame < 1200; ++frame) {
        if (frame == 600) {
            ASSERT_EQ(s.state->watch.trouble[marker], MarkerTrouble::kSlid);
            offsets[marker] = slide;
            s.config.neutral_offset_mm = offsets;
        }
        s.step(frame, marker, false, slide);
    }
    EXPECT_EQ(s.report->slid, 0);
}

class WatchedFromCameras : public testing::TestWithParam<std::size_t> {};

TEST_P(WatchedFromCameras, OnlyTheMarkerThatCameOffIsFlagged) {
    int tried = 0;
    for (std::size_t marker = 0; marker < 60 && tried < 2; marker += 3) {
        Scene s(GetParam());
        if (s.face.outward(marker)[2] < 0.9) continue;
        ++tried;
        for (int frame = 0; frame < 900; ++frame) {
            s.step(frame, marker, frame >= 200, Vec3::Zero());
            if (frame < 200) {
                EXPECT_EQ(s.report->fallen + s.report->slid, 0) << frame;
            }
        }
        EXPECT_EQ(s.others(marker), 0) << "turned away is not fallen";
        EXPECT_EQ(s.state->watch.trouble[marker], MarkerTrouble::kFallen) << marker;
    }
    EXPECT_EQ(tried, 2);
}
INSTANTIATE_TEST_SUITE_P(Cameras, WatchedFromCameras, testing::Values(std::size_t{1}, std::size_t{2}));

}  // namespace
}  // namespace rig
