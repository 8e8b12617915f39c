#include "core/detect/hidden_part.hpp"

#include <algorithm>
#include <bit>

#include "core/base/math.hpp"
#include "core/detect/window_sums.hpp"

namespace rig {

namespace {

constexpr double kFull = 256.0;      // cover of a pixel that is all blob
constexpr double kLeastNoise = 4.0;  // beyond the skin's level, in units of its own deviation
constexpr int kNearReach = 2;        // px outside the blob where something may hide it
constexpr int kRounds = 12;          // halve what is left, or better, up to three quarters of the way hidden
constexpr double kStride = 2.0;      // of each; the plain step (1) falls short by the hidden part of the rim
constexpr double kMostHidden = 0.4;  // of the ellipse

// Sums of weight, x, y, xx, xy, yy.
struct Sums {
    double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
};

Sums sums_of(const SoftMoments& m) {
    return {m.weight,
            m.weight * m.x,
            m.weight * m.y,
            m.weight * (m.xx + m.x * m.x),
            m.weight * (m.xy + m.x * m.y),
            m.weight * (m.yy + m.y * m.y)};
}

SoftMoments moments_of(const Sums& s) {
    SoftMoments m;
    m.weight = s.w;
    m.x = s.x / s.w;
    m.y = s.y / s.w;
    m.xx = s.xx / s.w - m.x * m.x;
    m.xy = s.xy / s.w - m.x * m.y;
    m.yy = s.yy / s.w - m.y * m.y;
    return m;
}

// What the hidden pixels weigh if the marker is the ellipse of these moments, with an edge one pixel wide.
Sums hidden_sums(const SoftMoments& m, const BitRows& hidden, int height) {
    Sums s;
    const double determinant = m.xx * m.yy - m.xy * m.xy;
    if (!(determinant > 0.0)) return s;
    const double radius = 2.0 * sqrt(sqrt(determinant));  // of the circle of equal area
    for (int y = 0; y < height; ++y) {
        for (std::uint64_t bits = hidden[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
            const double px = std::countr_zero(bits);
            const double dx = px - m.x;
            const double dy = y - m.y;
            const double square = (m.yy * dx * dx - 2.0 * m.xy * dx * dy + m.xx * dy * dy) / determinant;
            const double weight = std::clamp((1.0 - 0.5 * sqrt(square)) * radius + 0.5, 0.0, 1.0);
            s.w += weight, s.x += weight * px, s.y += weight * y;
            s.xx += weight * px * px, s.xy += weight * px * y, s.yy += weight * y * y;
        }
    }
    return s;
}

SoftMoments step_towards(const SoftMoments& from, const SoftMoments& to, double stride) {
    const auto step = [stride](double a, double b) { return a + stride * (b - a); };
    return {step(from.weight, to.weight), step(from.x, to.x),   step(from.y, to.y),
            step(from.xx, to.xx),         step(from.xy, to.xy), step(from.yy, to.yy)};
}

}  // namespace

bool mark_hidden(const BlobWorkspace& w, double noise_cover, BitRows& hidden) {
    const double limit = -kFull * std::max(kHiddenCover, kLeastNoise * noise_cover);
    const auto least = static_cast<int>(std::max(limit, -2.0 * kFull));  // no cover is that low
    BitRows near;
    copy_rows(w.blob, w.height, near);
    grow_octagon(near, w.height);
    std::fill_n(hidden.begin(), w.height, std::uint64_t{0});
    const std::uint64_t mask = row_mask(w.width);
    const BitBox box = widened(w.box, kNearReach, w.width, w.height);
    std::uint64_t any = 0;
    for (int y = box.top; y < box.bottom; ++y) {
        const auto row = static_cast<std::size_t>(y);
        hidden[row] = near[row] & ~covered_bits(w, y, box.left, box.right, least) & mask;
        any |= hidden[row];
    }
    if (any == 0) return false;
    grow_square(hidden, w.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) hidden[y] &= row_mask(w.width);
    return true;
}

SoftMoments complete_moments(const SoftMoments& seen, const BitRows& hidden, int height) {
    if (seen.weight <= 0.0) return seen;
    const Sums known = sums_of(seen);
    SoftMoments whole = seen;
    for (int round = 0; round < kRounds; ++round) {
        const Sums more = hidden_sums(whole, hidden, height);
        if (more.w > kMostHidden * (known.w + more.w)) return seen;
        const SoftMoments next = moments_of({known.w + more.w, known.x + more.x, known.y + more.y,
                                             known.xx + more.xx, known.xy + more.xy, known.yy + more.yy});
        whole = step_towards(whole, next, round + 1 < kRounds ? kStride : 1.0);
        if (!(whole.xx > 0.0 && whole.xx * whole.yy > whole.xy * whole.xy)) return seen;
    }
    return whole;
}

SoftMoments fill_moments(const SoftMoments& seen, const SoftMoments& ellipse, const BitRows& hidden,
                         int height) {
    if (seen.weight <= 0.0) return seen;
    const Sums known = sums_of(seen);
    const Sums more = hidden_sums(ellipse, hidden, height);
    return moments_of({known.w + more.w, known.x + more.x, known.y + more.y, known.xx + more.xx,
                       known.xy + more.xy, known.yy + more.yy});
}

}  // namespace rig
