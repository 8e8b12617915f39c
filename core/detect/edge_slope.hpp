// How sharp a blob's edge is. Paint ends where it ends, and the lens blurs all of it alike; a nostril or a
// shadow fades. Not for: deciding how sharp is sharp enough, which the other markers of the image say
// (population).
#pragma once

#include "core/detect/blob.hpp"
#include "core/image/view.hpp"

namespace rig {

// Change of level from one pixel inside the blob's ellipse to one outside, in parts of its contrast: the
// median over sixteen directions. About 0.75 behind a sharp lens, less the wider the edge is; may exceed 1 or
// be negative on what is no marker. The blob lies in the image.
[[nodiscard]] double edge_slope(const ImageView& image, Side side, const Blob& blob);

}  // namespace rig
