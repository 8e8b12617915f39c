#include "core/pipeline/expected_markers.hpp"

#include <algorithm>

namespace rig {

namespace {

constexpr double kReachMm = 3.0;         // the largest surprise of a frame that a face at speech makes
constexpr double kReachMmPerMiss = 1.0;  // further, for every frame without the marker,
constexpr double kMostMm = 8.0;          // up to this
constexpr double kLeastPx = 3.0;         // the detector's own surprises
constexpr double kMarkReachPx = 8.0;  // of a mark on the helmet: a camera that was knocked by half a degree

void expect(const CameraModel& camera, const Vec3& at_mm, double reach_mm, double reach_px, bool surely,
            ExpectedMarkers& expected) {
    const Projection seen = project(camera, at_mm);
    const bool inside = seen.z_mm > 1.0 && seen.pixel[0] >= 0.0 && seen.pixel[1] >= 0.0 &&
                        seen.pixel[0] < camera.width_px && seen.pixel[1] < camera.height_px;
    if (!inside) return;
    const double reach = std::max(reach_px, reach_mm * camera.fx_px / seen.z_mm);
    (void)expected.push_back({static_cast<float>(seen.pixel[0]), static_cast<float>(seen.pixel[1]),
                              static_cast<float>(std::min(reach, static_cast<double>(kMaxReachPx))), surely});
}

}  // namespace

void expect_markers(const CameraModel& camera, std::size_t camera_number, const MarkerPrediction& prediction,
                    std::span<const HelmetMark> marks, ExpectedMarkers& expected) {
    expected.clear();
    for (std::size_t k = 0; k < prediction.position_mm.size(); ++k) {
        const double reach_mm = std::min(kMostMm, kReachMm + kReachMmPerMiss * prediction.missed[k]);
        expect(camera, prediction.position_mm[k], reach_mm, kLeastPx, prediction.last_match[k] >= 0,
               expected);
    }
    for (const HelmetMark& mark : marks) {
        if (!mark.is_seen_by(camera_number)) continue;
        expect(camera, mark.headset_mm, 0.0, kMarkReachPx, false, expected);
    }
}

}  // namespace rig
