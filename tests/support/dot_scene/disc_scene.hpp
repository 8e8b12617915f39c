// Discs of paint on a round head, seen by a pinhole camera: every disc is a piece of a sphere, so its picture
// is no exact ellipse and its centroid is not the picture of its centre. The truth is the projected 3D
// centre. With what disturbs real pictures, one kind at a time or all at once. Not a face.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/light_field.hpp"
#include "tests/support/dot_scene/match.hpp"

namespace rig::test {

enum class Disturbance : std::uint8_t {
    kNone,
    kGlintsOnDiscs,  // specular spots, a tenth to a quarter of a disc wide, on two discs of five
    kGlintsOnSkin,   // the same beside the discs, and small bright spots anywhere
    kStreaks,        // wet, saturated lines, some across discs
    kHighlights,     // saturated areas several discs wide, their borders across discs
    kNostrils,       // dark holes of one to three discs' length with a soft edge
    kLashes,         // fans of dark strokes under a pixel wide on a lid line, some across discs
    kLipShadow,      // a dark line with a soft shadow below it, both across discs
    kMotion,         // 1 to 4 px of straight motion during the exposure
    kOverexposed,    // skin facing the light is saturated
    kUnderexposed,   // a quarter of the light, the noise stays
    kEverything,     // all of the above but the last two
    kCount
};

[[nodiscard]] const char* name_of(Disturbance disturbance);

struct DiscSceneConfig {
    int width_px = 640;
    int height_px = 480;
    double head_radius_mm = 75.0;
    double distance_mm = 150.0;  // from the camera to the nearest point of the head
    double focal_px = 500.0;
    double disc_mm = 3.0;        // diameter, along the skin
    double least_cosine = 0.25;  // of the viewing angle, at which discs end
    bool bright = false;  // retro-reflective discs and light from the lens; else ink and light from a side
    double blur_px = 0.8;
    double texture = 0.0;  // relative standard deviation of the skin's mottling
    double read_noise = 1.5;
    double shot_noise = 0.1;  // variance per grey level
    Disturbance disturbance = Disturbance::kNone;
    double slip_rad[3] = {};  // the head with its discs, turned about its centre (an axis times an angle) and
    double slip_mm[3] = {};   // then moved, camera axes; the light stays where it is
    std::uint64_t seed = 1;   // of head, discs, light and what disturbs
    std::uint64_t frame = 0;  // of that seed: the sensor's noise is another one
};

struct DiscTruth {
    double x_px = 0.0;  // projected 3D centre
    double y_px = 0.0;
    double centroid_x_px = 0.0;  // of the disc's picture, before lens and noise
    double centroid_y_px = 0.0;
    double diameter_px = 0.0;  // of the disc of equal area
    double cosine = 0.0;       // of the viewing angle
    double centre_mm[3] = {};  // camera axes: x right, y down, z forward
    double normal[3] = {};
    double hidden = 0.0;  // part of its area under something that is not shade
};

struct DiscLight {
    LightField light;  // on the sensor at nominal exposure, behind the lens
    std::vector<DiscTruth> discs;
};

struct DiscPicture {
    Picture picture;
    std::vector<DiscTruth> discs;
};

inline constexpr double kLeastExpectedCosine = 0.35;
inline constexpr double kMostExpectedHidden = 0.34;  // a third of the area, and the samples' grain

// Grey level of skin that faces the light.
[[nodiscard]] double skin_level(const DiscSceneConfig& config);

[[nodiscard]] DiscLight light_of(const DiscSceneConfig& config);
[[nodiscard]] DiscPicture render(const DiscSceneConfig& config);

// Expected: seen at a cosine above 0.35, at most a third of it hidden. Reach: half the long axis.
[[nodiscard]] std::vector<TrueDot> true_dots(const DiscPicture& picture);

}  // namespace rig::test
