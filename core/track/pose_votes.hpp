// Where the face may be, from unnamed sightings alone: for every rotation of a grid each pair of marker and
// sighting votes for the translation that would bring them together (generalised Hough transform, Ballard
// 1981). Wrong pairs scatter, right ones agree. Not for: names; bootstrap.hpp gives them.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/geometry/shape_model.hpp"
#include "core/track/sightings.hpp"

namespace rig {

struct PoseVotesConfig {
    double rotation_range_rad = 0.0;  // about any axis through the rig's origin
    double rotation_step_rad = 0.0;
    double translation_range_mm = 0.0;  // along each axis
};

struct PoseCandidate {
    Rigid pose;  // headset_from_face
    std::uint32_t votes = 0;
};

inline constexpr std::size_t kPoseCandidates = 16;

struct PoseVotesWorkspace {
    static constexpr std::size_t kCells = 24;  // along an axis of the votes
    std::array<std::uint16_t, kCells * kCells * kCells> votes{};
    std::array<std::uint16_t, kCells * kCells * kCells> summed{};
    std::array<Vec3, kMaxMarkers> turned_mm{};
};

// The poses with the most votes, most first: the best of each rotation (and, for cameras, of each of three
// depths), turned from `nominal`. The face is the model's mean.
void vote_for_poses(const ShapeModel& model, const PoseVotesConfig& config, const Rigid& nominal,
                    const SightingSet& sightings, PoseVotesWorkspace& workspace,
                    BoundedVector<PoseCandidate, kPoseCandidates>& candidates);

}  // namespace rig
