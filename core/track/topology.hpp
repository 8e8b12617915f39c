// The order of neighbours on the face: of two markers side by side on the layout one stays left of, or above,
// the other whatever the face does, as far as the shape model says so. Names that contradict it are wrong,
// however well the face can be bent to them. Not for: names that all moved on by one place, which keep the
// order; second_opinion.hpp finds those by what they leave over.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/geometry/shape_model.hpp"
#include "core/track/named_markers.hpp"

namespace rig {

inline constexpr std::size_t kNeighbours = 4;  // of a marker: the nearest on the mean face

struct NeighbourPair {
    std::uint16_t first = 0;  // < second
    std::uint16_t second = 0;
    Vec3 along = Vec3::Zero();  // from first to second on the mean face; unit vector, face frame
};

// Pairs whose order is certain: their distance along `along` is kCertainSigmas of its standard deviation from
// nothing. kMaxMarkers * kNeighbours of them at most.
struct Topology {
    BoundedVector<NeighbourPair, kMaxMarkers * kNeighbours> pairs;
    // Of each marker, nearest first.
    std::array<std::array<std::uint16_t, kNeighbours>, kMaxMarkers> nearest{};
    // Of the surface through a marker and its nearest, outwards; unit, face frame; zero when they lie on a
    // line.
    std::array<Vec3, kMaxMarkers> normal{};
};

// Precondition: more than kNeighbours markers, else no pairs.
void build_topology(const ShapeModel& model, Topology& topology);

// broken[k]: marker k and a neighbour of it, both seen, have changed places along their line.
// headset_from_face: a rotation. Returns how many pairs have.
std::uint16_t find_broken_order(const Topology& topology, const Mat3& headset_from_face,
                                const NamedMarkers& named, std::array<bool, kMaxMarkers>& broken);

}  // namespace rig
