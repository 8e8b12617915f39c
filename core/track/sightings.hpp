// What one tick brings to the tracker: unnamed sightings, grouped by the view they come from.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/bounded_vector.hpp"
#include "core/detect/observation.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/geometry/triangulation.hpp"
#include "core/limits.hpp"

namespace rig {

inline constexpr std::size_t kMaxSightings = kMaxPoints;
static_assert(kMaxSightings >= kMaxObservations);

using ViewSightings = BoundedVector<Sighting, kMaxSightings>;

// A view is a camera, or the one cloud of a 3D stream. Within a view each marker appears at most once.
struct SightingSet {
    std::uint8_t view_count = 0;
    bool from_cameras = false;
    bool row_delays = false;      // a camera with a rolling shutter is among the views
    std::int64_t capture_us = 0;  // of the frame; only a rolling shutter asks for it
    std::array<ViewSightings, kMaxCameras> views{};
    std::array<CameraModel, kMaxCameras> cameras{};  // behind each view, when from_cameras
    // Entry i of a view came from this index of the input (slots without a finite point are left out).
    std::array<BoundedVector<std::uint16_t, kMaxSightings>, kMaxCameras> source{};

    void clear() {
        view_count = 0;
        from_cameras = false;
        row_delays = false;
        capture_us = 0;
        for (auto& view : views) view.clear();
        for (auto& indices : source) indices.clear();
    }
};

[[nodiscard]] inline Vec2 pixel_of(const Observation& observation) {
    return {static_cast<double>(observation.x_px), static_cast<double>(observation.y_px)};
}

// The sighting as it would have been at the frame's capture time, the exposure of its middle row: moved back
// by what its marker, at this velocity, went since. A ray keeps its direction: what that leaves out is of
// second order in the motion during a read-out.
[[nodiscard]] Sighting at_capture(const Sighting& sighting, const Vec3& velocity_mm_per_us);

// Rays of one camera's observations, each with the delay of its row. sigma_px: standard deviation of a blob's
// centre, where the observation does not say more; expected_depth_mm: where the face is, to turn pixels into
// millimetres across the ray. left_out: indices of observations, rising, that are no markers of a face.
void add_camera_view(const CameraModel& camera, std::span<const Observation> observations, double sigma_px,
                     double expected_depth_mm, SightingSet& set,
                     std::span<const std::uint16_t> left_out = {});

// The finite points of a 3D stream, sigma_mm each coordinate.
void add_point_view(std::span<const Vec3> points_mm, double sigma_mm, SightingSet& set);

}  // namespace rig
