#include "core/detect/blob.hpp"

#include <algorithm>
#include <cstring>

#include "core/base/math.hpp"
#include "core/detect/blob_shape.hpp"
#include "core/detect/hidden_part.hpp"
#include "core/detect/partial_outline.hpp"
#include "core/detect/window_sums.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr int kMargin = 8;  // px of surroundings on every side of the component
constexpr int kFull = 256;  // cover of a pixel that is all blob
constexpr int kHalf = static_cast<int>(kFull * kHalfOutline);
constexpr int kDeep = static_cast<int>(kFull * kDeepOutline);
constexpr int kRamp = static_cast<int>(kFull * kSoftRamp);
constexpr float kLeastShare = 0.4F;     // of the light at the centre that a pixel's background may have,
constexpr float kGreatestShare = 2.5F;  // so that a bad plane cannot run away
constexpr int kRedrawReach = 2;         // px that a redrawn outline may lie outside the old one
constexpr int kMoatReach = 3;           // px
constexpr int kRingReach = 5;           // px
constexpr int kOpen = static_cast<int>(kFull * kOpenCover);
constexpr int kCorePercent =
    30;  // of the blob's pixels are darker than its core: clear of noise, glints and edge
constexpr int kMinRing = 12;          // pixels that can carry a plane
constexpr double kPartBadness = 0.5;  // of a marker none of whose rim is seen
constexpr double kLeastSize = 0.7;    // of a completed marker, in usual ones
constexpr double kMostSize = 1.35;
constexpr double kLeastFollowed = 0.6;  // part of the rim of a completed marker that is seen
constexpr double kLobeFollowed = 0.5;
constexpr double kMostFollowedOpen = 0.15;  // of a blob whose outline is followed
constexpr double kLineAspect = 3.5;         // of what is longer than a marker
constexpr double kPieceReach = 1.1;         // of it, from a piece's middle
constexpr int kRounds = 2;                  // outline -> background -> outline

// Grey level at column x, row y of the window: level + slope_x (x - centre_x) + slope_y (y - centre_y).
struct Plane {
    double level = 0.0;
    double slope_x = 0.0;
    double slope_y = 0.0;
    int centre_x = 0;
    int centre_y = 0;

    [[nodiscard]] double at(double x, double y) const {
        return level + slope_x * (x - centre_x) + slope_y * (y - centre_y);
    }
};

// Pieces of a marker are looked for as far around them as a marker is long.
int margin_of(int length, const BlobLimits& limits) {
    if (length >= kMostSize * limits.usual_size_px) return kMargin;
    const int room = (static_cast<int>(kBlobWindowPx) - length) / 2;
    return std::clamp(static_cast<int>(limits.usual_size_px) + 1, kMargin, room);
}

void load_window(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                 int margin, BlobWorkspace& w) {
    w.left = std::max(0, component.left - margin);
    w.top = std::max(0, component.top - margin);
    w.width = std::min(image.width_px, component.right + 1 + margin) - w.left;
    w.height = std::min(image.height_px, component.bottom + 1 + margin) - w.top;
    const std::uint8_t turn = side == Side::kAbove ? 255 : 0;
    const bool whole_vectors = w.left + static_cast<int>(BlobWorkspace::kPitch) <= image.width_px;
    for (int y = 0; y < w.height; ++y) {
        const std::uint8_t* pixels = image.row(w.top + y) + w.left;
        std::uint8_t* row = w.values[static_cast<std::size_t>(y)].data();
        if (whole_vectors) {
            for (int x = 0; x < w.width; x += kByteLanes) store_bytes(load_bytes(pixels + x) ^ turn, row + x);
        } else {
            for (int x = 0; x < w.width; ++x) row[x] = pixels[x] ^ turn;
        }
    }
    std::fill_n(w.blob.begin(), w.height, std::uint64_t{0});
    for (const Run& run : runs) {
        w.blob[static_cast<std::size_t>(run.y - w.top)] |= bit_span(run.begin - w.left, run.end - w.left);
    }
    w.box = {component.left - w.left, component.top - w.top, component.right + 1 - w.left,
             component.bottom + 1 - w.top};
}

// The blob and its siblings grow towards each other; what the siblings reach first is theirs.
void claim_foreign(const Component& component, const Siblings& siblings, BlobWorkspace& w) {
    std::fill_n(w.foreign.begin(), w.height, std::uint64_t{0});
    std::uint64_t any = 0;
    for (const Component& other : siblings.components) {
        const bool apart = other.right < w.left || other.left >= w.left + w.width || other.bottom < w.top ||
                           other.top >= w.top + w.height;
        if (apart || other.area_px * kPeerAreas < component.area_px)
            continue;  // crumbs of noise claim nothing
        for (const Run& run : siblings.grouped.subspan(other.first, other.count)) {
            const int y = run.y - w.top;
            const int begin = std::max(0, run.begin - w.left);
            const int end = std::min(w.width, run.end - w.left);
            if (y < 0 || y >= w.height || begin >= end) continue;
            w.foreign[static_cast<std::size_t>(y)] |= bit_span(begin, end);
        }
    }
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) {
        w.foreign[y] &= ~w.blob[y];
        any |= w.foreign[y];
    }
    if (any == 0) return;
    const int steps =
        (std::max(component.right - component.left, component.bottom - component.top) + 1) / 2 + kMoatReach;
    share_out(w.blob, w.foreign, steps, w.width, w.height);
}

// Moat: the pixels from one to three steps outside the blob. Ring: from three to five.
void draw_ring(BlobWorkspace& w) {
    draw_surroundings(w.blob, w.width, w.height, w.moat, w.ring);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) w.ring[y] &= ~w.foreign[y];
}

BitBox ring_box(const BlobWorkspace& w) {
    return widened(w.box, kRingReach, w.width, w.height);
}

struct PlaneFit {
    Plane plane;
    double rms = 0.0;
    bool ok = false;
};

int fixed_point(double value) {
    const double scaled = std::clamp(value, -1e6, 1e6) * kLevelFraction;
    return static_cast<int>(scaled < 0.0 ? scaled - 0.5 : scaled + 0.5);
}

// To the ring pixels whose grey level is within `below` under and `above` over the guess.
PlaneFit fit_plane(const BlobWorkspace& w, const Plane& guess, double below, double above) {
    const LevelBand band{fixed_point(guess.level - below), fixed_point(guess.slope_x),
                         fixed_point(guess.slope_y), std::max(0, fixed_point(below + above))};
    const PlaneSums s = sum_in_band(w, w.ring, ring_box(w), band, guess.centre_x, guess.centre_y);
    PlaneFit fit;
    if (s.n < kMinRing) return fit;
    // Centred normal equations, 2 x 2; every term is below 2^47, exact in doubles.
    const auto count = static_cast<double>(s.n);
    const auto cxx = static_cast<double>(s.n * s.xx - s.x * s.x);
    const auto cxy = static_cast<double>(s.n * s.xy - s.x * s.y);
    const auto cyy = static_cast<double>(s.n * s.yy - s.y * s.y);
    const auto cxv = static_cast<double>(s.n * s.xv - s.x * s.v);
    const auto cyv = static_cast<double>(s.n * s.yv - s.y * s.v);
    const auto cvv = static_cast<double>(s.n * s.vv - s.v * s.v);
    const double determinant = cxx * cyy - cxy * cxy;
    fit.plane.centre_x = guess.centre_x;
    fit.plane.centre_y = guess.centre_y;
    if (determinant > 0.0) {
        fit.plane.slope_x = std::clamp((cxv * cyy - cyv * cxy) / determinant, -255.0, 255.0);
        fit.plane.slope_y = std::clamp((cyv * cxx - cxv * cxy) / determinant, -255.0, 255.0);
    }
    fit.plane.level = (static_cast<double>(s.v) - fit.plane.slope_x * static_cast<double>(s.x) -
                       fit.plane.slope_y * static_cast<double>(s.y)) /
                      count;
    const double rest = cvv - fit.plane.slope_x * cxv - fit.plane.slope_y * cyv;
    fit.rms = rest > 0.0 ? sqrt(rest) / count : 0.0;
    fit.ok = true;
    return fit;
}

// The skin around the blob as a plane. The first fit takes what is on the skin's side of mid contrast; refits
// leave out what is clearly part of something else: other markers, shadows, the dark behind the face.
PlaneFit first_background(const BlobWorkspace& w, const Component& component, int core) {
    Plane guess;
    guess.centre_x = (component.left + component.right) / 2 - w.left;
    guess.centre_y = (component.top + component.bottom) / 2 - w.top;
    guess.level = percentile(w, w.ring, ring_box(w), 50);
    const double depth = std::max(4.0, guess.level - core);
    return fit_plane(w, guess, 0.5 * depth, depth);
}

PlaneFit refined_background(const BlobWorkspace& w, const PlaneFit& fit, int core) {
    const double reach = std::max(6.0, 2.5 * fit.rms);
    const double depth = std::max(4.0, fit.plane.level - core);
    const PlaneFit again = fit_plane(w, fit.plane, std::min(reach, 0.4 * depth + 4.0), reach);
    return again.ok ? again : fit;
}

// Cover of the pixels up to so many around the blob, clamped to -1..2 blobs so that 16 bits hold it. Paint
// scales the light that falls on the skin, so the depth of a whole pixel of blob follows the background's
// gradient; taking it as constant pulls centres towards the bright side (0.15 px on a shaded forehead).
void compute_cover(BlobWorkspace& w, Side side, const Plane& plane, double depth, int around_px) {
    const float black = side == Side::kBelow ? 0.0F : 255.0F;
    const double light = side == Side::kBelow ? 1.0 : -1.0;
    const double centre_light = std::max(1.0, light * (plane.level - static_cast<double>(black)));
    const auto to_share = static_cast<float>(light / centre_light);
    const auto scale = static_cast<float>(kFull / depth);
    const auto slope = static_cast<float>(plane.slope_x);
    const BitBox box = widened(w.box, around_px, w.width, w.height);
    const auto bounded = [](FourFloats v, float least, float most) {
        return less_of(greater_of(v, all_four(least)), all_four(most));
    };
    const auto cover_of = [&](FourFloats level, FourFloats value) {
        const FourFloats share = bounded((level - black) * to_share, kLeastShare, kGreatestShare);
        return bounded((level - value) * scale / share, -256.0F, 512.0F);
    };
    std::array<float, kBlobWindowPx> row_levels;
    for (int y = box.top; y < box.bottom; ++y) {
        row_levels[static_cast<std::size_t>(y)] = static_cast<float>(plane.at(0.0, y));
    }
    for (int x = box.left; x < box.right; x += kPixelLanes) {
        const EightFloats at = floats_of_lanes(counting_lanes(x));
        const EightFloats column{slope * at.low, slope * at.high};
        for (auto y = static_cast<std::size_t>(box.top); y < static_cast<std::size_t>(box.bottom); ++y) {
            const EightFloats value = floats_of_lanes(load_pixels(w.values[y].data() + x, 0));
            const float level = row_levels[y];
            const PixelLanes lanes = truncated_lanes(
                {cover_of(level + column.low, value.low), cover_of(level + column.high, value.high)});
            std::memcpy(w.cover[y].data() + x, &lanes, sizeof(lanes));
        }
    }
}

// Pixels near the old blob whose cover reaches `outline`; inside it, when that is the half outline already:
// cover is known so far around the blob that was found, and no farther.
void mark_covered(const BlobWorkspace& w, int outline, BitRows& covered) {
    const BitBox box = widened(w.box, kRedrawReach, w.width, w.height);
    copy_rows(w.blob, w.height, covered);
    if (outline == kHalf) grow_octagon(covered, w.height);
    for (int y = box.top; y < box.bottom; ++y) {
        const auto row = static_cast<std::size_t>(y);
        covered[row] &=
            covered_bits(w, y, box.left, box.right, outline) & ~w.foreign[row] & row_mask(w.width);
    }
}

// The largest connected piece of `rest`, which loses all its pieces.
int largest_piece(BitRows& rest, int height, const BitBox& box, BitRows& best) {
    BitRows pieces[2];
    BitRows* seed = &pieces[0];
    BitRows* largest = &pieces[1];
    for (BitRows& piece : pieces) std::fill_n(piece.begin(), height, std::uint64_t{0});
    const auto bottom = static_cast<std::size_t>(box.bottom);
    auto y = static_cast<std::size_t>(box.top);
    int best_count = 0;
    for (int piece = 0; piece < 8; ++piece) {  // more pieces than that are noise
        while (y < bottom && rest[y] == 0) ++y;
        if (y == bottom) break;
        std::fill(seed->begin() + box.top, seed->begin() + box.bottom, std::uint64_t{0});
        (*seed)[y] = rest[y] & (~rest[y] + 1);
        flood(*seed, rest, static_cast<int>(y), box.bottom);
        int count = 0;
        for (std::size_t k = y; k < bottom; ++k) {
            if ((*seed)[k] == 0) continue;
            count += ones((*seed)[k]);
            rest[k] &= ~(*seed)[k];
        }
        if (count > best_count) {
            best_count = count;
            std::swap(seed, largest);
        }
    }
    copy_rows(*largest, height, best);
    return best_count;
}

// The blob becomes its own outline at `outline` of the contrast: the largest piece, holes filled (glints).
// False if nothing or less than four fifths of the pixels are in one piece.
bool redraw_blob(BlobWorkspace& w, int outline, Rejection& reason) {
    BitRows& covered = w.scratch;
    mark_covered(w, outline, covered);
    const BitBox near = widened(w.box, kRedrawReach, w.width, w.height);
    const BitBox box = box_of(covered, near.top, near.bottom);
    reason = Rejection::kSmall;
    if (box.top == box.bottom) return false;
    if (is_one_stack(covered, box.top, box.bottom)) {
        copy_rows(covered, w.height, w.blob);
        w.box = box;
        return true;
    }
    const int total = count_bits(covered, box.top, box.bottom);
    BitRows best;
    const int count = largest_piece(covered, w.height, box, best);
    reason = Rejection::kSeveral;
    if ((total - count) * 5 > total) return false;
    copy_rows(best, w.height, w.blob);
    fill_holes(w.blob, w.width, w.height);
    w.box = box_of(w.blob, box.top, box.bottom);
    return true;
}

// The pixels of the blob whose neighbours are all in it; it does not reach the window's border.
void draw_interior(const BlobWorkspace& w, BitRows& inner) {
    std::uint64_t above = 0;
    std::uint64_t here = 0;
    for (int y = w.box.top; y < w.box.bottom; ++y) {
        const auto row = static_cast<std::size_t>(y);
        here = w.blob[row];
        const std::uint64_t below = y + 1 < w.box.bottom ? w.blob[row + 1] : 0;
        const std::uint64_t column = above & here & below;
        inner[row] = column & column << 1 & column >> 1;
        above = here;
    }
}

// Weights of the soft threshold over the blob and one step around it. What lies within it counts as blob
// whatever it looks like: glints that are dimmer than skin.
SoftMoments soft_moments(BlobWorkspace& w, int outline) {
    BitRows& region = w.scratch;
    copy_rows(w.blob, w.height, region);
    grow_square(region, w.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y)
        region[y] &= row_mask(w.width) & ~w.foreign[y] & ~w.hidden[y];
    BitRows inner;
    std::fill_n(inner.begin(), w.height, std::uint64_t{0});
    draw_interior(w, inner);
    const BitBox box = widened(w.box, 1, w.width, w.height);
    const WeightSums s = sum_weights(w, region, w.blob, inner, box, outline, kRamp);
    SoftMoments m;
    if (s.w == 0) return m;
    const auto count = static_cast<double>(s.w);
    m.weight = count / (2 * kRamp);
    m.x = static_cast<double>(s.x + box.left * s.w) / count;
    m.y = static_cast<double>(s.y + box.top * s.w) / count;
    m.xx = static_cast<double>(s.w * s.xx - s.x * s.x) / (count * count);
    m.xy = static_cast<double>(s.w * s.xy - s.x * s.y) / (count * count);
    m.yy = static_cast<double>(s.w * s.yy - s.y * s.y) / (count * count);
    return m;
}

// Mean distance between the outline and the ellipse of equal moments, px: pixels on the wrong side per pixel
// of outline.
double outline_deviation_px(const BlobWorkspace& w, const SoftMoments& m, double mean_radius_px) {
    const double determinant = m.xx * m.yy - m.xy * m.xy;
    if (determinant <= 0.0) return kBlobWindowPx;
    const BitBox box = widened(w.box, 2, w.width, w.height);
    const EllipseRows ellipse(m.x, m.y, m.xx, m.xy, m.yy, 2.0);
    int wrong = 0;
    for (int y = box.top; y < box.bottom; ++y) {
        const auto row = static_cast<std::size_t>(y);
        wrong += ones((ellipse.at(y) ^ w.blob[row]) & ~w.hidden[row]);
    }
    return wrong / (6.283185307179586 * mean_radius_px);
}

double open_part(const BlobWorkspace& w) {
    const BitBox box = widened(w.box, kMoatReach, w.width, w.height);
    int open = 0;
    int total = 0;
    for (int y = box.top; y < box.bottom; ++y) {
        const std::uint64_t moat = w.moat[static_cast<std::size_t>(y)];
        const std::uint64_t dusky = moat & covered_bits(w, y, box.left, box.right, kOpen + 1);
        total += ones(moat);
        if (dusky != 0) open += ones(dusky);
    }
    return total == 0 ? 1.0 : static_cast<double>(open) / total;
}

bool touches_border(const ImageView& image, const BlobWorkspace& w) {
    return (w.left == 0 && w.box.left == 0) || (w.top == 0 && w.box.top == 0) ||
           (w.left + w.width == image.width_px && w.box.right == w.width) ||
           (w.top + w.height == image.height_px && w.box.bottom == w.height);
}

// Outline -> background -> outline, twice unless the first outline was already right.
Rejection outline_at_mid_contrast(Side side, const Component& component, const BlobLimits& limits,
                                  BlobWorkspace& w, PlaneFit& fit, Blob& blob) {
    int pixels = static_cast<int>(component.area_px);
    for (int round = 0; round < kRounds; ++round) {
        draw_ring(w);
        const int core = percentile(w, w.blob, w.box, kCorePercent);
        if (round == 0) fit = first_background(w, component, core);
        if (!fit.ok) return Rejection::kOpen;
        fit = refined_background(w, fit, core);
        blob.background = fit.plane.level;
        blob.contrast = fit.plane.level - core;
        blob.depth =
            blob.contrast / std::max(1.0, side == Side::kBelow ? fit.plane.level : 255.0 - fit.plane.level);
        if (blob.contrast < limits.min_contrast) return Rejection::kFaint;
        compute_cover(w, side, fit.plane, blob.contrast, kRedrawReach);
        Rejection reason = Rejection::kNone;
        if (!redraw_blob(w, kHalf, reason)) return reason;
        const int before = pixels;
        pixels = count_bits(w.blob, w.box.top, w.box.bottom);
        if (std::abs(pixels - before) * 4 <= before) break;
    }
    return Rejection::kNone;
}

void measure_outline(const ImageView& image, const PlaneFit& fit, int outline, const BlobLimits& limits,
                     BlobWorkspace& w, Blob& blob) {
    if (touches_border(image, w)) {
        blob.rejection = Rejection::kEdge;
        return;
    }
    draw_moat(w.blob, w.width, w.height, w.moat);
    blob.hidden = mark_hidden(w, fit.rms / blob.contrast, w.hidden);
    SoftMoments moments = soft_moments(w, outline);
    if (blob.hidden) {
        const double seen = moments.weight;
        moments = complete_moments(moments, w.hidden, w.height);
        blob.filled_in = 1.0 - seen / std::max(seen, moments.weight);
    }
    if (moments.weight <= 0.0) {
        blob.rejection = Rejection::kSmall;
        return;
    }
    set_axes(moments, w.left, w.top, blob);
    blob.deviation = outline_deviation_px(w, moments, mean_radius_px(blob));
    blob.open = open_part(w);
    judge_shape(fit.rms, limits, blob);
}

// Where a fit of its outline may make a marker of a blob: it is not the middle of something larger, and no
// line.
bool has_odd_outline(const BlobLimits& limits, const Blob& blob) {
    const bool closed = blob.open < kMostFollowedOpen;
    const bool line = blob.long_axis_px > kLineAspect * blob.short_axis_px &&
                      blob.long_axis_px > kMostSize * limits.usual_size_px;
    return closed && !line &&
           (blob.rejection == Rejection::kIrregular ||
            (blob.rejection == Rejection::kNone && blob.badness > kSureBadness));
}

bool is_piece(const BlobLimits& limits, const Blob& blob) {
    const bool could_be = blob.rejection == Rejection::kNone || blob.rejection == Rejection::kSmall ||
                          blob.rejection == Rejection::kIrregular || blob.rejection == Rejection::kOpen;
    return could_be && (blob.hidden || blob.long_axis_px < kPieceSize * limits.usual_size_px) &&
           blob.long_axis_px < kMostSize * limits.usual_size_px;
}

// What is tried as a part of a marker, so that it can be put back.
class Drawn {
  public:
    explicit Drawn(const BlobWorkspace& w) : blob_(w.blob), hidden_(w.hidden), box_(w.box) {}
    void put_back(BlobWorkspace& w) const {
        w.blob = blob_;
        w.hidden = hidden_;
        w.box = box_;
    }
    void put_back_blob(BlobWorkspace& w) const {
        w.blob = blob_;
        w.box = box_;
    }

  private:
    BitRows blob_;
    BitRows hidden_;
    BitBox box_;
};

// The marker of which this blob shows a part, with a bite out of it or with something else at it, when there
// is one; else the blob as it was.
void complete_outline(const ImageView& image, const PlaneFit& fit, const BlobLimits& limits, bool of_pieces,
                      BlobWorkspace& w, Blob& blob) {
    Ellipse ellipse;
    const EllipseLimits wanted{.longest_px = kMostSize * limits.usual_size_px,
                               .least_followed = limits.is_lobe ? kLobeFollowed : kLeastFollowed,
                               .disturbed = !limits.is_lobe};
    if (!follow_ellipse(w, kHalf, wanted, ellipse) || !keep_ellipse(ellipse, w)) return;
    w.box = box_of(w.blob, 0, w.height);
    if (touches_border(image, w)) return;
    draw_moat(w.blob, w.width, w.height, w.moat);
    if (limits.is_lobe) {
        for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) w.moat[y] &= ~w.foreign[y];
    }
    const SoftMoments seen = soft_moments(w, kHalf);
    const SoftMoments moments = fill_moments(
        seen, {1.0, ellipse.x, ellipse.y, ellipse.xx, ellipse.xy, ellipse.yy}, w.hidden, w.height);
    if (moments.weight <= 0.0) return;
    Blob whole = blob;
    whole.completed = true;
    whole.filled_in = 1.0 - seen.weight / std::max(seen.weight, moments.weight);
    set_axes(moments, w.left, w.top, whole);
    whole.deviation = outline_deviation_px(w, moments, mean_radius_px(whole));
    whole.open = open_part(w);
    judge_shape(fit.rms, limits, whole);
    whole.badness += kPartBadness * (1.0 - ellipse.followed);
    const double size = whole.long_axis_px / limits.usual_size_px;
    const bool short_one = of_pieces && blob.long_axis_px < kPieceSize * limits.usual_size_px;
    const bool better = whole.badness < blob.badness || blob.rejection != Rejection::kNone || short_one;
    if (size > kLeastSize && size < kMostSize && better && whole.rejection == Rejection::kNone) blob = whole;
}

// The same from all the paint around it that could be of the same marker.
void join_pieces(const ImageView& image, Side side, const PlaneFit& fit, const BlobLimits& limits, double x,
                 double y, BlobWorkspace& w, Blob& blob) {
    const Drawn own(w);
    const double radius = kPieceReach * limits.usual_size_px;
    mark_disc(x, y, radius, w, w.blob);
    w.box = box_of(w.blob, 0, w.height);
    if (w.box.top == w.box.bottom) return;
    compute_cover(w, side, fit.plane, blob.contrast, kMoatReach);
    own.put_back_blob(w);
    w.hidden.fill(0);
    if (gather_pieces(x, y, radius, kHalf, w)) complete_outline(image, fit, limits, true, w, blob);
    if (blob.completed) return;
    own.put_back(w);
}

}  // namespace

Blob measure_blob(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                  const Siblings& siblings, const BlobLimits& limits, BlobWorkspace& w) {
    Blob blob;
    const int width = component.right - component.left + 1;
    const int height = component.bottom - component.top + 1;
    if (std::max(width, height) > static_cast<int>(kMaxDotDiameterPx)) {
        blob.rejection = Rejection::kLarge;
        return blob;
    }
    load_window(image, side, component, runs, margin_of(std::max(width, height), limits), w);
    claim_foreign(component, siblings, w);
    PlaneFit fit;
    blob.rejection = outline_at_mid_contrast(side, component, limits, w, fit, blob);
    const bool several = blob.rejection == Rejection::kSeveral;
    if (blob.rejection != Rejection::kNone && !several) return blob;
    if (!several) {
        compute_cover(w, side, fit.plane, blob.contrast, kMoatReach);
        measure_outline(image, fit, kHalf, limits, w, blob);
    }
    if (may_be_completed(side, limits, blob)) {
        if (several) {
            std::fill_n(w.blob.begin(), w.height, std::uint64_t{0});
            join_pieces(image, side, fit, limits, 0.5 * (component.left + component.right) - w.left,
                        0.5 * (component.top + component.bottom) - w.top, w, blob);
        } else if (!limits.is_lobe && is_piece(limits, blob)) {
            join_pieces(image, side, fit, limits, blob.x_px - w.left, blob.y_px - w.top, w, blob);
        }
        if (!several && !blob.completed && (limits.is_lobe || has_odd_outline(limits, blob))) {
            compute_cover(w, side, fit.plane, blob.contrast, kRedrawReach + kMoatReach);
            const Drawn own(w);
            complete_outline(image, fit, limits, false, w, blob);
            if (!blob.completed) own.put_back_blob(w);
        }
    }
    Rejection reason = Rejection::kNone;
    if (!blob.completed && looks_shadowed(blob) && redraw_blob(w, kDeep, reason)) {
        measure_outline(image, fit, kDeep, limits, w, blob);
        blob.badness += kDeepBadness;
    }
    return blob;
}

}  // namespace rig
