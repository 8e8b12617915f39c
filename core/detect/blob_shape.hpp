// What a blob's weights say of its shape, and whether a marker looks like that.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/base/math.hpp"
#include "core/detect/bit_rows.hpp"
#include "core/detect/blob.hpp"

namespace rig {

// Rows of a window within an ellipse, as spans of bits: its centre, its second moments, and its radius in
// roots of them (2: the ellipse of equal moments). yy > 0.
class EllipseRows {
  public:
    EllipseRows(double x, double y, double xx, double xy, double yy, double roots)
        : x_(x),
          y_(y),
          lean_(xy / yy),
          per_yy_(1.0 / yy),
          width_(std::max(0.0, xx - xy * xy / yy)),
          square_(roots * roots) {}

    [[nodiscard]] std::uint64_t at(int y) const {
        const double dy = y - y_;
        const double root = square_ - dy * dy * per_yy_;
        if (!(root > 0.0)) return 0;
        const double half = sqrt(root * width_);
        const double middle = x_ + lean_ * dy;
        const auto begin = static_cast<int>(std::clamp(middle - half, 0.0, 63.0) + 0.999999);
        const auto end = static_cast<int>(std::clamp(middle + half, -1.0, 63.0) + 1.0);
        return begin < end ? bit_span(begin, end) : 0;
    }

  private:
    double x_;
    double y_;
    double lean_;
    double per_yy_;
    double width_;
    double square_;
};

// Of a soft-threshold mask: its weight in pixels, centre and central second moments, px.
struct SoftMoments {
    double weight = 0.0;
    double x = 0.0;
    double y = 0.0;
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
};

// A soft edge adds the same variance in every direction: the ellipse of equal moments lies outside the
// outline of small or flat markers. Taken off until the ellipse has the area of the weights: for comparing it
// with the outline.
[[nodiscard]] SoftMoments without_blur(SoftMoments m);
// Centre, axes and diameter of the ellipse of equal moments; (left, top) is where the moments' window begins.
void set_axes(const SoftMoments& moments, int left, int top, Blob& blob);

[[nodiscard]] double mean_radius_px(const Blob& blob);

// Sets badness and rejection of a blob whose axes, contrast, deviation and openness are known; noise: rms of
// the surroundings about their plane, grey levels.
void judge_shape(double noise, const BlobLimits& limits, Blob& blob);

// Parts of the contrast: where an outline is drawn, or where it is drawn when shadow touches the marker; and
// below what a pixel of the surroundings is background.
inline constexpr double kHalfOutline = 0.5;
inline constexpr double kDeepOutline = 0.6875;
inline constexpr double kOpenCover = 0.4375;
inline constexpr double kSoftRamp =
    0.25;  // weights rise from 0 to 1 from this much before an outline to after it
inline constexpr double kHiddenCover = 0.4;   // beyond the skin, the other way: neither paint nor skin
inline constexpr double kDeepBadness = 0.25;  // of a marker that only shows at the deep outline

// Worth completing: of the paint of the image's markers, and not so long that no marker is in it.
[[nodiscard]] bool may_be_completed(Side side, const BlobLimits& limits, const Blob& blob);

// Standard deviation of the centre of a marker of which something was not seen: 0.15 px and more, the more
// was filled in and the odder it is; from the disturbed scenes of the property tests. 0: nothing was hidden.
[[nodiscard]] double completed_sigma_px(const Blob& blob);

// Refused for what shadow does to an outline, and not by much: worth another look at the deep one.
[[nodiscard]] bool looks_shadowed(const Blob& blob);

}  // namespace rig
