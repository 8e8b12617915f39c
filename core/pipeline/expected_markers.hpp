// Where in a camera's picture the markers should be, so that detection need not read all of it. Not for:
// predicting in space, which is the tracker's.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/bounded_vector.hpp"
#include "core/base/linalg.hpp"
#include "core/detect/detector.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/limits.hpp"

namespace rig {

using ExpectedMarkers = BoundedVector<ExpectedMarker, kMaxMarkers + kMaxReferenceMarks>;

// What the tracker says of one frame.
struct MarkerPrediction {
    std::span<const Vec3> position_mm;         // headset frame, each marker
    std::span<const std::uint16_t> missed;     // frames since it was last seen by any camera
    std::span<const std::int16_t> last_match;  // its observation in this camera's last picture; < 0: none
};

// Markers in front of the camera whose pixel is inside its picture, and the helmet's own marks. A marker
// unseen for some frames may have gone farther from where it is thought to be.
void expect_markers(const CameraModel& camera, std::size_t camera_number, const MarkerPrediction& prediction,
                    std::span<const HelmetMark> marks, ExpectedMarkers& expected);

}  // namespace rig
