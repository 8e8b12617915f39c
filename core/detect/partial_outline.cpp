#include "core/detect/partial_outline.hpp"

#include <algorithm>
#include <bit>

#include "core/base/dense.hpp"
#include "core/base/math.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

struct Point {
    float x = 0.0F;
    float y = 0.0F;
};

constexpr std::size_t kMaxPoints = 256;
constexpr std::size_t kMinPoints = 10;
constexpr std::size_t kUnknowns = 5;
constexpr float kFollows = 0.45F;                // px between the ellipse and what follows it
constexpr float kMayFollow = 1.2F;               // px, of what may follow it after the rounds to come
constexpr std::array kFirstReaches{1.2F, 0.8F};  // px, of rounds after the one of equal weights
constexpr std::array kLastReaches{0.5F, 0.4F, 0.4F};
constexpr double kSamePx = 0.05;    // centres of two ellipses that are one,
constexpr double kSamePart = 0.02;  // and their moments, relative
constexpr float kDiagonal = 0.70710678118654752F;
constexpr std::array<Point, 8> kDirections{{{1.0F, 0.0F},
                                            {kDiagonal, kDiagonal},
                                            {0.0F, 1.0F},
                                            {-kDiagonal, kDiagonal},
                                            {-1.0F, 0.0F},
                                            {-kDiagonal, -kDiagonal},
                                            {0.0F, -1.0F},
                                            {kDiagonal, -kDiagonal}}};
constexpr float kLeftOutCosine2 = 0.4F;          // 51 degrees to either side
constexpr double kAgreed = 0.85;                 // part followed times part filled
constexpr int kSectors = 16;                     // of the rim
constexpr float kEighth = 0.41421356237309503F;  // tangent of an eighth of half a turn
constexpr double kInside = 0.8;                  // px within the ellipse where there should be paint,
constexpr double kOutside = 1.0;                 // and outside it where there should be none
constexpr double kRimPx = 1.0;                   // what reaches so far out goes on beyond
constexpr int kLeastPiece = 3;                   // pixels
constexpr double kLeastFilled = 0.5;

struct Origin {
    double x = 0.0;
    double y = 0.0;
};

// Points about their mean, in whole vectors: zeros behind the last.
struct Points {
    std::array<float, kMaxPoints> x{};
    std::array<float, kMaxPoints> y{};
    std::size_t count = 0;

    [[nodiscard]] FourFloats four_x(std::size_t first) const { return load_floats(&x[first]); }
    [[nodiscard]] FourFloats four_y(std::size_t first) const { return load_floats(&y[first]); }
    [[nodiscard]] bool push_back(float at_x, float at_y) {
        if (count == kMaxPoints) return false;
        x[count] = at_x;
        y[count++] = at_y;
        return true;
    }
};

// a x^2 + b xy + c y^2 + d x + e y = 1
using Conic = std::array<double, kUnknowns>;

bool has(const BitRows& rows, int x, int y) {
    return (rows[static_cast<std::size_t>(y)] >> x & 1U) != 0;
}

// Where cover passes the outline between a pixel of the blob and one beside it.
void gather_points(const BlobWorkspace& w, int outline, Points& points) {
    const auto cover = [&](int x, int y) {
        return static_cast<float>(w.cover[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)]);
    };
    const auto level = static_cast<float>(outline);
    for (int y = 1; y + 1 < w.height; ++y) {
        for (std::uint64_t bits = w.blob[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
            const int x = std::countr_zero(bits);
            if (x == 0 || x + 1 >= w.width) continue;
            constexpr std::array<std::array<int, 2>, 4> kSteps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
            for (const auto& step : kSteps) {
                if (has(w.blob, x + step[0], y + step[1])) continue;
                if (has(w.foreign, x + step[0], y + step[1])) continue;
                const float in = cover(x, y) - level;
                const float out = cover(x + step[0], y + step[1]) - level;
                const float part = in > 0.0F && out < 0.0F ? in / (in - out) : 0.5F;
                if (!points.push_back(static_cast<float>(x) + part * static_cast<float>(step[0]),
                                      static_cast<float>(y) + part * static_cast<float>(step[1])))
                    return;
            }
        }
    }
}

double sum_of_four(FourFloats v) {
    return (static_cast<double>(v[0]) + static_cast<double>(v[1])) +
           (static_cast<double>(v[2]) + static_cast<double>(v[3]));
}

// Sums of weight x^i y^j, four points at a time.
struct PowerSums {
    FourFloats x{}, y{}, xx{}, xy{}, yy{}, xxx{}, xxy{}, xyy{}, yyy{};
    FourFloats xxxx{}, xxxy{}, xxyy{}, xyyy{}, yyyy{};

    void add(FourFloats weight, FourFloats px, FourFloats py) {
        const FourFloats wx = weight * px, wy = weight * py;
        const FourFloats wxx = wx * px, wxy = wx * py, wyy = wy * py;
        const FourFloats wxxx = wxx * px, wxxy = wxx * py, wxyy = wyy * px, wyyy = wyy * py;
        x += wx, y += wy, xx += wxx, xy += wxy, yy += wyy;
        xxx += wxxx, xxy += wxxy, xyy += wxyy, yyy += wyyy;
        xxxx += wxxx * px, xxxy += wxxx * py, xxyy += wxxy * py, xyyy += wyyy * px, yyyy += wyyy * py;
    }
};

// False when the points do not fix a conic.
bool solve(const PowerSums& s, Conic& conic) {
    const auto row = [](double a, double b, double c, double d, double e) { return Conic{a, b, c, d, e}; };
    const double xxyy = sum_of_four(s.xxyy), xxy = sum_of_four(s.xxy), xyy = sum_of_four(s.xyy);
    const Conic right =
        row(sum_of_four(s.xx), sum_of_four(s.xy), sum_of_four(s.yy), sum_of_four(s.x), sum_of_four(s.y));
    std::array<Conic, kUnknowns> m{row(sum_of_four(s.xxxx), 0.0, 0.0, 0.0, 0.0),
                                   row(sum_of_four(s.xxxy), xxyy, 0.0, 0.0, 0.0),
                                   row(xxyy, sum_of_four(s.xyyy), sum_of_four(s.yyyy), 0.0, 0.0),
                                   row(sum_of_four(s.xxx), xxy, xyy, right[0], 0.0),
                                   row(xxy, xyy, sum_of_four(s.yyy), right[1], right[2])};
    if (!cholesky(m[0].data(), m[0].data(), kUnknowns, kUnknowns)) return false;
    conic = right;
    solve_lower(m[0].data(), kUnknowns, kUnknowns, conic.data());
    solve_lower_transposed(m[0].data(), kUnknowns, kUnknowns, conic.data());
    return true;
}

// Four points' values of a conic and the squares of its slope there; value / slope is the signed distance,
// px, to first order.
struct FourDistances {
    FourFloats value;
    FourFloats slope2;
};

FourDistances distances_to(const Conic& q, FourFloats x, FourFloats y) {
    const auto all = [](double v) { return all_four(static_cast<float>(v)); };
    const FourFloats gx = all(2.0 * q[0]) * x + all(q[1]) * y + all(q[3]);
    const FourFloats gy = all(q[1]) * x + all(2.0 * q[2]) * y + all(q[4]);
    const FourFloats value = (gx + all(q[3])) * x * 0.5F + (gy + all(q[4])) * y * 0.5F - 1.0F;
    return {value, gx * gx + gy * gy + 1e-12F};
}

// Weights fall with the square of 1 + (distance / reach)^2.
bool fit_conic(const Points& points, float reach, Conic& conic) {
    PowerSums sums;
    const FourFloats reach2 = all_four(reach * reach);
    for (std::size_t i = 0; i < points.count; i += 4) {
        const FourFloats x = points.four_x(i), y = points.four_y(i);
        const FourDistances d = distances_to(conic, x, y);
        const FourFloats near = d.slope2 * reach2;
        const FourFloats both = near + d.value * d.value;
        sums.add(near / (both * both), x, y);
    }
    return solve(sums, conic);
}

// To all points but those within an eighth of a turn or so of a direction (0, 0: to all), with equal weights.
bool fit_first(const Points& points, const Point& left_out, Conic& conic) {
    using FourMasks = std::int32_t __attribute__((vector_size(16)));
    PowerSums sums;
    FourMasks out_count{};
    for (std::size_t i = 0; i < points.count; i += 4) {
        const FourFloats x = points.four_x(i), y = points.four_y(i);
        const FourFloats along = x * left_out.x + y * left_out.y;
        const FourMasks out = (along > FourFloats{}) & (along * along > kLeftOutCosine2 * (x * x + y * y));
        out_count -= out;
        sums.add(reinterpret_cast<FourFloats>(~out & reinterpret_cast<FourMasks>(all_four(1.0F))), x, y);
    }
    if (points.count < kMinPoints + static_cast<std::size_t>(sum_of_ints(out_count))) return false;
    return solve(sums, conic);
}

template <std::size_t kRounds>
bool fit_in_rounds(const Points& points, const std::array<float, kRounds>& reaches, Conic& conic) {
    for (const float reach : reaches) {
        if (!fit_conic(points, reach, conic)) return false;
    }
    return true;
}

bool ellipse_of(const Conic& q, const Origin& origin, Ellipse& ellipse) {
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

// Part of the rim, in equal steps of the angle at which it is a circle, with a point of the outline within
// `reach` px of it.
double followed_part(const Points& points, float reach, const Conic& conic, const Origin& origin,
                     const Ellipse& e) {
    const auto ux = static_cast<float>(1.0 / sqrt(e.xx));
    const auto lean = static_cast<float>(e.xy / e.xx);
    const auto vy = static_cast<float>(1.0 / sqrt(std::max(1e-9, e.yy - e.xy / e.xx * e.xy)));
    const auto centre_x = static_cast<float>(e.x - origin.x);
    const auto centre_y = static_cast<float>(e.y - origin.y);
    const FourFloats reach2 = all_four(reach * reach);
    std::uint32_t sectors = 0;
    for (std::size_t i = 0; i < points.count; i += 4) {
        const FourFloats x = points.four_x(i), y = points.four_y(i);
        const FourDistances d = distances_to(conic, x, y);
        const auto off = d.value * d.value > reach2 * d.slope2;
        const FourFloats dx = x - centre_x;
        const FourFloats u = ux * dx;
        const FourFloats v = vy * (y - centre_y - lean * dx);
        const FourFloats u_size = greater_of(u, -u), v_size = greater_of(v, -v);
        const auto steep = greater_of(u_size, v_size) * kEighth < less_of(u_size, v_size);
        const auto sector =
            ((u < FourFloats{}) & 8) + ((v < FourFloats{}) & 4) + ((u_size < v_size) & 2) + (steep & 1);
        for (std::size_t k = 0; k < 4 && i + k < points.count; ++k) {
            if (off[k] == 0) sectors |= 1U << sector[k];
        }
    }
    return static_cast<double>(ones(sectors)) / kSectors;
}

double long_axis_px(const Ellipse& e) {
    const double half = 0.5 * (e.xx - e.yy);
    return 4.0 * sqrt(0.5 * (e.xx + e.yy) + sqrt(half * half + e.xy * e.xy));
}

// The ellipse grown by `by` px.
EllipseRows rows_of(const Ellipse& e, double by) {
    const double mean = sqrt(sqrt(std::max(1e-9, e.xx * e.yy - e.xy * e.xy)));  // half the mean radius
    return {e.x, e.y, e.xx, e.xy, e.yy, std::max(0.0, 2.0 + by / mean)};
}

// Of the ellipse, the part that is paint.
double filled_part(const Ellipse& ellipse, const BlobWorkspace& w) {
    const EllipseRows rows = rows_of(ellipse, -kInside);
    int all = 0;
    int paint = 0;
    for (int y = 0; y < w.height; ++y) {
        const std::uint64_t inner = rows.at(y) & row_mask(w.width);
        all += ones(inner);
        paint += ones(inner & w.blob[static_cast<std::size_t>(y)]);
    }
    return all == 0 ? 0.0 : static_cast<double>(paint) / all;
}

bool are_one(const Ellipse& a, const Ellipse& b) {
    const auto near = [](double v, double w, double by) { return v - w < by && w - v < by; };
    return near(a.x, b.x, kSamePx) && near(a.y, b.y, kSamePx) && near(a.xx, b.xx, kSamePart * b.xx) &&
           near(a.xy, b.xy, kSamePart * (b.xx + b.yy)) && near(a.yy, b.yy, kSamePart * b.yy);
}

}  // namespace

void mark_disc(double x, double y, double radius, const BlobWorkspace& w, BitRows& disc) {
    const double square = std::max(1e-9, 0.25 * radius * radius);
    const EllipseRows rows(x, y, square, 0.0, square, 2.0);
    disc.fill(0);
    for (int row = 0; row < w.height; ++row) {
        disc[static_cast<std::size_t>(row)] = rows.at(row) & row_mask(w.width);
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
    if (points.count < kMinPoints) return false;
    Origin origin;
    for (std::size_t i = 0; i < points.count; ++i) {
        origin.x += static_cast<double>(points.x[i]), origin.y += static_cast<double>(points.y[i]);
    }
    origin.x /= static_cast<double>(points.count);
    origin.y /= static_cast<double>(points.count);
    for (std::size_t i = 0; i < points.count; ++i) {
        points.x[i] -= static_cast<float>(origin.x), points.y[i] -= static_cast<float>(origin.y);
    }
    double best = 0.0;
    std::array<Ellipse, kDirections.size() + 1> tried;
    std::size_t tries = 0;
    const std::size_t last = limits.disturbed ? kDirections.size() : 0;
    // From all points, and then, unless those agree, without those on one side after the other.
    for (std::size_t start = 0; start <= last && best < kAgreed; ++start) {
        const Point left_out = start > 0 ? kDirections[start - 1] : Point{};
        Conic conic{};
        Ellipse fitted;
        if (!fit_first(points, left_out, conic) || !fit_in_rounds(points, kFirstReaches, conic)) continue;
        if (ellipse_of(conic, origin, fitted)) {  // if it is none yet, it may become one
            const auto before = std::span(tried).first(tries);
            const auto same = [&](const Ellipse& e) { return are_one(e, fitted); };
            if (std::any_of(before.begin(), before.end(), same)) continue;
            tried[tries++] = fitted;
            if (followed_part(points, kMayFollow, conic, origin, fitted) < limits.least_followed) continue;
        }
        if (!fit_in_rounds(points, kLastReaches, conic) || !ellipse_of(conic, origin, fitted)) continue;
        if (long_axis_px(fitted) > limits.longest_px) continue;
        fitted.followed = followed_part(points, kFollows, conic, origin, fitted);
        if (fitted.followed <= best) continue;
        const double quality = fitted.followed * filled_part(fitted, w);
        if (quality <= best) continue;
        best = quality;
        ellipse = fitted;
    }
    return ellipse.followed >= limits.least_followed && best > 0.0;
}

bool keep_ellipse(const Ellipse& ellipse, BlobWorkspace& w) {
    const EllipseRows inner_rows = rows_of(ellipse, -kInside);
    const EllipseRows outer_rows = rows_of(ellipse, kOutside);
    int all = 0;
    int paint = 0;
    for (int y = 0; y < w.height; ++y) {
        const auto row = static_cast<std::size_t>(y);
        const std::uint64_t mask = row_mask(w.width);
        const std::uint64_t inner = inner_rows.at(y) & mask;
        const std::uint64_t outer = outer_rows.at(y) & mask;
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
