// The normal case of measure_blob(), whole vectors of pixels at a time: a blob of ordinary size that stands
// alone on skin lit without edges. Not for: markers that touch, or the border of the image.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/detect/bit_rows.hpp"
#include "core/detect/blob.hpp"
#include "core/detect/components.hpp"
#include "core/image/view.hpp"

namespace rig {

inline constexpr int kQuickMarginPx = 3;  // of surroundings on every side of the start
inline constexpr int kQuickWindowPx = 48;

// Where a blob is about to be measured.
struct QuickStart {
    int left = 0;  // of the window, px of the image
    int top = 0;
    int width = 0;  // with the margin; at most kQuickWindowPx
    int height = 0;
};

struct QuickWorkspace {
    BitRows blob{};
    BitRows set{};  // the same, with the rows outside it empty
    BitRows moat{};
};

// The window around a component; false where it does not fit.
[[nodiscard]] bool frame_component(const ImageView& image, const Component& component, QuickStart& start);

// Measures the blob inside the window's margin. False when this is not a normal case: measure_blob()
// then has to decide, and `blob` says nothing.
[[nodiscard]] bool measure_quickly(const ImageView& image, Side side, const QuickStart& start,
                                   const BlobLimits& limits, QuickWorkspace& workspace, Blob& blob);

}  // namespace rig
