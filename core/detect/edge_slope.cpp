#include "core/detect/edge_slope.hpp"

#include <algorithm>
#include <array>

#include "core/base/math.hpp"

namespace rig {

namespace {

struct Direction {
    double x;
    double y;
};

constexpr double kStepPx = 1.0;              // to either side of the outline
constexpr double kBeyond = 2.5;              // such steps outside it: skin, or shade on it
constexpr double kLeastStep = 0.4;           // from the core to there, of the contrast
constexpr double kC1 = 0.92387953251128674;  // cosines of a sixteenth and an eighth of a turn
constexpr double kC2 = 0.70710678118654752;
constexpr double kC3 = 0.38268343236508977;
constexpr std::array<Direction, 8> kHalfTurn{
    {{1.0, 0.0}, {kC1, kC3}, {kC2, kC2}, {kC3, kC1}, {0.0, 1.0}, {-kC3, kC1}, {-kC2, kC2}, {-kC1, kC3}}};

// Between four pixels; beyond the border, the border's.
double level_at(const ImageView& image, double x, double y) {
    x = std::clamp(x, 0.0, image.width_px - 1.0);
    y = std::clamp(y, 0.0, image.height_px - 1.0);
    const int left = std::min(static_cast<int>(x), image.width_px - 2);
    const int top = std::min(static_cast<int>(y), image.height_px - 2);
    const std::uint8_t* upper = image.row(top) + left;
    const std::uint8_t* lower = image.row(top + 1) + left;
    const double u = x - left;
    const double v = y - top;
    return (1.0 - v) * ((1.0 - u) * upper[0] + u * upper[1]) + v * ((1.0 - u) * lower[0] + u * lower[1]);
}

}  // namespace

double edge_slope(const ImageView& image, Side side, const Blob& blob) {
    const double determinant = blob.xx * blob.yy - blob.xy * blob.xy;
    if (image.width_px < 2 || image.height_px < 2 || !(blob.xx > 0.0) || !(determinant > 0.0)) return 0.0;
    // The outline is the circle of radius 2 under the root of the moments.
    const double root_xx = sqrt(blob.xx);
    const double root_xy = blob.xy / root_xx;
    const double root_yy = sqrt(determinant / blob.xx);
    // Bright sides are measured inverted: what is above 255 less a level is as far above the core.
    const double turn = side == Side::kBelow ? 1.0 : -1.0;
    const double black = side == Side::kBelow ? 0.0 : 255.0;
    const double core = blob.background - blob.contrast;
    std::array<float, 2 * kHalfTurn.size()> changes;
    std::size_t count = 0;
    for (const Direction& d : kHalfTurn) {
        const double dx = 2.0 * root_xx * d.x;
        const double dy = 2.0 * (root_xy * d.x + root_yy * d.y);
        double nx = blob.yy * dx - blob.xy * dy;
        double ny = blob.xx * dy - blob.xy * dx;
        const double length = sqrt(nx * nx + ny * ny);
        nx *= kStepPx / length;
        ny *= kStepPx / length;
        for (const double sign : {1.0, -1.0}) {
            const double out = level_at(image, blob.x_px + sign * (dx + nx), blob.y_px + sign * (dy + ny));
            const double in = level_at(image, blob.x_px + sign * (dx - nx), blob.y_px + sign * (dy - ny));
            const double beyond = level_at(image, blob.x_px + sign * (dx + kBeyond * nx),
                                           blob.y_px + sign * (dy + kBeyond * ny));
            const double whole = std::max(kLeastStep * blob.contrast, turn * (beyond - black) - core);
            changes[count++] = static_cast<float>(turn * (out - in) / whole);
        }
    }
    const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(changes.begin(), middle, changes.end());
    return static_cast<double>(*middle);
}

}  // namespace rig
