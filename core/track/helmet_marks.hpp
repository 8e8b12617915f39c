// Finds the dots that are fixed to the helmet among one camera's observations, so that they tell how the
// camera sits and are not taken for markers of the face.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/bounded_vector.hpp"
#include "core/detect/observation.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/limits.hpp"

namespace rig {

struct HelmetMarkConfig {
    MountDriftConfig drift;
    double reach_px = 40.0;   // how far a knock may have moved the picture: 3 to 4 degrees
    double settled_px = 3.0;  // from where the fitted camera sees a mark; beyond it the dot is another
};

struct HelmetMarkOutput {
    // found[i]: the observation that is mark i of the pack, or -1
    std::array<std::int16_t, kMaxReferenceMarks> found{};
    BoundedVector<std::uint16_t, kMaxReferenceMarks> taken;  // the observations among them, rising
    MountDriftReport drift;
    CameraModel
        now;  // the camera as it sits, by the average; the calibrated one before the first measurement
};

// One frame of camera `index`. Each mark is looked for around where the camera, turned as known so far, would
// see it; when the picture has jumped, around there plus the one shift, of at most reach_px, that brings most
// marks onto observations. A shift needs two marks and half of those the camera can see. Marks of other
// cameras are ignored; without marks the answer is the calibrated camera. Preconditions: marks at most
// kMaxReferenceMarks, observations at most kMaxObservations.
void find_helmet_marks(const CameraModel& camera, std::size_t index, std::span<const HelmetMark> marks,
                       std::span<const Observation> observations, const HelmetMarkConfig& config,
                       MountDriftState& state, HelmetMarkOutput& output);

}  // namespace rig
