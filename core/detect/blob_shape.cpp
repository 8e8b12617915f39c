#include "core/detect/blob_shape.hpp"

#include <algorithm>

#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kMostBlurPx2 = 0.5;    // an edge some 3 px wide; more is shape and no blur
constexpr double kAspectBadness = 0.3;  // of the flattest disc
// What surroundings as smooth as the sensor allows, and rougher ones, do to a blob.
struct Roughness {
    double deviation_px;  // roughness of an outline whose edge is some 2 px wide, per noise / contrast
    double sure_snr;      // contrast / spread of the surroundings: less costs
};
constexpr double kSensorNoise = 2.5;  // grey levels; more is not the sensor's
constexpr Roughness kSmooth{2.8, 4.0};
constexpr Roughness kRough{2.2, 5.0};
constexpr double kLeastSnr = 2.5;  // below: no telling it from noise

constexpr double kMostShadowed = 2.0;  // badness of a marker that shows at the deep outline
constexpr double kLongest = 1.7;       // of what a part of one may be in
constexpr double kWholeSigmaPx = 0.15;
constexpr double kSigmaPerFilledPx = 1.5;  // all of its weight filled in
constexpr double kFitSigmaPx = 0.2;        // of an ellipse that follows a part of an outline
constexpr double kPlainOddness = 0.5;      // what badness adds to
constexpr double kLeastFilledIn = 1e-3;
constexpr double kRefusedFilledIn = 0.4;

// What may be completed, in usual depths. There is more at the border of a streak than of a marker.
struct Least {
    double ink_depth;
    double retro_depth;
};
constexpr Least kLeastOfPiece{0.45, 0.25};
constexpr Least kLeastOfLobe{0.7, 0.5};

}  // namespace

SoftMoments without_blur(SoftMoments m) {
    constexpr double kFourPi = 12.566370614359172;
    const double quarter_axes = m.weight / kFourPi;  // product of both, squared below
    const double mean = 0.5 * (m.xx + m.yy);
    const double excess = m.xx * m.yy - m.xy * m.xy - quarter_axes * quarter_axes;
    if (!(excess > 0.0)) return m;
    // The lesser root of (xx - c)(yy - c) - xy^2 = quarter_axes^2.
    const double c = mean - sqrt(std::max(0.0, mean * mean - excess));
    const double taken = std::min(c, kMostBlurPx2);
    m.xx -= taken;
    m.yy -= taken;
    return m;
}

void set_axes(const SoftMoments& m, int left, int top, Blob& blob) {
    const double mean = 0.5 * (m.xx + m.yy);
    const double half = 0.5 * (m.xx - m.yy);
    const double spread = sqrt(half * half + m.xy * m.xy);
    blob.x_px = left + m.x;
    blob.y_px = top + m.y;
    blob.long_axis_px = 4.0 * sqrt(mean + spread);
    blob.short_axis_px = 4.0 * sqrt(std::max(mean - spread, 1.0 / 64.0));
    blob.xx = m.xx;
    blob.xy = m.xy;
    blob.yy = m.yy;
    blob.diameter_px = 1.1283791670955126 * sqrt(m.weight);
}

double mean_radius_px(const Blob& blob) {
    return 0.5 * sqrt(blob.long_axis_px * blob.short_axis_px);
}

void judge_shape(double noise, const BlobLimits& limits, Blob& blob) {
    const double aspect = blob.long_axis_px / blob.short_axis_px;
    const Roughness& rough = noise < kSensorNoise ? kSmooth : kRough;
    const double noise_share = std::max(1.0, noise) / blob.contrast;
    const double deviation_limit = limits.max_deviation_px + limits.max_deviation * mean_radius_px(blob) +
                                   rough.deviation_px * noise_share;
    const double snr = 1.0 / noise_share;
    blob.snr = snr;
    blob.badness = blob.deviation / deviation_limit + blob.open / limits.max_open +
                   kAspectBadness * (aspect - 1.0) / (limits.max_aspect - 1.0) +
                   std::max(0.0, rough.sure_snr - snr) / rough.sure_snr;
    blob.rejection = Rejection::kNone;
    if (blob.diameter_px < limits.min_diameter_px) {
        blob.rejection = Rejection::kSmall;
    } else if (blob.long_axis_px > limits.max_diameter_px) {
        blob.rejection = Rejection::kLarge;
    } else if (snr < kLeastSnr) {
        blob.rejection = Rejection::kFaint;
    } else if (aspect > limits.max_aspect) {
        blob.rejection = Rejection::kElongated;
    } else if (blob.open > limits.max_open) {
        blob.rejection = Rejection::kOpen;
    } else if (blob.deviation > deviation_limit) {
        blob.rejection = Rejection::kIrregular;
    }
}

bool may_be_completed(Side side, const BlobLimits& limits, const Blob& blob) {
    const Least& least = limits.is_lobe ? kLeastOfLobe : kLeastOfPiece;
    const double depth = side == Side::kBelow ? least.ink_depth : least.retro_depth;
    return limits.usual_size_px > 0.0 && blob.depth > depth * limits.usual_depth &&
           blob.long_axis_px < kLongest * limits.usual_size_px;
}

double completed_sigma_px(const Blob& blob) {
    if (!blob.completed && !blob.hidden) return 0.0;
    // Something at it, of which nothing could be filled in: as bad as the most that is.
    const bool refused = !blob.completed && blob.filled_in < kLeastFilledIn;
    const double unseen = refused ? kRefusedFilledIn : blob.filled_in;
    const double unsure_px = kSigmaPerFilledPx * unseen + (blob.completed ? kFitSigmaPx : 0.0);
    return kWholeSigmaPx + unsure_px * (kPlainOddness + blob.badness);
}

bool looks_shadowed(const Blob& blob) {
    const bool refused = blob.rejection == Rejection::kOpen || blob.rejection == Rejection::kIrregular ||
                         blob.rejection == Rejection::kElongated;
    return refused && blob.badness < kMostShadowed;
}

}  // namespace rig
