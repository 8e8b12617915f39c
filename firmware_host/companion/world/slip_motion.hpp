// How the helmet moves on the head while a take runs: slow drift, small jolts that ring down, now and then a
// step that stays. A pure function of seed and time.
#pragma once

#include <cstdint>

#include "firmware_host/companion/world/vector.hpp"

namespace rig::host {

enum class SlipKind : std::uint8_t { kNone, kGentle, kHard };

// observed = R(rotation_rad) face + translation_mm, about the rig's origin; cameras are fixed to the headset.
struct HeadsetSlip {
    Vec3d rotation_rad{};
    Vec3d translation_mm{};

    [[nodiscard]] Vec3d apply(const Vec3d& face_mm) const {
        return multiply(rotation_by(rotation_rad), face_mm) + translation_mm;
    }
};

// Bounds that no time exceeds: gentle 1.5 deg and 4 mm, hard 3 deg and 8 mm.
struct SlipBound {
    double rotation_rad = 0.0;
    double translation_mm = 0.0;
};

class SlipMotion {
  public:
    SlipMotion(SlipKind kind, std::uint64_t seed);
    // time_s >= 0; zero slip at 0.
    [[nodiscard]] HeadsetSlip at(double time_s) const;
    [[nodiscard]] SlipBound bound() const;

  private:
    [[nodiscard]] double drift(std::uint64_t axis, double time_s) const;
    [[nodiscard]] double jolts(std::uint64_t axis, double time_s) const;
    [[nodiscard]] double steps(std::uint64_t axis, double time_s) const;

    SlipKind kind_;
    std::uint64_t seed_;
};

}  // namespace rig::host
