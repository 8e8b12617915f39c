#include "core/track/topology.hpp"

#include <algorithm>
#include <cmath>

namespace rig {

namespace {

constexpr double kCertainSigmas = 4.0;
constexpr double kHeadCentreMm = 80.0;  // behind the middle of the face: normals point away from it
constexpr double kLeastApartMm = 1.0;   // nearer markers are one dot to a camera

void find_nearest(const ShapeModel& model, Topology& topology) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        std::array<double, kNeighbours> best;
        best.fill(1e300);
        auto& nearest = topology.nearest[k];
        for (std::size_t other = 0; other < model.marker_count; ++other) {
            if (other == k) continue;
            const Vec3 apart = model.mean_mm[other] - model.mean_mm[k];
            const double d2 = apart.squaredNorm();
            if (!(d2 < best.back())) continue;
            std::size_t at = kNeighbours - 1;
            for (; at > 0 && d2 < best[at - 1]; --at) {
                best[at] = best[at - 1];
                nearest[at] = nearest[at - 1];
            }
            best[at] = d2;
            nearest[at] = static_cast<std::uint16_t>(other);
        }
    }
}

Vec3 normal_at(const ShapeModel& model, const Topology& topology, std::size_t k, const Vec3& inside_mm) {
    const Vec3 out = model.mean_mm[k] - inside_mm;
    Vec3 normal = Vec3::Zero();
    for (std::size_t a = 0; a < kNeighbours; ++a) {
        for (std::size_t b = a + 1; b < kNeighbours; ++b) {
            const Vec3 first = model.mean_mm[topology.nearest[k][a]] - model.mean_mm[k];
            const Vec3 second = model.mean_mm[topology.nearest[k][b]] - model.mean_mm[k];
            const Vec3 across = first.cross(second);
            normal += across.dot(out) < 0.0 ? Vec3{-across} : across;
        }
    }
    const double length = std::sqrt(normal.dot(normal));
    return length > 1e-9 ? Vec3{normal / length} : Vec3{Vec3::Zero()};
}

void find_normals(const ShapeModel& model, Topology& topology) {
    Vec3 inside = Vec3::Zero();
    for (std::size_t k = 0; k < model.marker_count; ++k) inside += model.mean_mm[k];
    inside /= static_cast<double>(model.marker_count);
    inside[2] -= kHeadCentreMm;
    for (std::size_t k = 0; k < model.marker_count; ++k)
        topology.normal[k] = normal_at(model, topology, k, inside);
}

bool is_nearest(const Topology& topology, std::size_t of, std::size_t marker) {
    const auto& nearest = topology.nearest[of];
    return std::find(nearest.begin(), nearest.end(), marker) != nearest.end();
}

// Standard deviation of the second's place relative to the first's along a line.
double sigma_along(const ShapeModel& model, std::size_t first, std::size_t second, const Vec3& along) {
    double variance = 0.0;
    for (std::size_t j = 0; j < model.mode_count; ++j) {
        const double moved = along.dot(model.modes[second * model.mode_count + j]) -
                             along.dot(model.modes[first * model.mode_count + j]);
        variance += moved * moved;
    }
    return std::sqrt(variance);
}

}  // namespace

void build_topology(const ShapeModel& model, Topology& topology) {
    topology.pairs.clear();
    if (model.marker_count <= kNeighbours) return;
    find_nearest(model, topology);
    find_normals(model, topology);
    for (std::size_t a = 0; a < model.marker_count; ++a) {
        for (std::size_t b = a + 1; b < model.marker_count; ++b) {
            if (!is_nearest(topology, a, b) && !is_nearest(topology, b, a)) continue;
            const Vec3 apart = model.mean_mm[b] - model.mean_mm[a];
            const double apart_mm = std::sqrt(apart.dot(apart));
            if (apart_mm < kLeastApartMm) continue;
            const Vec3 along = apart / apart_mm;
            if (apart_mm < kCertainSigmas * sigma_along(model, a, b, along)) continue;
            const bool kept = topology.pairs.push_back(
                {static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), along});
            RIG_CHECK(kept);
        }
    }
}

std::uint16_t find_broken_order(const Topology& topology, const Mat3& headset_from_face,
                                const NamedMarkers& named, std::array<bool, kMaxMarkers>& broken) {
    broken.fill(false);
    std::uint16_t count = 0;
    for (const NeighbourPair& pair : topology.pairs) {
        const NamedMarker& first = named.markers[pair.first];
        const NamedMarker& second = named.markers[pair.second];
        if (!first.seen || !second.seen) continue;
        const Vec3 along = headset_from_face * pair.along;
        if (along.dot(second.position_mm - first.position_mm) > 0.0) continue;
        broken[pair.first] = true;
        broken[pair.second] = true;
        ++count;
    }
    return count;
}

}  // namespace rig
