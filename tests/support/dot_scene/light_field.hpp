// A plane of light on the sensor before it becomes bytes, and what optics and sensor do to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

struct LightField {
    int width = 0;
    int height = 0;
    std::vector<double> values;  // grey levels
    LightField(int w, int h, double value)
        : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}
    [[nodiscard]] double& at(int x, int y) {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
    [[nodiscard]] double clamped(int x, int y) const;  // the border goes on for ever
};

// Gaussian, standard deviation in px.
void blur(LightField& field, double sigma);

// The mean over a straight path of this length about every pixel, as a camera sees a face that moves during
// its exposure.
void smear(LightField& field, double length_px, double angle_rad);

// Noise of variance read_noise^2 + shot_noise * level, then eight bits.
[[nodiscard]] Picture digitise(const LightField& field, double read_noise, double shot_noise,
                               SeededRandom& random);

}  // namespace rig::test
