#include "core/detect/edge_slope.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/base/math.hpp"
#include "core/base/ranked.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr float kStepPx = 1.0F;              // to either side of the outline
constexpr float kC1 = 0.92387953251128674F;  // cosines of a sixteenth and an eighth of a turn
constexpr float kC2 = 0.70710678118654752F;
constexpr float kC3 = 0.38268343236508977F;
constexpr std::array<FourFloats, 2> kHalfTurnX{FourFloats{1.0F, kC1, kC2, kC3},
                                               FourFloats{0.0F, -kC3, -kC2, -kC1}};
constexpr std::array<FourFloats, 2> kHalfTurnY{FourFloats{0.0F, kC3, kC2, kC1},
                                               FourFloats{1.0F, kC1, kC2, kC3}};

constexpr float kBeyond = 2.5F;     // such steps outside it: skin, or shade on it
constexpr double kLeastStep = 0.4;  // from the core to there, of the contrast

// Between four pixels each; beyond the border, the border's.
FourFloats levels_at(const ImageView& image, FourFloats x, FourFloats y) {
    x = less_of(greater_of(x, FourFloats{}), all_four(static_cast<float>(image.width_px - 1)));
    y = less_of(greater_of(y, FourFloats{}), all_four(static_cast<float>(image.height_px - 1)));
    const FourFloats most_left = all_four(static_cast<float>(image.width_px - 2));
    const FourFloats most_top = all_four(static_cast<float>(image.height_px - 2));
    const FourInts left = __builtin_convertvector(less_of(x, most_left), FourInts);
    const FourInts top = __builtin_convertvector(less_of(y, most_top), FourInts);
    const FourFloats u = x - __builtin_convertvector(left, FourFloats);
    const FourFloats v = y - __builtin_convertvector(top, FourFloats);
    FourInts upper_left, upper_right, lower_left, lower_right;
    for (int i = 0; i < 4; ++i) {
        const std::uint8_t* upper = image.row(top[i]) + left[i];
        const std::uint8_t* lower = upper + image.stride_bytes;
        upper_left[i] = upper[0], upper_right[i] = upper[1];
        lower_left[i] = lower[0], lower_right[i] = lower[1];
    }
    const auto floats = [](FourInts ints) { return __builtin_convertvector(ints, FourFloats); };
    const FourFloats above = (1.0F - u) * floats(upper_left) + u * floats(upper_right);
    const FourFloats below = (1.0F - u) * floats(lower_left) + u * floats(lower_right);
    return (1.0F - v) * above + v * below;
}

}  // namespace

double edge_slope(const ImageView& image, Side side, const Blob& blob) {
    const double determinant = blob.xx * blob.yy - blob.xy * blob.xy;
    if (image.width_px < 2 || image.height_px < 2 || !(blob.xx > 0.0) || !(determinant > 0.0)) return 0.0;
    // The outline is the circle of radius 2 under the root of the moments.
    const auto of = [](double value) { return all_four(static_cast<float>(value)); };
    const double root_xx = sqrt(blob.xx);
    const FourFloats xx = of(2.0 * root_xx), xy = of(2.0 * blob.xy / root_xx);
    const FourFloats yy = of(2.0 * sqrt(determinant / blob.xx));
    const FourFloats centre_x = of(blob.x_px), centre_y = of(blob.y_px);
    // Bright sides are measured inverted: what is above 255 less a level is as far above the core.
    const float turn = side == Side::kBelow ? 1.0F : -1.0F;
    const FourFloats core = of((side == Side::kBelow ? 0.0 : -255.0) + blob.background - blob.contrast);
    const FourFloats least = of(kLeastStep * blob.contrast);
    // Of the step from the core to what is beyond, in one direction each.
    const auto changes_along = [&](FourFloats dx, FourFloats dy, FourFloats nx, FourFloats ny) {
        const FourFloats x = centre_x + dx, y = centre_y + dy;
        const FourFloats change = levels_at(image, x + nx, y + ny) - levels_at(image, x - nx, y - ny);
        const FourFloats beyond = levels_at(image, x + kBeyond * nx, y + kBeyond * ny);
        return turn * change / greater_of(least, turn * beyond - core);
    };
    std::array<float, 16> changes;
    for (std::size_t half = 0; half < 2; ++half) {
        const FourFloats dx = xx * kHalfTurnX[half];
        const FourFloats dy = xy * kHalfTurnX[half] + yy * kHalfTurnY[half];
        FourFloats nx = of(blob.yy) * dx - of(blob.xy) * dy;
        FourFloats ny = of(blob.xx) * dy - of(blob.xy) * dx;
        const FourFloats square = nx * nx + ny * ny;
        const FourFloats scale = kStepPx / roots_of(square);
        nx *= scale;
        ny *= scale;
        const FourFloats one = changes_along(dx, dy, nx, ny);
        const FourFloats other = changes_along(-dx, -dy, -nx, -ny);
        std::memcpy(&changes[8 * half], &one, sizeof(one));
        std::memcpy(&changes[8 * half + 4], &other, sizeof(other));
    }
    return ranked(changes, changes.size() / 2);
}

}  // namespace rig
