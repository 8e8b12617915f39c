#include "core/detect/blob.hpp"

#include <algorithm>

#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr int kMargin = 8;         // px of surroundings on every side of the component
constexpr int kFull = 256;         // cover of a pixel that is all blob
constexpr int kHalf = kFull / 2;
constexpr int kRampLow = 64;       // the soft threshold: weight 0 up to a quarter of the contrast,
constexpr int kRampHigh = 192;     // 1 from three quarters on, linear between
constexpr int kOpenCover = 112;    // a moat pixel darker than this is no background
constexpr int kMinRing = 12;       // pixels that can carry a plane
constexpr int kRounds = 2;         // outline -> background -> outline

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

struct Moments {
    double weight = 0.0;
    double x = 0.0;
    double y = 0.0;
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
};

template <class Visit>
void for_each_bit(const BitRows& rows, int height, Visit visit) {
    for (int y = 0; y < height; ++y) {
        for (std::uint64_t bits = rows[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
            visit(std::countr_zero(bits), y);
        }
    }
}

int value_at(const BlobWorkspace& w, int x, int y) {
    return w.values[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
}

int cover_at(const BlobWorkspace& w, int x, int y) {
    return w.cover[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
}

void load_window(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                 BlobWorkspace& w) {
    w.left = std::max(0, component.left - kMargin);
    w.top = std::max(0, component.top - kMargin);
    w.width = std::min(image.width_px, component.right + 1 + kMargin) - w.left;
    w.height = std::min(image.height_px, component.bottom + 1 + kMargin) - w.top;
    const std::uint8_t turn = side == Side::kAbove ? 255 : 0;
    for (int y = 0; y < w.height; ++y) {
        const std::uint8_t* pixels = image.row(w.top + y) + w.left;
        auto& row = w.values[static_cast<std::size_t>(y)];
        for (std::size_t x = 0; x < static_cast<std::size_t>(w.width); ++x) row[x] = pixels[x] ^ turn;
    }
    w.blob.fill(0);
    for (const Run& run : runs) {
        w.blob[static_cast<std::size_t>(run.y - w.top)] |= bit_span(run.begin - w.left, run.end - w.left);
    }
}

// Moat: the pixels from one to three steps outside the blob. Ring: from three to six steps.
void draw_surroundings(BlobWorkspace& w) {
    const std::uint64_t mask = row_mask(w.width);
    BitRows& grown = w.scratch;
    grown = w.blob;
    grow_square(grown, w.height);
    const BitRows inner = grown;
    grow_cross(grown, w.height);
    grow_square(grown, w.height);
    const BitRows middle = grown;
    grow_cross(grown, w.height);
    grow_square(grown, w.height);
    grow_cross(grown, w.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) {
        w.moat[y] = middle[y] & ~inner[y] & mask;
        w.ring[y] = grown[y] & ~middle[y] & mask;
    }
}

// The value that `percent` of the pixels lie below or at; 0 for an empty set.
int percentile(const BitRows& rows, int percent, BlobWorkspace& w) {
    w.histogram.fill(0);
    std::uint32_t count = 0;
    for_each_bit(rows, w.height, [&](int x, int y) {
        ++w.histogram[static_cast<std::size_t>(value_at(w, x, y))];
        ++count;
    });
    const std::uint32_t rank = count * static_cast<std::uint32_t>(percent) / 100;
    std::uint32_t seen = 0;
    for (std::size_t v = 0; v < 256; ++v) {
        seen += w.histogram[v];
        if (seen > rank) return static_cast<int>(v);
    }
    return 0;
}

struct PlaneFit {
    Plane plane;
    double rms = 0.0;
    bool ok = false;
};

// Least squares over the ring pixels within `reach` grey levels of `guess`. Sums are integers, so their order is free.
PlaneFit fit_plane(const BlobWorkspace& w, const Plane& guess, double reach_below, double reach_above) {
    std::int64_t n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sv = 0, sxv = 0, syv = 0, svv = 0;
    for_each_bit(w.ring, w.height, [&](int px, int py) {
        const int v = value_at(w, px, py);
        const double rest = v - guess.at(px, py);
        if (rest < -reach_below || rest > reach_above) return;
        const std::int64_t x = px - guess.centre_x;
        const std::int64_t y = py - guess.centre_y;
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
        sv += v, sxv += x * v, syv += y * v, svv += std::int64_t{v} * v;
    });
    PlaneFit fit;
    if (n < kMinRing) return fit;
    // All terms are below 2^47: exact in doubles. Centred normal equations, 2 x 2.
    const auto count = static_cast<double>(n);
    const auto cxx = static_cast<double>(n * sxx - sx * sx);
    const auto cxy = static_cast<double>(n * sxy - sx * sy);
    const auto cyy = static_cast<double>(n * syy - sy * sy);
    const auto cxv = static_cast<double>(n * sxv - sx * sv);
    const auto cyv = static_cast<double>(n * syv - sy * sv);
    const auto cvv = static_cast<double>(n * svv - sv * sv);
    const double determinant = cxx * cyy - cxy * cxy;
    fit.plane = guess;
    fit.plane.slope_x = 0.0;
    fit.plane.slope_y = 0.0;
    if (determinant > 0.0) {
        fit.plane.slope_x = (cxv * cyy - cyv * cxy) / determinant;
        fit.plane.slope_y = (cyv * cxx - cxv * cxy) / determinant;
    }
    fit.plane.level = (static_cast<double>(sv) - fit.plane.slope_x * static_cast<double>(sx) -
                       fit.plane.slope_y * static_cast<double>(sy)) / count;
    const double rest = cvv - fit.plane.slope_x * cxv - fit.plane.slope_y * cyv;
    fit.rms = rest > 0.0 ? sqrt(rest) / count : 0.0;
    fit.ok = true;
    return fit;
}

// The skin around the blob as a plane: pixels that are clearly part of something else are left out by two refits.
PlaneFit fit_background(BlobWorkspace& w, const Component& component, int core) {
    Plane guess;
    guess.centre_x = (component.left + component.right) / 2 - w.left;
    guess.centre_y = (component.top + component.bottom) / 2 - w.top;
    guess.level = percentile(w.ring, 50, w);
    const double depth = std::max(4.0, guess.level - core);
    PlaneFit fit = fit_plane(w, guess, 0.5 * depth, depth);
    if (!fit.ok) return fit;
    for (int round = 0; round < 2; ++round) {
        const double reach = std::max(6.0, 2.5 * fit.rms);
        const PlaneFit again = fit_plane(w, fit.plane, std::min(reach, 0.4 * depth + 4.0), reach);
        if (!again.ok) break;
        fit = again;
    }
    return fit;
}

// Cover of every pixel of the window, clamped to -1..2 blobs so that 16 bits hold it.
void compute_cover(BlobWorkspace& w, const Plane& plane, double depth) {
    const double scale = kFull / depth;
    for (int y = 0; y < w.height; ++y) {
        const auto& values = w.values[static_cast<std::size_t>(y)];
        auto& cover = w.cover[static_cast<std::size_t>(y)];
        const double row_level = plane.level + plane.slope_y * (y - plane.centre_y) - plane.slope_x * plane.centre_x;
        for (int x = 0; x < w.width; ++x) {
            const double level = row_level + plane.slope_x * x;
            const double c = (level - values[static_cast<std::size_t>(x)]) * scale;
            cover[static_cast<std::size_t>(x)] = static_cast<std::int16_t>(std::clamp(c, -256.0, 512.0));
        }
    }
}

// The outline at mid contrast: the piece that holds most of the old blob, holes filled. False if nothing is left;
// `pieces` is the part of the old blob's mid-contrast pixels that lies in other pieces.
bool redraw_blob(BlobWorkspace& w, double& pieces) {
    BitRows allowed = w.blob;
    grow_square(allowed, w.height);
    grow_cross(allowed, w.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) {
        std::uint64_t bits = 0;
        for (std::size_t x = 0; x < static_cast<std::size_t>(w.width); ++x) {
            bits |= std::uint64_t{w.cover[y][x] >= kHalf} << x;
        }
        allowed[y] &= bits;
    }
    const int total = count_bits(allowed, w.height);
    BitRows best{};
    int best_count = 0;
    BitRows rest = allowed;
    for (int piece = 0; piece < 8; ++piece) {  // more pieces than that are noise
        std::size_t y = 0;
        while (y < static_cast<std::size_t>(w.height) && rest[y] == 0) ++y;
        if (y == static_cast<std::size_t>(w.height)) break;
        BitRows seed{};
        seed[y] = rest[y] & (~rest[y] + 1);
        flood(seed, rest, w.height);
        const int count = count_bits(seed, w.height);
        for (std::size_t k = 0; k < static_cast<std::size_t>(w.height); ++k) rest[k] &= ~seed[k];
        if (count > best_count) {
            best = seed;
            best_count = count;
        }
    }
    if (best_count == 0) return false;
    pieces = static_cast<double>(total - best_count) / total;
    w.blob = best;
    fill_holes(w.blob, w.width, w.height);
    return true;
}

// Weights of the soft threshold over the blob and two steps around it; filled holes count as blob.
Moments soft_moments(BlobWorkspace& w) {
    BitRows& region = w.scratch;
    region = w.blob;
    grow_square(region, w.height);
    const BitRows& inside = w.blob;
    std::int64_t n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    for_each_bit(region, w.height, [&](int x, int y) {
        int cover = cover_at(w, x, y);
        if ((inside[static_cast<std::size_t>(y)] >> x & 1U) != 0) cover = std::max(cover, kHalf);
        const std::int64_t weight = std::clamp(cover, kRampLow, kRampHigh) - kRampLow;
        n += weight, sx += weight * x, sy += weight * y;
        sxx += weight * x * x, sxy += weight * x * y, syy += weight * y * y;
    });
    Moments m;
    if (n == 0) return m;
    const auto count = static_cast<double>(n);
    m.weight = count / (kRampHigh - kRampLow);
    m.x = static_cast<double>(sx) / count;
    m.y = static_cast<double>(sy) / count;
    m.xx = static_cast<double>(n * sxx - sx * sx) / (count * count);
    m.xy = static_cast<double>(n * sxy - sx * sy) / (count * count);
    m.yy = static_cast<double>(n * syy - sy * sy) / (count * count);
    return m;
}

// Mean distance between the outline and the ellipse of equal moments, px: pixels on the wrong side per pixel of outline.
double outline_deviation_px(const BlobWorkspace& w, const Moments& m, double mean_radius_px) {
    const double determinant = m.xx * m.yy - m.xy * m.xy;
    if (determinant <= 0.0) return kBlobWindowPx;
    int wrong = 0;
    for (int y = 0; y < w.height; ++y) {
        const double dy = y - m.y;
        const std::uint64_t row = w.blob[static_cast<std::size_t>(y)];
        for (int x = 0; x < w.width; ++x) {
            const double dx = x - m.x;
            const double form = (m.yy * dx * dx - 2.0 * m.xy * dx * dy + m.xx * dy * dy) / determinant;
            wrong += static_cast<int>((form <= 4.0) != ((row >> x & 1U) != 0));
        }
    }
    return wrong / (6.283185307179586 * mean_radius_px);
}

double open_part(const BlobWorkspace& w) {
    int open = 0;
    int total = 0;
    for_each_bit(w.moat, w.height, [&](int x, int y) {
        open += cover_at(w, x, y) > kOpenCover ? 1 : 0;
        ++total;
    });
    return total == 0 ? 1.0 : static_cast<double>(open) / total;
}

void judge(const BlobWorkspace& w, const Moments& m, const PlaneFit& fit, const BlobLimits& limits, Blob& blob) {
    const double mean = 0.5 * (m.xx + m.yy);
    const double half = 0.5 * (m.xx - m.yy);
    const double spread = sqrt(half * half + m.xy * m.xy);
    blob.x_px = w.left + m.x;
    blob.y_px = w.top + m.y;
    blob.long_axis_px = 4.0 * sqrt(mean + spread);
    blob.short_axis_px = 4.0 * sqrt(std::max(mean - spread, 1.0 / 64.0));
    blob.diameter_px = 1.1283791670955126 * sqrt(m.weight);
    const double radius = 0.5 * sqrt(blob.long_axis_px * blob.short_axis_px);
    blob.deviation = outline_deviation_px(w, m, radius);
    blob.open = open_part(w);
    const double aspect = blob.long_axis_px / blob.short_axis_px;
    const double deviation_limit = 0.12 + 0.05 * radius;
    const double snr = blob.contrast / std::max(1.0, fit.rms);
    blob.score = std::clamp(1.0 - 0.5 * blob.deviation / deviation_limit, 0.0, 1.0) *
                 std::clamp(1.0 - 0.5 * blob.open / limits.max_open, 0.0, 1.0) * std::clamp(snr / 8.0, 0.25, 1.0) *
                 std::clamp(1.5 - 0.5 * aspect / limits.max_aspect, 0.0, 1.0);
    blob.score = std::min(blob.score, 1.0);
    blob.rejection = Rejection::kNone;
    if (blob.diameter_px < limits.min_diameter_px) {
        blob.rejection = Rejection::kSmall;
    } else if (blob.long_axis_px > limits.max_diameter_px) {
        blob.rejection = Rejection::kLarge;
    } else if (snr < 2.5) {
        blob.rejection = Rejection::kFaint;
    } else if (aspect > limits.max_aspect) {
        blob.rejection = Rejection::kElongated;
    } else if (blob.open > limits.max_open) {
        blob.rejection = Rejection::kOpen;
    } else if (blob.deviation > deviation_limit) {
        blob.rejection = Rejection::kIrregular;
    }
}

bool touches_border(const ImageView& image, const BlobWorkspace& w) {
    const auto last = static_cast<std::size_t>(w.height - 1);
    std::uint64_t any = 0;
    for (std::size_t y = 0; y <= last; ++y) any |= w.blob[y];
    return (w.left == 0 && (any & 1U) != 0) || (w.top == 0 && w.blob[0] != 0) ||
           (w.left + w.width == image.width_px && (any >> (w.width - 1) & 1U) != 0) ||
           (w.top + w.height == image.height_px && w.blob[last] != 0);
}

}  // namespace

Blob measure_blob(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                  const BlobLimits& limits, BlobWorkspace& w) {
    Blob blob;
    const int width = component.right - component.left + 1;
    const int height = component.bottom - component.top + 1;
    if (std::max(width, height) > static_cast<int>(kMaxDotDiameterPx)) {
        blob.rejection = Rejection::kLarge;
        return blob;
    }
    load_window(image, side, component, runs, w);
    PlaneFit fit;
    double pieces = 0.0;
    for (int round = 0; round < kRounds; ++round) {
        draw_surroundings(w);
        const int core = percentile(w.blob, 30, w);
        fit = fit_background(w, component, core);
        if (!fit.ok) {
            blob.rejection = Rejection::kOpen;
            return blob;
        }
        const Moments rough = Moments{};
        (void)rough;
        blob.background = fit.plane.level;
        blob.contrast = fit.plane.level - core;
        if (blob.contrast < limits.min_contrast) {
            blob.rejection = Rejection::kFaint;
            return blob;
        }
        compute_cover(w, fit.plane, blob.contrast);
        if (!redraw_blob(w, pieces)) return blob;
        if (pieces > 0.2) {
            blob.rejection = Rejection::kSeveral;
            return blob;
        }
    }
    if (touches_border(image, w)) {
        blob.rejection = Rejection::kEdge;
        return blob;
    }
    draw_surroundings(w);
    const Moments moments = soft_moments(w);
    if (moments.weight <= 0.0) return blob;
    judge(w, moments, fit, limits, blob);
    return blob;
}

}  // namespace rig
