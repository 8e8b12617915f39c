#include "core/track/pose_votes.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

using Candidates = BoundedVector<PoseCandidate, kPoseCandidates>;

constexpr double kTwentyFiveDegrees = 0.436;

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options) : face(options) {
        model = test::shape_model_of(face.pack());
    }
    void vote(double range_rad) {
        vote_for_poses(*model, {range_rad, 0.5 * range_rad, 20.0}, Rigid{}, *sightings, *workspace,
                       candidates);
    }
    // Whether one of the candidates is near enough for nearest sightings to draw it the rest of the way.
    bool near(const Rigid& pose) const {
        const Vec3 middle{0.0, -30.0, 50.0};
        for (const PoseCandidate& candidate : candidates) {
            const Mat3 turn = candidate.pose.rotation * pose.rotation.transpose();
            const Vec3 off = candidate.pose.apply(middle) - pose.apply(middle);
            if (vector_from_rotation(turn).norm() < 0.22 && off.norm() < 12.0) return true;
        }
        return false;
    }

    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<SightingSet> sightings = std::make_unique<SightingSet>();
    std::unique_ptr<PoseVotesWorkspace> workspace = std::make_unique<PoseVotesWorkspace>();
    Candidates candidates;
};

TEST(PoseVotes, FindThePoseOfACloud) {
    Scene s({});
    test::SeededRandom random(61);
    for (int i = 0; i < 40; ++i) {
        const Rigid pose = test::random_slip(random, 0.25, 15.0);
        std::vector<Vec3> cloud =
            test::moved(pose, s.face.positions(s.face.weights_at(random.uniform(0.0, 100.0))));
        cloud.resize(cloud.size() - random.below(20));  // a hidden part does not move the rest
        random.shuffle(std::span<Vec3>(cloud));
        s.sightings->clear();
        add_point_view(cloud, 0.1, *s.sightings);
        s.vote(kTwentyFiveDegrees);
        EXPECT_TRUE(s.near(pose)) << "start " << i;
        for (std::size_t c = 1; c < s.candidates.size(); ++c)
            EXPECT_GE(s.candidates[c - 1].votes, s.candidates[c].votes);
    }
}

TEST(PoseVotes, OfNothingAreNone) {
    Scene s({});
    s.sightings->clear();
    add_point_view({}, 0.1, *s.sightings);
    s.vote(kTwentyFiveDegrees);
    for (const PoseCandidate& candidate : s.candidates) EXPECT_EQ(candidate.votes, 0U);
    s.sightings->clear();
    s.vote(kTwentyFiveDegrees);
    for (const PoseCandidate& candidate : s.candidates) EXPECT_EQ(candidate.votes, 0U);
}

// Every marker and every sighting of four cameras in one place: 131,072 votes for one cell.
TEST(PoseVotes, MoreVotesThanTheCellsHoldDoNotWrap) {
    auto model = std::make_unique<ShapeModel>();
    model->marker_count = kMaxMarkers;
    auto sightings = std::make_unique<SightingSet>();
    sightings->from_cameras = true;
    sightings->view_count = kMaxCameras;
    for (ViewSightings& view : sightings->views) {
        for (std::size_t i = 0; i < kMaxSightings; ++i)
            ASSERT_TRUE(view.push_back(Sighting{Vec3{0.0, 0.0, 200.0}, Vec3{0.0, 0.0, -1.0}, 1.0}));
    }
    PoseVotesConfig config;
    config.rotation_step_rad = 0.1;
    config.translation_range_mm = 20.0;
    auto workspace = std::make_unique<PoseVotesWorkspace>();
    BoundedVector<PoseCandidate, kPoseCandidates> candidates;
    vote_for_poses(*model, config, {}, *sightings, *workspace, candidates);
    ASSERT_FALSE(candidates.empty());
    EXPECT_EQ(candidates[0].votes, 65535U);
    // All 9 sums that hold the cell are full: the answer is a cell of 4 mm off along each axis.
    EXPECT_LT(candidates[0].pose.translation_mm.head<2>().norm(), 4.0 * 1.415);
}

}  // namespace
}  // namespace rig
