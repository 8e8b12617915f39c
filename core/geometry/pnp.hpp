// Where a known face is, from the pixels of its markers: head pose by PnP for a camera that is not on the
// head [Zhang06 eq. 10, section 12.1; theirs has 7 rigid points, one camera and a generic face]. A camera on
// the helmet sees the helmet's slip instead, which is the stabiliser's.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/limits.hpp"

namespace rig {

inline constexpr std::size_t kMinPnpPoints = 6;  // what the linear start needs
inline constexpr std::size_t kMaxPnpPoints = kMaxMarkers * kMaxCameras;

// A marker of the face and the pixel where a camera sees it.
struct NamedPixel {
    const CameraModel* camera = nullptr;
    Vec3 face_mm = Vec3::Zero();
    Vec2 pixel = Vec2::Zero();
};

struct PnpConfig {
    double sigma_px = 0.15;        // standard deviation of a pixel coordinate
    double outlier_sigmas = 4.0;   // residuals beyond count for ever less
    double most_rms_px = 3.0;      // of the points that count; beyond it the face is not this one
    double least_share = 0.6;      // of the points that must count
    double flat_share = 0.02;      // least over largest spread of the points: flatter ones have two poses
    double most_sigma_rad = 0.05;  // of the answer's rotation
};

enum class PnpRefusal : std::uint8_t {
    kNone = 0,
    kTooFew = 1,  // fewer than kMinPnpPoints finite points, or one camera sees too few of them to start from
    kFlat = 2,    // the points lie (nearly) in a plane or on a line
    kBehind = 3,  // no pose with all points in front of their cameras was found
    kUncertain = 4,  // the points leave some motion open
    kMistaken = 5,   // too many points disagree
};

// In the frame in which the cameras' places are given: reference = rotation face + translation.
struct HeadPose {
    bool known = false;
    PnpRefusal refusal = PnpRefusal::kNone;  // when not known
    Rigid reference_from_face;
    Vec3 rotation_sigma_rad = Vec3::Zero();    // about the reference's axes, through the points' centroid
    Vec3 translation_sigma_mm = Vec3::Zero();  // of that centroid
    double rms_px = 0.0;                       // distance of seen from projected pixels, of those that count
    std::uint16_t points_used = 0;             // that count
};

// From nothing: linear start (DLT, Hartley and Zisserman 2004 section 7.1) with the points of the camera that
// sees most, then Gauss-Newton over all with Geman-McClure weights whose scale falls from what the start
// leaves to outlier_sigmas (Black and Rangarajan 1996); where a tenth of the points disagrees, further starts
// leave out those the last one explains worst. `before`, when known, is tried as a start too and
// wins when it explains more. Fixed iterations and memory. Any numbers are safe; points that are not finite
// are left out. Precondition: at most kMaxPnpPoints, cameras not null and plausible (check_camera).
[[nodiscard]] HeadPose solve_pnp(std::span<const NamedPixel> points, const PnpConfig& config,
                                 const HeadPose& before = {});

// The same, frame after frame. `last_known` is the start besides nothing, and becomes the answer when that is
// known: a refused frame does not take the start away from the next one.
[[nodiscard]] HeadPose track_pnp(std::span<const NamedPixel> points, const PnpConfig& config,
                                 HeadPose& last_known);

}  // namespace rig
