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

inline constexpr int kQuickMarginPx = 5;  // of surroundings on every side of the start
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
    BitRows covered{};  // at mid contrast or deeper
    BitRows dusky{};    // deep enough not to be background
    BitRows scratch{};
    std::array<std::uint16_t, 256> histogram{};
};

// The window around a component, and its pixels in workspace.blob; false where it does not fit.
[[nodiscard]] bool frame_component(const ImageView& image, const Component& component,
                                   std::span<const Run> runs, QuickWorkspace& workspace, QuickStart& start);

// Measures the blob of workspace.blob, roughly drawn. False when this is not a normal case: measure_blob()
// then has to decide, and `blob` says nothing.
[[nodiscard]] bool measure_quickly(const ImageView& image, Side side, const QuickStart& start,
                                   const BlobLimits& limits, QuickWorkspace& workspace, Blob& blob);

}  // namespace rig
