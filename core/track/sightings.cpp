#include "core/track/sightings.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

void append(SightingSet& set, std::size_t view, std::size_t index, const Sighting& sighting) {
    if (!set.views[view].push_back(sighting)) return;
    const bool kept = set.source[view].push_back(static_cast<std::uint16_t>(index));
    RIG_CHECK(kept);
}

bool finite(const Vec3& x) {
    return is_finite(x[0]) && is_finite(x[1]) && is_finite(x[2]);
}

}  // namespace

Sighting at_capture(const Sighting& sighting, const Vec3& velocity_mm_per_us) {
    Sighting moved = sighting;
    moved.point_mm -= sighting.delay_us * velocity_mm_per_us;
    moved.delay_us = 0.0;
    return moved;
}

void add_camera_view(const CameraModel& camera, std::span<const Observation> observations, double sigma_px,
                     double expected_depth_mm, SightingSet& set, std::span<const std::uint16_t> left_out) {
    RIG_CHECK(set.view_count < kMaxCameras);
    const std::size_t view = set.view_count++;
    set.from_cameras = true;
    set.cameras[view] = camera;
    set.row_delays = set.row_delays || camera.row_time_us > 0.0;
    const double mm_per_px = expected_depth_mm / (0.5 * (camera.fx_px + camera.fy_px));
    std::size_t next_left_out = 0;
    for (std::size_t i = 0; i < observations.size(); ++i) {
        if (next_left_out < left_out.size() && left_out[next_left_out] == i) {
            ++next_left_out;
            continue;
        }
        Sighting sighting;
        sighting.point_mm = camera.centre_mm;
        sighting.direction = pixel_ray(camera, pixel_of(observations[i]));
        const double sigma_mm = std::max(sigma_px, static_cast<double>(observations[i].sigma_px)) * mm_per_px;
        sighting.information = 1.0 / (sigma_mm * sigma_mm);
        sighting.delay_us = row_delay_us(camera, static_cast<double>(observations[i].y_px));
        if (finite(sighting.direction)) append(set, view, i, sighting);
    }
}

void add_point_view(std::span<const Vec3> points_mm, double sigma_mm, SightingSet& set) {
    RIG_CHECK(set.view_count < kMaxCameras);
    const std::size_t view = set.view_count++;
    constexpr std::size_t kMostSlots = 65536;  // what a source index holds
    for (std::size_t i = 0; i < std::min(points_mm.size(), kMostSlots); ++i) {
        // Beyond a metre from the rig's origin nothing is a marker, and squares stay far from overflow.
        constexpr double kReachMm = 1000.0;
        if (!finite(points_mm[i]) || points_mm[i].cwiseAbs().maxCoeff() > kReachMm) continue;
        append(set, view, i, Sighting{points_mm[i], Vec3::Zero(), 1.0 / (sigma_mm * sigma_mm)});
    }
}

}  // namespace rig
