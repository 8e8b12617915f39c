// The skin of the built-in head as formulas: a loft of slices through the skull, and the features of the face
// on it. Made up from everyday proportions of an adult head, not measured on anybody. Millimetres, face frame
// of the rig.
#pragma once

#include "core/base/linalg.hpp"

namespace rig::host {

// Landmarks that mesh, shapes and markers agree on.
inline constexpr double kEyeX_mm = 31.0;  // of the left eyeball's centre; y and z are 0
inline constexpr double kEyeballRadius_mm = 12.2;
inline constexpr double kLidRadius_mm = 13.5;  // outside of the lids, about the eyeball's centre
inline constexpr double kEyeLineY_mm = -0.5;   // where closed lids would meet
inline constexpr double kEyeHalfWidth_mm = 14.0;
inline constexpr double kUpperLidOpening_mm = 5.0;  // at the middle of the open eye
inline constexpr double kLowerLidOpening_mm = 4.4;
inline constexpr double kLidReach_mm = 14.0;     // beyond it the skin does not know of the opening
inline constexpr double kMouthLineY_mm = -71.0;  // between the lips
inline constexpr double kMouthHalfWidth_mm = 26.0;

inline constexpr double kCrownT_mm = 118.0;  // the top row of the loft
inline constexpr double kNeckT_mm = -190.0;  // the bottom row of the loft

// A point of the skin. `t_mm` names a slice: its front point's height down to the chin, then the way along
// the underside and the neck. `azimuth_rad`: 0 in front, pi / 2 at the left, pi at the back.
[[nodiscard]] Vec3 skin_point(double t_mm, double azimuth_rad);

// Height of the face over the plane z = 0, with the lids on it; for y > -80 mm and |x| inside the face.
[[nodiscard]] double face_z_mm(double x_mm, double y_mm);

// How far open the eye is at x, 1 in the middle to 0 at both corners and outside. Either eye.
[[nodiscard]] double eye_opening(double x_mm);

// Part of a lid's motion that the skin makes at `distance_mm` >= 0 from the lid's edge: 1 to 0 at
// kLidReach_mm.
[[nodiscard]] double lid_share(double distance_mm);

}  // namespace rig::host
