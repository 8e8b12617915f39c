#include "core/track/topology.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(std::size_t markers) : face({.marker_count = markers}) {
        model = test::shape_model_of(face.pack());
        build_topology(*model, *topology);
    }
    std::uint16_t broken(const std::vector<Vec3>& positions, const Mat3& headset_from_face) {
        for (std::size_t k = 0; k < positions.size(); ++k) {
            named->markers[k] = NamedMarker{};
            named->markers[k].seen = true;
            named->markers[k].position_mm = positions[k];
        }
        return find_broken_order(*topology, headset_from_face, *named, flags);
    }

    test::SyntheticFace face;
    std::unique_ptr<ShapeModel> model;
    std::unique_ptr<Topology> topology = std::make_unique<Topology>();
    std::unique_ptr<NamedMarkers> named = std::make_unique<NamedMarkers>();
    std::array<bool, kMaxMarkers> flags{};
};

TEST(Topology, NearestAreTheNearestOfTheMeanFace) {
    const Scene s(60);
    for (std::size_t k = 0; k < 60; ++k) {
        const auto& nearest = s.topology->nearest[k];
        const double farthest = (s.model->mean_mm[nearest.back()] - s.model->mean_mm[k]).norm();
        std::size_t nearer = 0;
        for (std::size_t other = 0; other < 60; ++other)
            nearer +=
                other != k && (s.model->mean_mm[other] - s.model->mean_mm[k]).norm() < farthest ? 1U : 0U;
        EXPECT_EQ(nearer, kNeighbours - 1) << k;
    }
}

TEST(Topology, NormalsPointOutOfTheFace) {
    const Scene s(60);
    for (std::size_t k = 0; k < 60; ++k) {
        EXPECT_NEAR(s.topology->normal[k].norm(), 1.0, 1e-12);
        EXPECT_GT(s.topology->normal[k].dot(s.face.outward(k)), 0.8) << k;
    }
}

TEST(Topology, ExpressionsAndSlipsBreakNoOrder) {
    for (const std::size_t markers : {30U, 60U, 102U}) {
        Scene s(markers);
        ASSERT_GE(s.topology->pairs.size(), markers / 2);
        test::SeededRandom random(3);
        for (int i = 0; i < 500; ++i) {
            const Rigid pose = test::random_slip(random, 0.3, 10.0);
            const std::vector<Vec3> positions =
                test::moved(pose, s.face.positions(s.face.weights_at(random.uniform(0.0, 1000.0))));
            EXPECT_EQ(s.broken(positions, pose.rotation), 0) << markers;
        }
    }
}

TEST(Topology, EveryExchangeOfNeighboursBreaksIt) {
    Scene s(60);
    test::SeededRandom random(4);
    const Rigid pose = test::random_slip(random, 0.2, 10.0);
    for (const NeighbourPair& pair : s.topology->pairs) {
        std::vector<Vec3> positions = test::moved(pose, s.face.positions(s.face.weights_at(3.0)));
        std::swap(positions[pair.first], positions[pair.second]);
        EXPECT_GE(s.broken(positions, pose.rotation), 1) << pair.first << " " << pair.second;
        EXPECT_TRUE(s.flags[pair.first] && s.flags[pair.second]);
    }
}

TEST(Topology, UnseenMarkersHaveNoOrder) {
    Scene s(60);
    std::vector<Vec3> positions = s.face.positions(s.face.weights_at(3.0));
    const NeighbourPair pair = s.topology->pairs[0];
    std::swap(positions[pair.first], positions[pair.second]);
    ASSERT_GE(s.broken(positions, Mat3::Identity()), 1);
    s.named->markers[pair.first].seen = false;
    s.named->markers[pair.second].seen = false;
    EXPECT_EQ(find_broken_order(*s.topology, Mat3::Identity(), *s.named, s.flags), 0);
}

TEST(Topology, FewMarkersHaveNoNeighbours) {
    auto model = std::make_unique<ShapeModel>();
    model->marker_count = kNeighbours;
    auto topology = std::make_unique<Topology>();
    build_topology(*model, *topology);
    EXPECT_TRUE(topology->pairs.empty());
}

}  // namespace
}  // namespace rig
