// What detection hands on: blobs that look like markers, without names.
#pragma once

#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/limits.hpp"

namespace rig {

// What the markers are: darker than the skin (ink), brighter (retro-reflective), or decided from the images.
enum class MarkerPolarity : std::uint8_t { kAuto = 0, kDark = 1, kBright = 2 };

// One blob. Coordinates are raw (distorted) pixels, integers at pixel centres.
struct Observation {
    float x_px = 0.0F;
    float y_px = 0.0F;
    float diameter_px = 0.0F;  // of the disc with the blob's area
    float contrast = 0.0F;     // |blob - background| / full scale, 0..1
    float score = 0.0F;        // 0..1, how much it looks like a marker
    float sigma_px = 0.0F;  // standard deviation of the centre of one that was completed; 0: kCentreSigmaPx
};

// Standard deviation of the centre of a marker seen whole: measured on rendered frames, blur and noise.
inline constexpr double kCentreSigmaPx = 0.15;

using Observations = BoundedVector<Observation, kMaxObservations>;

}  // namespace rig
