#include "core/track/helmet_marks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

// Dots on the brim and the arms, at the rim of the picture.
std::vector<HelmetMark> brim() {
    return {{Vec3{-62.0, 52.0, 20.0}, 3},
            {Vec3{0.0, 60.0, 30.0}, 3},
            {Vec3{62.0, 52.0, 20.0}, 3},
            {Vec3{-60.0, -95.0, 10.0}, 1},
            {Vec3{60.0, -95.0, 10.0}, 3}};
}

struct Look {
    std::vector<Observation> observations;
    std::vector<int> mark;  // -1: a marker of the face
};

class Helmet {
  public:
    Helmet() : face_({.camera_count = 2}) { truth_ = face_.positions(face_.weights_at(0.4)); }

    // What camera 0 sees when it sits like `now`.
    Look look(const CameraModel& now, double sigma_px, double hide_marks) {
        Look look;
        const auto add = [&](const Vec3& at, int mark) {
            const test::ReferencePixel p = test::reference_project(now, at);
            look.observations.push_back(
                {static_cast<float>(static_cast<double>(p.x_px) + random_.normal(0.0, sigma_px)),
                 static_cast<float>(static_cast<double>(p.y_px) + random_.normal(0.0, sigma_px)), 8.0F, 0.5F,
                 0.9F});
            look.mark.push_back(mark);
        };
        for (const Vec3& at : truth_) add(at, -1);
        for (std::size_t i = 0; i < brim().size(); ++i) {
            if (!random_.chance(hide_marks)) add(brim()[i].headset_mm, static_cast<int>(i));
        }
        return look;
    }
    [[nodiscard]] CameraModel camera() const { return face_.pack().cameras[0]; }
    void find(const Look& look, std::size_t index = 0) {
        find_helmet_marks(camera(), index, brim(), look.observations, {}, state, output);
    }

    MountDriftState state;
    HelmetMarkOutput output;

  private:
    test::SyntheticFace face_;
    std::vector<Vec3> truth_;
    test::SeededRandom random_{808};
};

// Found marks are the right dots, and what is taken from the face is exactly those.
void expect_right(const Look& look, const HelmetMarkOutput& output, std::size_t marks_there) {
    ASSERT_EQ(output.taken.size(), marks_there);
    for (const std::uint16_t at : output.taken) EXPECT_GE(look.mark[at], 0);
    for (std::size_t i = 0; i < brim().size(); ++i) {
        if (output.found[i] < 0) continue;
        EXPECT_EQ(look.mark[static_cast<std::size_t>(output.found[i])], static_cast<int>(i));
    }
}

TEST(HelmetMarks, AreFoundAndTakenFromTheFace) {
    Helmet helmet;
    for (int i = 0; i < 200; ++i) {
        const Look look = helmet.look(helmet.camera(), 0.1, 0.0);
        helmet.find(look);
        expect_right(look, helmet.output, 5);
        EXPECT_TRUE(helmet.output.drift.measured);
        EXPECT_FALSE(helmet.output.drift.drifted);
    }
    EXPECT_LT(helmet.output.drift.shift_px, 0.1);
}

TEST(HelmetMarks, AreFoundAfterAKnockOfADegreeInAnyDirectionAndTheDriftIsThat) {
    test::SeededRandom random(809);
    for (int trial = 0; trial < 100; ++trial) {
        Helmet helmet;
        for (int i = 0; i < 10; ++i) helmet.find(helmet.look(helmet.camera(), 0.1, 0.0));
        Vec3 turn{random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0)};
        turn *= 0.01745 / turn.norm();
        const CameraModel knocked = turned_camera(helmet.camera(), turn);
        int raised = -1;
        for (int i = 0; i < 60; ++i) {
            const Look look = helmet.look(knocked, 0.1, 0.0);
            helmet.find(look);
            if (i >= 1) expect_right(look, helmet.output, 5);
            if (helmet.output.drift.drifted && raised < 0) raised = i;
        }
        EXPECT_LT((helmet.output.drift.turn_rad - turn).norm(), 1e-3) << trial;
        EXPECT_LE((helmet.output.now.camera_from_headset - knocked.camera_from_headset).norm(), 2e-3);
        // A turn about the optical axis moves no point in the middle: the flag is about those that do.
        const double across = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1]);
        if (across > 0.003) {
            EXPECT_EQ(raised, 29) << "half a second, then the flag";
        }
    }
}

TEST(HelmetMarks, HiddenMarksTakeNothingFromTheFace) {
    Helmet helmet;
    for (int i = 0; i < 10; ++i) helmet.find(helmet.look(helmet.camera(), 0.1, 0.0));
    int hidden = 0;
    for (int i = 0; i < 300; ++i) {
        const Look look = helmet.look(helmet.camera(), 0.1, 0.4);
        helmet.find(look);
        for (const std::uint16_t at : helmet.output.taken) EXPECT_GE(look.mark[at], 0) << i;
        hidden += 5 - static_cast<int>(helmet.output.taken.size());
        EXPECT_LT(helmet.output.drift.shift_px, 0.3);
    }
    EXPECT_GT(hidden, 400);
}

TEST(HelmetMarks, OfOtherCamerasAreNotLookedFor) {
    Helmet helmet;
    const Look look = helmet.look(helmet.camera(), 0.0, 0.0);
    helmet.find(look, 1);
    EXPECT_EQ(helmet.output.found[3], -1) << "camera 1 cannot see it";
    EXPECT_EQ(helmet.output.taken.size(), 4U);
    helmet.state = {};
    helmet.find(look, 2);
    EXPECT_TRUE(helmet.output.taken.empty());
    EXPECT_FALSE(helmet.output.drift.measured);
}

TEST(HelmetMarks, WithoutMarksTheCameraIsTheCalibratedOne) {
    Helmet helmet;
    const Look look = helmet.look(helmet.camera(), 0.1, 0.0);
    find_helmet_marks(helmet.camera(), 0, {}, look.observations, {}, helmet.state, helmet.output);
    EXPECT_TRUE(helmet.output.taken.empty());
    EXPECT_EQ(helmet.output.now.camera_from_headset, helmet.camera().camera_from_headset);
    EXPECT_FALSE(helmet.state.started);
}

TEST(HelmetMarks, AnyNumbersAreSafeAndAnswerTheSameTwice) {
    test::SeededRandom random(810);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    for (int trial = 0; trial < 100; ++trial) {
        Helmet a;
        Helmet b;
        Look look;
        for (int i = 0; i < 256; ++i) {
            look.observations.push_back({static_cast<float>(random.uniform(0.0, 640.0)),
                                         static_cast<float>(random.uniform(0.0, 480.0)), 8.0F, 0.5F, 0.9F});
            if (random.chance(0.1)) look.observations.back().x_px = random.chance(0.5) ? nan : inf;
        }
        a.find(look);
        b.find(look);
        EXPECT_EQ(a.output.found, b.output.found);
        EXPECT_EQ(a.output.drift.turn_rad, b.output.drift.turn_rad);
        for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(a.output.drift.turn_rad[i]));
        for (std::size_t i = 1; i < a.output.taken.size(); ++i)
            EXPECT_LT(a.output.taken[i - 1], a.output.taken[i]);
    }
}

}  // namespace
}  // namespace rig
