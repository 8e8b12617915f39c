// From light on the focal plane to the 8-bit picture: defocus, vignetting, exposure, gain, shot and read
// noise.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "firmware_host/companion/world/helmet.hpp"

namespace rig::host {

inline constexpr float kNominalExposure_us = 2000.0F;

struct CameraControl {
    float exposure_us = kNominalExposure_us;  // 0 .. 100 000
    float gain_db = 0.0F;                     // -20 .. 48
};

// Radiance of an image: DN at nominal exposure and gain, before vignetting; rows without gaps.
struct Radiance {
    std::vector<float> values;
    int first_column = 0, end_column = 0, first_row = 0, end_row = 0;  // outside: `background`
    float background = 0.0F;
};

class Sensor {
  public:
    // defocus_px: standard deviation of the blur, 0 .. 3. noise: factor on both kinds, 0 = none.
    Sensor(const HelmetCamera& camera, double defocus_px, double vignetting, double noise);

    // Blurs `light` in place, then writes width * height bytes. Equal seed, frame, camera and light give
    // equal bytes.
    void expose(Radiance& light, const CameraControl& control, std::uint64_t seed, std::uint64_t frame,
                std::uint64_t camera, std::span<std::uint8_t> image);

  private:
    void blur(Radiance& light);

    std::size_t width_;
    std::size_t height_;
    float noise_;
    std::vector<float> taps_;        // half of the symmetric kernel, centre first
    std::vector<float> vignetting_;  // per pixel
    std::vector<float> quantiles_;   // of the unit normal
    std::vector<float> scratch_;
    std::vector<float> noise_row_;
};

}  // namespace rig::host
