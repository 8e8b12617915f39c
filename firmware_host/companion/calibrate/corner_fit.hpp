// One corner between four squares of a ChArUco board, to hundredths of a pixel: the picture of two edges that
// cross, blurred, is fitted to the pixels along the edges. Markers inside the white squares are left out.
#pragma once

#include "core/base/linalg.hpp"
#include "core/image/view.hpp"

namespace rig::host {

struct CornerGuess {
    Vec2 at_px = Vec2::Zero();
    Mat2 px_from_square = Mat2::Zero();  // columns: one square along the board's x and y, in pixels
    double bare_share = 0.0;             // of a square: between its rim and its marker
};

struct CornerFit {
    bool ok = false;  // false: near the rim of the picture, no contrast, or the fit ran off
    Vec2 at_px = Vec2::Zero();
    double blur_px = 0.0;  // standard deviation across the blurrier of the two edges
};

// I(d) = base + amplitude erf(n1 d / (sqrt2 s1)) erf(n2 d / (sqrt2 s2)), d from the corner: eight numbers by
// Gauss-Newton. Within 0.33 of a square, where lens distortion bends an edge by a hundredth of a pixel.
[[nodiscard]] CornerFit fit_corner(const ImageView& image, const CornerGuess& guess);

}  // namespace rig::host
