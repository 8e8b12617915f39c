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
    std::array<ViewSightings, kMaxCameras> views{};
    // Entry i of a view came from this index of the input (slots without a finite point are left out).
    std::array<BoundedVector<std::uint16_t, kMaxSightings>, kMaxCameras> source{};

    void clear() {
        view_count = 0;
        from_cameras = false;
        for (auto& view : views) view.clear();
        for (auto& indices : source) indices.clear();
    }
};

// Rays of one camera's observations, each with the delay of its row. sigma_px: standard deviation of a blob's
// centre; expected_depth_mm: where the face is, to turn pixels into millimetres across the ray.
void add_camera_view(const CameraModel& camera, std::span<const Observation> observations, double sigma_px,
                     double expected_depth_mm, SightingSet& set);

// The finite points of a 3D stream, sigma_mm each coordinate.
void add_point_view(std::span<const Vec3> points_mm, double sigma_mm, SightingSet& set);

}  // namespace rig
