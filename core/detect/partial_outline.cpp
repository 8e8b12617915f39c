#include "core/detect/partial_outline.hpp"

#include <algorithm>
#include <bit>

#include "core/base/bounded_vector.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

struct Point {
    double x = 0.0;
    double y = 0.0;
};

constexpr std::size_t kMaxPoints = 256;
constexpr std::size_t kMinPoints = 10;
constexpr std::size_t kUnknowns = 5;
constexpr double kFollows = 0.45;                        // px between the ellipse and what follows it
constexpr std::array kReaches{1.2, 0.8, 0.5, 0.4, 0.4};  // px, of rounds after the first
constexpr double kDiagonal = 0.70710678118654752;
constexpr std::array<Point, 8> kDirections{{{1.0, 0.0},
                                            {kDiagonal, kDiagonal},
                                            {0.0, 1.0},
                                            {-kDiagonal, kDiagonal},
                                            {-1.0, 0.0},
                                            {-kDiagonal, -kDiagonal},
                                            {0.0, -1.0},
                                            {kDiagonal, -kDiagonal}}};
constexpr double kLeftOutCosine2 = 0.4;          // 51 degrees to either side
constexpr double kAgreed = 0.85;                 // part followed times part filled
constexpr int kSectors = 16;                     // of the rim
constexpr double kEighth = 0.41421356237309503;  // tangent of an eighth of half a turn
constexpr double kInside = 0.8;                  // px within the ellipse where there should be paint,
constexpr double kOutside = 1.0;                 // and outside it where there should be none
constexpr double kRimPx = 1.0;                   // what reaches so far out goes on beyond
constexpr int kLeastPiece = 3;                   // pixels
constexpr double kLeastFilled = 0.5;

using Points = BoundedVector<Point, kMaxPoints>;

// a x^2 + b xy + c y^2 + d x + e y = 1
using Conic = std::array<double, kUnknowns>;

bool has(const BitRows& rows, int x, int y) {
    return (rows[static_cast<std::size_t>(y)] >> x & 1U) != 0;
}

// Where cover passes the outline between a pixel of the blob and one beside it.
void gather_points(const BlobWorkspace& w, int outline, Points& points) {
    const auto cover = [&](int x, int y) {
        return static_cast<double>(w.cover[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)]);
    };
    for (int y = 1; y + 1 < w.height; ++y) {
        for (std::uint64_t bits = w.blob[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
            const int x = std::countr_zero(bits);
            if (x == 0 || x + 1 >= w.width) continue;
            constexpr std::array<std::array<int, 2>, 4> kSteps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
            for (const auto& step : kSteps) {
                if (has(w.blob, x + step[0], y + step[1])) continue;
                if (has(w.foreign, x + step[0], y + step[1])) continue;
                const double in = cover(x, y) - outline;
                const double out = cover(x + step[0], y + step[1]) - outline;
                const double part = in > 0.0 && out < 0.0 ? in / (in - out) : 0.5;
                if (!points.push_back({x + part * step[0], y + part * step[1]})) return;
            }
        }
    }
}

// Cholesky; false when the points do not fix a conic.
bool solve(std::array<std::array<double, kUnknowns>, kUnknowns>& m, Conic& right) {
    for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = m[i][j];
            for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
            if (i != j) {
                m[i][j] = sum / m[j][j];
            } else if (sum > 1e-12 * m[i][i]) {
                m[i][i] = sqrt(sum);
            } else {
                return false;
            }
        }
    }
    for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t k = 0; k < i; ++k) right[i] -= m[i][k] * right[k];
        right[i] /= m[i][i];
    }
    for (std::size_t i = kUnknowns; i-- > 0;) {
        for (std::size_t k = i + 1; k < kUnknowns; ++k) right[i] -= m[k][i] * right[k];
        right[i] /= m[i][i];
    }
    return true;
}

// Signed distance to first order, px, and the conic's slope there.
double distance_to(const Conic& q, const Point& p, double& slope) {
    const double value =
        q[0] * p.x * p.x + q[1] * p.x * p.y + q[2] * p.y * p.y + q[3] * p.x + q[4] * p.y - 1.0;
    const double gx = 2.0 * q[0] * p.x + q[1] * p.y + q[3];
    const double gy = q[1] * p.x + 2.0 * q[2] * p.y + q[4];
    slope = sqrt(gx * gx + gy * gy) + 1e-12;
    return value / slope;
}

bool fit_conic(std::span<const Point> points, double reach, Conic& conic) {
    std::array<std::array<double, kUnknowns>, kUnknowns> m{};
    Conic right{};
    for (const Point& p : points) {
        double weight = 1.0;
        if (reach > 0.0) {
            double slope = 0.0;
            const double off = distance_to(conic, p, slope) / reach;
            const double fall = 1.0 / (1.0 + off * off);
            weight = fall * fall / (slope * slope);
        }
        const Conic row{p.x * p.x, p.x * p.y, p.y * p.y, p.x, p.y};
        for (std::size_t i = 0; i < kUnknowns; ++i) {
            const double scaled = weight * row[i];
            for (std::size_t j = 0; j <= i; ++j) m[i][j] += scaled * row[j];
            right[i] += scaled;
        }
    }
    if (!solve(m, right)) return false;
    conic = right;
    return true;
}

bool ellipse_of(const Conic& q, const Point& origin, Ellipse& ellipse) {
    const double determinant = 4.0 * q[0] * q[2] - q[1] * q[1];
    if (!(determinant > 0.0) || !(q[0] > 0.0)) return false;
    const double x = (q[1] * q[4] - 2.0 * q[2] * q[3]) / determinant;
    const double y = (q[1] * q[3] - 2.0 * q[0] * q[4]) / determinant;
    const double k = 1.0 + q[0] * x * x + q[1] * x * y + q[2] * y * y;
    // Moments: a quarter of the inverse of the quadratic form.
    const double scale = k / determinant;
    ellipse.x = origin.x + x;
    ellipse.y = origin.y + y;
    ellipse.xx = scale * q[2];
    ellipse.xy = -0.5 * scale * q[1];
    ellipse.yy = scale * q[0];
    return ellipse.xx > 0.0 && ellipse.xx < 1e4 && ellipse.yy < 1e4;
}

// Part of the rim, in equal steps of the angle at which it is a circle, with a point of the outline on it.
double followed_part(std::span<const Point> points, const Conic& conic, const Point& origin,
                     const Ellipse& e) {
    const double ux = 1.0 / sqrt(e.xx);
    const double lean = e.xy / e.xx;
    const double vy = 1.0 / sqrt(std::max(1e-9, e.yy - lean * e.xy));
    std::uint32_t sectors = 0;
    for (const Point& p : points) {
        double slope = 0.0;
        const double off = distance_to(conic, p, slope);
        if (off > kFollows || off < -kFollows) continue;
        const double dx = origin.x + p.x - e.x;
        const double u = ux * dx;
        const double v = vy * (origin.y + p.y - e.y - lean * dx);
        const double long_side = std::max(u < 0.0 ? -u : u, v < 0.0 ? -v : v);
        const double short_side = std::min(u < 0.0 ? -u : u, v < 0.0 ? -v : v);
        const int sector = (u < 0.0 ? 8 : 0) + (v < 0.0 ? 4 : 0) +
                           ((u < 0.0 ? -u : u) < (v < 0.0 ? -v : v) ? 2 : 0) +
                           (short_side > kEighth * long_side ? 1 : 0);
        sectors |= 1U << sector;
    }
    return static_cast<double>(ones(sectors)) / kSectors;
}

double long_axis_px(const Ellipse& e) {
    const double half = 0.5 * (e.xx - e.yy);
    return 4.0 * sqrt(0.5 * (e.xx + e.yy) + sqrt(half * half + e.xy * e.xy));
}

// Pixels of row y within the ellipse grown by `by` px, as a span of bits.
std::uint64_t span_of(const Ellipse& e, int y, double by) {
    const double mean = sqrt(sqrt(std::max(1e-9, e.xx * e.yy - e.xy * e.xy)));  // half the mean radius
    const double grown = std::max(0.0, 2.0 + by / mean);
    const double dy = y - e.y;
    const double root = grown * grown - dy * dy / e.yy;
    if (!(root > 0.0)) return 0;
    const double half = sqrt(root * std::max(0.0, e.xx - e.xy * e.xy / e.yy));
    const double middle = e.x + e.xy / e.yy * dy;
    const auto begin = static_cast<int>(std::clamp(middle - half, 0.0, 63.0) + 0.999999);
    const auto end = static_cast<int>(std::clamp(middle + half, -1.0, 63.0) + 1.0);
    return begin < end ? bit_span(begin, end) : 0;
}

// Of the ellipse, the part that is paint.
double filled_part(const Ellipse& ellipse, const BlobWorkspace& w) {
    int all = 0;
    int paint = 0;
    for (int y = 0; y < w.height; ++y) {
        const std::uint64_t inner = span_of(ellipse, y, -kInside) & row_mask(w.width);
        all += ones(inner);
        paint += ones(inner & w.blob[static_cast<std::size_t>(y)]);
    }
    return all == 0 ? 0.0 : static_cast<double>(paint) / all;
}

// Leaves out what lies within an eighth of a turn or so of a direction.
void leave_out(const Point& direction, Points& points) {
    std::size_t kept = 0;
    for (const Point& p : points) {
        const double along = p.x * direction.x + p.y * direction.y;
        if (along > 0.0 && along * along > kLeftOutCosine2 * (p.x * p.x + p.y * p.y)) continue;
        points[kept++] = p;
    }
    points.resize(kept);
}

bool fit_in_rounds(std::span<const Point> some, std::span<const Point> all, Conic& conic) {
    if (some.size() < kMinPoints || !fit_conic(some, 0.0, conic)) return false;
    for (const double reach : kReaches) {
        if (!fit_conic(all, reach, conic)) return false;
    }
    return true;
}

}  // namespace

void mark_disc(double x, double y, double radius, const BlobWorkspace& w, BitRows& disc) {
    const Ellipse circle{x, y, 0.25 * radius * radius, 0.0, 0.25 * radius * radius};
    disc.fill(0);
    for (int row = 0; row < w.height; ++row) {
        disc[static_cast<std::size_t>(row)] = span_of(circle, row, 0.0) & row_mask(w.width);
    }
}

bool gather_pieces(double x, double y, double radius, int outline, BlobWorkspace& w) {
    BitRows disc;
    BitRows inner;
    mark_disc(x, y, radius, w, disc);
    mark_disc(x, y, radius - kRimPx, w, inner);
    BitRows paint{};
    BitRows leaving{};
    for (std::size_t row = 0; row < static_cast<std::size_t>(w.height); ++row) {
        for (std::uint64_t bits = disc[row] & ~w.foreign[row]; bits != 0; bits &= bits - 1) {
            const auto column = static_cast<std::size_t>(std::countr_zero(bits));
            if (w.cover[row][column] >= outline) paint[row] |= std::uint64_t{1} << column;
        }
        leaving[row] = paint[row] & ~inner[row];
    }
    flood(leaving, paint, w.height);
    const int before = count_bits(w.blob, 0, w.height);
    for (std::size_t row = 0; row < static_cast<std::size_t>(w.height); ++row) paint[row] &= ~leaving[row];
    if (count_bits(paint, 0, w.height) < before + kLeastPiece) return false;
    w.blob = paint;
    return true;
}

bool follow_ellipse(const BlobWorkspace& w, int outline, const EllipseLimits& limits, Ellipse& ellipse) {
    Points points;
    gather_points(w, outline, points);
    if (points.size() < kMinPoints) return false;
    Point origin;
    for (const Point& p : points) origin.x += p.x, origin.y += p.y;
    origin.x /= static_cast<double>(points.size());
    origin.y /= static_cast<double>(points.size());
    for (Point& p : points) p.x -= origin.x, p.y -= origin.y;
    double best = 0.0;
    const std::size_t last = limits.disturbed ? kDirections.size() : 0;
    // From all points, and then, unless those agree, without those on one side after the other.
    for (std::size_t start = 0; start <= last && best < kAgreed; ++start) {
        Points some = points;
        if (start > 0) leave_out(kDirections[start - 1], some);
        Conic conic{};
        Ellipse fitted;
        if (!fit_in_rounds(some.span(), points.span(), conic) || !ellipse_of(conic, origin, fitted)) continue;
        if (long_axis_px(fitted) > limits.longest_px) continue;
        fitted.followed = followed_part(points.span(), conic, origin, fitted);
        const double quality = fitted.followed * filled_part(fitted, w);
        if (quality <= best) continue;
        best = quality;
        ellipse = fitted;
    }
    return ellipse.followed >= limits.least_followed && best > 0.0;
}

bool keep_ellipse(const Ellipse& ellipse, BlobWorkspace& w) {
    int all = 0;
    int paint = 0;
    for (int y = 0; y < w.height; ++y) {
        const auto row = static_cast<std::size_t>(y);
        const std::uint64_t mask = row_mask(w.width);
        const std::uint64_t inner = span_of(ellipse, y, -kInside) & mask;
        const std::uint64_t outer = span_of(ellipse, y, kOutside) & mask;
        w.hidden[row] |= (inner & ~w.blob[row]) | (w.blob[row] & ~outer);
        all += ones(inner);
        paint += ones(inner & w.blob[row]);
        w.blob[row] &= outer;
    }
    grow_square(w.hidden, w.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(w.height); ++y) w.hidden[y] &= row_mask(w.width);
    return all > 0 && paint >= kLeastFilled * all;
}

}  // namespace rig
