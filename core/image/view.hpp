// A borrowed 8-bit grey image.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"

namespace rig {

// Pixel (x, y) is pixels[y * stride_bytes + x]; integer coordinates are pixel centres; origin at the top
// left. Owner and lifetime are the caller's; a view with pixels == nullptr means "no image".
struct ImageView {
    const std::uint8_t* pixels = nullptr;
    int width_px = 0;
    int height_px = 0;
    std::ptrdiff_t stride_bytes = 0;

    [[nodiscard]] bool empty() const { return pixels == nullptr || width_px <= 0 || height_px <= 0; }
    [[nodiscard]] const std::uint8_t* row(int y) const {
        RIG_CHECK(y >= 0 && y < height_px);
        return pixels + y * stride_bytes;
    }
};

}  // namespace rig
