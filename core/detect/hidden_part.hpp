// A marker of which a part cannot be seen: a specular spot lies on ink, a lash across a retro-reflective dot.
// Such pixels are on the wrong side of the skin, so they say nothing of the paint below them. The rest of the
// outline says where the marker goes on. Not for: what hides a marker on its own side (dark on dark).
#pragma once

#include "core/detect/blob.hpp"
#include "core/detect/blob_shape.hpp"

namespace rig {

// Marks in `hidden` the pixels at the blob whose cover shows something that is neither paint nor skin, and
// one step around them for the lens. noise_cover: standard deviation of the skin in units of the contrast.
// False if there are none.
[[nodiscard]] bool mark_hidden(const BlobWorkspace& workspace, double noise_cover, BitRows& hidden);

// Moments of the whole marker from those of its seen part: hidden pixels take the weight that the ellipse of
// equal moments gives them, until the two agree. Leaves `seen` as it is when more than two fifths of that
// ellipse would be hidden. Both are in pixels of the window; hidden reaches no farther than its height.
[[nodiscard]] SoftMoments complete_moments(const SoftMoments& seen, const BitRows& hidden, int height);

// The same when the ellipse is known: hidden pixels take the weight that it gives them.
[[nodiscard]] SoftMoments fill_moments(const SoftMoments& seen, const SoftMoments& ellipse,
                                       const BitRows& hidden, int height);

}  // namespace rig
