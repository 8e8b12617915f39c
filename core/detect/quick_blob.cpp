#include "core/detect/quick_blob.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/base/math.hpp"
#include "core/detect/blob_shape.hpp"
#include "core/detect/row_weights.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr int kChunks = kQuickWindowPx / kPixelLanes;
constexpr int kRimPx = 3;        // the window's rim carries the background
constexpr int kRimSamples = 12;  // whose median is the first guess at it
constexpr int kCoreSide = 4;     // px: the middle of the blob, whose
static_assert(kCoreSide * kCoreSide == kByteLanes);
constexpr int kCoreRank = 4;  // fifth darkest pixel is as dark as it gets, clear of noise and glints
constexpr int kClip = 48;     // grey levels about the guess: 16 bits hold the sums of 48 rows of them
constexpr int kCoarse = 16;   // fixed point of a distance from the background,
constexpr int kFine = 32;     // and of an outline
constexpr int kReach = 1;     // px that the outline may lie outside the start
constexpr double kFullWeight = 255.0;
constexpr double kSure = 0.8;       // badness of a marker above which it is measured again, slowly
constexpr double kSteepest = 0.8;   // change of the light from the window's centre to its corner
constexpr double kSpread = 0.2;     // of the contrast, that the skin around may stray from its plane
constexpr double kCleanRim = 0.97;  // of the rim is skin: nothing reaches the blob from outside

// Over the pixels that count: x and y from the window's centre, t = grey level - guess.
struct RimSums {
    int n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, t = 0, tx = 0, ty = 0, tt = 0;
};

// Grey level at the window's centre and its slopes.
struct Plane {
    double level = 0.0;
    double slope_x = 0.0;
    double slope_y = 0.0;
};

// Which grey levels count as skin: between least and most about a guess, or about a plane.
struct RimTest {
    const Plane& plane;
    int guess;
    PixelLanes least;
    PixelLanes most;
};

// Sums over rows for eight columns.
class RimLanes {
  public:
    RimLanes(const RimTest& test, PixelLanes x) : test_(test), x_(x) {
        const auto slope = static_cast<std::int16_t>(test.plane.slope_x * kCoarse);
        level_ = x * slope + static_cast<std::int16_t>((test.plane.level - test.guess) * kCoarse);
    }

    template <bool kAboutPlane>
    void add(PixelLanes v, PixelLanes mask, int y) {
        const PixelLanes t = v - static_cast<std::int16_t>(test_.guess);
        PixelLanes keep = mask;
        if (kAboutPlane) {
            const auto rise = static_cast<std::int16_t>(test_.plane.slope_y * kCoarse * y);
            const PixelLanes off = t * static_cast<std::int16_t>(kCoarse) - (level_ + rise);
            keep &= (off >= test_.least) & (off <= test_.most) & (t >= all_lanes(-kClip)) &
                    (t <= all_lanes(kClip));
        } else {
            keep &= (t >= test_.least) & (t <= test_.most);
        }
        const PixelLanes kept = t & keep;
        const PixelLanes at = all_lanes(y);
        const PixelLanes kept_at = at & keep;
        n_ -= keep;
        ny_ += kept_at;
        nyy_ += kept_at * at;
        t_ += kept;
        ty_ += kept * at;
        tt_ += kept * kept >> 2;
    }

    void collect(RimSums& sums) const {
        sums.n += sum_of_lanes(n_), sums.y += sum_of_lanes(ny_), sums.yy += sum_of_lanes(nyy_);
        sums.t += sum_of_lanes(t_), sums.ty += sum_of_lanes(ty_), sums.tt += 4 * sum_of_lanes(tt_);
        const PixelLanes nx = n_ * x_;
        sums.x += sum_of_lanes(nx), sums.xx += sum_of_lanes(nx * x_), sums.xy += sum_of_lanes(ny_ * x_);
        sums.tx += sum_of_products(t_, x_);
    }

  private:
    const RimTest& test_;
    PixelLanes x_;
    PixelLanes level_;
    PixelLanes n_{}, ny_{}, nyy_{}, t_{}, ty_{}, tt_{};
};

// A grey level for every pixel, linear in x and y; in fixed point, each column rounded by itself.
class Slope {
  public:
    Slope(double level, double slope_x, double slope_y, double scale, int centre_x, int chunks)
        : level_(level * scale), slope_y_(slope_y * scale) {
        for (int c = 0; c < chunks; ++c) {
            const EightFloats x = floats_of_lanes(counting_lanes(c * kPixelLanes - centre_x));
            const FourFloats slope = all_four(static_cast<float>(slope_x * scale));
            columns_[static_cast<std::size_t>(c)] = rounded_lanes({x.low * slope, x.high * slope});
        }
    }
    [[nodiscard]] std::int16_t row(int y) const {
        const double level = level_ + slope_y_ * y;
        return static_cast<std::int16_t>(static_cast<int>(level + 16384.5) - 16384);
    }
    [[nodiscard]] PixelLanes column(int chunk) const { return columns_[static_cast<std::size_t>(chunk)]; }

  private:
    double level_;
    double slope_y_;
    std::array<PixelLanes, kChunks> columns_{};
};

class QuickMeasure {
  public:
    QuickMeasure(const ImageView& image, Side side, const QuickStart& start, const BlobLimits& limits,
                 QuickWorkspace& workspace)
        : image_(image),
          s_(start),
          limits_(limits),
          w_(workspace),
          turn_(side == Side::kAbove ? 255 : 0),
          light_sign_(side == Side::kBelow ? 1.0 : -1.0),
          chunks_((start.width + kPixelLanes - 1) / kPixelLanes),
          centre_x_(start.width / 2),
          centre_y_(start.height / 2) {}

    // False: not a normal case.
    bool run(Blob& blob);

  private:
    [[nodiscard]] const std::uint8_t* pixels(int y) const {
        return image_.pixels + (s_.top + y) * image_.stride_bytes + s_.left;
    }
    [[nodiscard]] int core_level() const;
    [[nodiscard]] int rim_level() const;
    template <bool kAboutPlane>
    [[nodiscard]] RimSums sum_rim(int below, int above) const;
    [[nodiscard]] int rim_pixels() const {
        return s_.width * s_.height - (s_.width - 2 * kRimPx) * (s_.height - 2 * kRimPx);
    }
    bool fit_background(int core);
    bool solve_plane(const RimSums& sums);
    [[nodiscard]] double light() const;
    [[nodiscard]] Slope level_at(double part, double scale, double contrast) const;
    [[nodiscard]] std::uint64_t marked(const Slope& level, int y, std::uint64_t look) const;
    bool draw(double outline, double contrast);
    // Sets hidden_ too.
    [[nodiscard]] SoftMoments moments(double outline, double contrast);
    [[nodiscard]] SoftMoments gather(const std::array<WeightLanes, kChunks>& lanes, int bottom,
                                     double full) const;
    [[nodiscard]] double deviation_px(const SoftMoments& m, double radius_px) const;
    [[nodiscard]] double open_part(double contrast) const;
    void judge(double outline, Blob& blob);

    const ImageView& image_;
    const QuickStart& s_;
    const BlobLimits& limits_;
    QuickWorkspace& w_;
    std::uint8_t turn_;
    double light_sign_;
    int chunks_;
    int centre_x_;
    int centre_y_;
    int guess_ = 0;  // grey level of the skin around
    Plane plane_;
    double rms_ = 0.0;     // of the skin about the plane
    double clean_ = 0.0;   // part of the rim that is skin
    bool hidden_ = false;  // something that is neither paint nor skin lies on the blob
    int first_ = 0;        // rows of the blob: [first_, last_]
    int last_ = 0;
};

int QuickMeasure::core_level() const {
    std::array<std::uint8_t, kCoreSide * kCoreSide> samples;
    for (int i = 0; i < kCoreSide; ++i) {
        std::memcpy(&samples[static_cast<std::size_t>(i * kCoreSide)],
                    pixels(centre_y_ - kCoreSide / 2 + i) + centre_x_ - kCoreSide / 2, kCoreSide);
    }
    return ranked_byte(load_bytes(samples.data()) ^ turn_, kCoreRank);
}

int QuickMeasure::rim_level() const {
    std::array<std::uint8_t, kByteLanes> samples;
    samples.fill(255);  // those that are none come last
    for (int i = 0; i < kRimSamples / 4; ++i) {
        const int x = (2 * i + 1) * s_.width / (kRimSamples / 2);
        const int y = (2 * i + 1) * s_.height / (kRimSamples / 2);
        const auto at = static_cast<std::size_t>(4 * i);
        samples[at] = pixels(1)[x];
        samples[at + 1] = pixels(s_.height - 2)[x];
        samples[at + 2] = pixels(y)[1];
        samples[at + 3] = pixels(y)[s_.width - 2];
    }
    return ranked_byte(load_bytes(samples.data()), kRimSamples / 2) ^ turn_;
}

// Rim pixels whose grey level is within `below` under and `above` over the guess, or over the plane.
template <bool kAboutPlane>
RimSums QuickMeasure::sum_rim(int below, int above) const {
    const int unit = kAboutPlane ? kCoarse : 1;
    const RimTest test{plane_, guess_, all_lanes(-below * unit), all_lanes(above * unit)};
    RimSums sums;
    for (int chunk = 0; chunk < chunks_; ++chunk) {  // the rows above and below
        const PixelLanes x = counting_lanes(chunk * kPixelLanes - centre_x_);
        RimLanes lanes(test, x);
        const PixelLanes inside = x < all_lanes(s_.width - centre_x_);
        for (int i = 0; i < kRimPx; ++i) {
            for (const int row : {i, s_.height - 1 - i}) {
                const PixelLanes v = load_pixels(pixels(row) + chunk * kPixelLanes, turn_);
                lanes.add<kAboutPlane>(v, inside, row - centre_y_);
            }
        }
        lanes.collect(sums);
    }
    // Left and right of the rows between: the first and the last pixels of a row side by side.
    const int right = s_.width - kPixelLanes;
    const PixelLanes x = __builtin_shufflevector(
        counting_lanes(-centre_x_), counting_lanes(right - centre_x_), 0, 1, 2, 3, 12, 13, 14, 15);
    const PixelLanes rim{-1, -1, -1, 0, 0, -1, -1, -1};
    RimLanes lanes(test, x);
    for (int row = kRimPx; row < s_.height - kRimPx; ++row) {
        const std::uint8_t* from = pixels(row);
        const PixelLanes v = __builtin_shufflevector(
            load_pixels(from, turn_), load_pixels(from + right, turn_), 0, 1, 2, 3, 12, 13, 14, 15);
        lanes.add<kAboutPlane>(v, rim, row - centre_y_);
    }
    lanes.collect(sums);
    return sums;
}

// Least squares; false when the pixels that count are too few or too one-sided.
bool QuickMeasure::solve_plane(const RimSums& s) {
    if (s.n * 4 < rim_pixels()) return false;
    const double n = s.n;
    const double cxx = n * s.xx - static_cast<double>(s.x) * s.x;
    const double cxy = n * s.xy - static_cast<double>(s.x) * s.y;
    const double cyy = n * s.yy - static_cast<double>(s.y) * s.y;
    const double cxt = n * s.tx - static_cast<double>(s.x) * s.t;
    const double cyt = n * s.ty - static_cast<double>(s.y) * s.t;
    const double ctt = n * s.tt - static_cast<double>(s.t) * s.t;
    const double determinant = cxx * cyy - cxy * cxy;
    if (!(determinant > 0.1 * cxx * cyy)) return false;
    plane_.slope_x = (cxt * cyy - cyt * cxy) / determinant;
    plane_.slope_y = (cyt * cxx - cxt * cxy) / determinant;
    plane_.level = guess_ + (s.t - plane_.slope_x * s.x - plane_.slope_y * s.y) / n;
    rms_ = sqrt(std::max(0.0, ctt - plane_.slope_x * cxt - plane_.slope_y * cyt)) / n;
    clean_ = n / rim_pixels();
    const double steep = std::abs(plane_.slope_x) * centre_x_ + std::abs(plane_.slope_y) * centre_y_;
    return steep <= kSteepest * light();
}

// The skin around the blob as a plane: from what is near the guess; unless that is all of the rim, again from
// what is near that plane.
bool QuickMeasure::fit_background(int core) {
    const int depth = std::max(8, guess_ - core);
    if (!solve_plane(sum_rim<false>(std::min(kClip, depth / 2), std::min(kClip, depth)))) return false;
    const double reach = std::clamp(kSpread * (plane_.level - core), 6.0, 24.0);
    if (clean_ == 1.0 && rms_ * 2.0 < reach) return true;
    return solve_plane(sum_rim<true>(static_cast<int>(reach), static_cast<int>(reach)));
}

// What falls on the skin at the window's centre: paint scales it.
double QuickMeasure::light() const {
    return std::max(1.0, light_sign_ * (plane_.level - turn_));
}

// The level at `part` of the contrast below the background.
Slope QuickMeasure::level_at(double part, double scale, double contrast) const {
    const double tilt = 1.0 - light_sign_ * part * contrast / light();
    return {plane_.level - part * contrast,
            plane_.slope_x * tilt,
            plane_.slope_y * tilt,
            scale,
            centre_x_,
            chunks_};
}

// Pixels of row y at or below the level, among those of `look`.
std::uint64_t QuickMeasure::marked(const Slope& level, int y, std::uint64_t look) const {
    const std::int16_t row = level.row(y - centre_y_);
    const std::uint8_t* from = pixels(y);
    std::uint64_t bits = 0;
    const int end = (63 - std::countl_zero(look)) / kPixelLanes + 1;
    for (int chunk = std::countr_zero(look) / kPixelLanes; chunk < end; ++chunk) {
        const PixelLanes v = load_pixels(from + chunk * kPixelLanes, turn_);
        bits |= bits_of_lanes(v * static_cast<std::int16_t>(kFine) <= level.column(chunk) + row)
                << (chunk * kPixelLanes);
    }
    return bits & look;
}

// What of a row hangs together with the row before it, gaps filled; `row` is not empty.
std::uint64_t chain(std::uint64_t row, std::uint64_t before) {
    std::uint64_t joined = row & (before | before << 1 | before >> 1);
    if (joined == 0 || beyond_first_run(row) == 0) return joined == 0 ? 0 : row;
    for (std::uint64_t wider = joined;; joined = wider) {
        wider = (joined | joined << 1 | joined >> 1) & row;
        if (wider == joined) break;
    }
    return bit_span(std::countr_zero(joined), 64 - std::countl_zero(joined));
}

// The blob becomes its own outline at `outline` of the contrast, inside the start and kReach around it: from
// its middle up and down, row by row, as far as rows hang together. False when less than four fifths do.
bool QuickMeasure::draw(double outline, double contrast) {
    const Slope level = level_at(outline, kFine, contrast);
    constexpr int kInset = kQuickMarginPx - kReach;
    const std::uint64_t look = bit_span(kInset, s_.width - kInset);
    int total = 0;
    for (int y = kInset; y < s_.height - kInset; ++y) {
        const std::uint64_t row = marked(level, y, look);
        w_.blob[static_cast<std::size_t>(y)] = row;
        total += ones(row);
    }
    const std::uint64_t middle = std::uint64_t{1} << centre_x_;
    std::uint64_t seed = chain(w_.blob[static_cast<std::size_t>(centre_y_)], middle);
    w_.blob[static_cast<std::size_t>(centre_y_)] = seed;
    if (seed == 0) return false;
    int count = ones(seed);
    const auto follow = [&](int y, int step) {
        std::uint64_t before = seed;
        for (; y >= kInset && y < s_.height - kInset; y += step) {
            std::uint64_t& row = w_.blob[static_cast<std::size_t>(y)];
            before = row = row == 0 ? 0 : chain(row, before);
            if (row == 0) break;
            count += ones(row);
        }
        return y - step;
    };
    first_ = follow(centre_y_ - 1, -1);
    last_ = follow(centre_y_ + 1, 1);
    return (total - count) * 5 <= total;
}

// Weights of the soft threshold over the blob and one step around it. They are in grey levels, larger where
// there is more light; gather() takes that out.
SoftMoments QuickMeasure::moments(double outline, double contrast) {
    const double scale =
        static_cast<double>(static_cast<int>(kFullWeight / (2.0 * kSoftRamp * contrast)) + 1);
    const Slope low = level_at(outline - kSoftRamp, scale, contrast);
    const double per_light = light_sign_ * 2.0 * kSoftRamp * contrast / light();
    const Slope full(2.0 * kSoftRamp * contrast, plane_.slope_x * per_light, plane_.slope_y * per_light,
                     scale, centre_x_, chunks_);
    std::array<WeightLanes, kChunks> lanes{};
    PixelLanes deepest = all_lanes(0);
    std::uint64_t above = 0;
    std::uint64_t here = 0;
    std::uint64_t below = w_.blob[static_cast<std::size_t>(first_)];
    for (int y = first_ - 1; y <= last_ + 1; ++y) {
        above = here, here = below;
        below = y < last_ ? w_.blob[static_cast<std::size_t>(y + 1)] : 0;
        if (y == first_ - 1) here = 0, below = w_.blob[static_cast<std::size_t>(first_)];
        const std::uint64_t column = above | here | below;
        const std::uint64_t region = column | column << 1 | column >> 1;
        const std::uint8_t* from = pixels(y);
        const std::int16_t low_row = low.row(y - centre_y_);
        const std::int16_t full_row = full.row(y - centre_y_);
        for (int chunk = 0; chunk < chunks_; ++chunk) {
            const PixelLanes v = load_pixels(from + chunk * kPixelLanes, turn_);
            const PixelLanes over = low.column(chunk) + low_row - v * static_cast<std::int16_t>(scale);
            const PixelLanes most = full.column(chunk) + full_row;
            const PixelLanes floored = over > all_lanes(0) ? over : all_lanes(0);
            const PixelLanes weight = floored < most ? floored : most;
            const PixelLanes inside = lanes_of_bits(region >> (chunk * kPixelLanes));
            lanes[static_cast<std::size_t>(chunk)].add(weight & inside);
            const PixelLanes under = over & inside;
            deepest = under < deepest ? under : deepest;
        }
    }
    const double skin = (outline - kSoftRamp + kHiddenCover) * contrast * scale;
    for (int lane = 0; lane < kPixelLanes; ++lane) hidden_ = hidden_ || deepest[lane] < -skin;
    return gather(lanes, last_ + 1, scale * 2.0 * kSoftRamp * contrast);
}

// `bottom`: the last row that was added; full: the weight of a whole pixel at the window's centre.
SoftMoments QuickMeasure::gather(const std::array<WeightLanes, kChunks>& lanes, int bottom,
                                 double full) const {
    FourFloats sum[6]{};  // of w, x, m, xx, xm, mm; m = rows from bottom + 1 upwards
    const auto add = [&](FourFloats x, FourInts once, FourInts rows, FourInts twice) {
        const FourFloats w = __builtin_convertvector(once, FourFloats);
        const FourFloats m = __builtin_convertvector(rows, FourFloats);
        const FourFloats mm = __builtin_convertvector(twice + twice - rows, FourFloats);
        sum[0] += w, sum[1] += x * w, sum[2] += m, sum[3] += x * x * w, sum[4] += x * m, sum[5] += mm;
    };
    for (int chunk = 0; chunk < chunks_; ++chunk) {
        const WeightLanes& l = lanes[static_cast<std::size_t>(chunk)];
        const EightFloats x = floats_of_lanes(counting_lanes(chunk * kPixelLanes - centre_x_));
        const auto [low, high] = ints_of_lanes(l.sum);
        add(x.low, low, l.low, l.low_twice);
        add(x.high, high, l.high, l.high_twice);
    }
    double s[6];
    for (std::size_t i = 0; i < 6; ++i) {
        s[i] = (static_cast<double>(sum[i][0]) + static_cast<double>(sum[i][1])) +
               (static_cast<double>(sum[i][2]) + static_cast<double>(sum[i][3]));
    }
    SoftMoments m;
    if (s[0] <= 0.0) return m;
    const double base = bottom + 1 - centre_y_;  // y = base - m
    const double sx = s[1];
    const double sy = base * s[0] - s[2];
    const double sxx = s[3];
    const double sxy = base * s[1] - s[4];
    const double syy = base * (base * s[0] - 2.0 * s[2]) + s[5];
    // A weight holds 1 + t of the light at the centre, t = (gx, gy) . (x, y): to first order, taken out.
    const double gx = light_sign_ * plane_.slope_x / light();
    const double gy = light_sign_ * plane_.slope_y / light();
    const double weight = s[0] - gx * sx - gy * sy;
    const double x = (sx - gx * sxx - gy * sxy) / weight;
    const double y = (sy - gx * sxy - gy * syy) / weight;
    const double mean_x = sx / s[0];
    const double mean_y = sy / s[0];
    m.weight = weight / full;
    m.x = centre_x_ + x;
    m.y = centre_y_ + y;
    m.xx = sxx / s[0] - mean_x * mean_x;
    m.xy = sxy / s[0] - mean_x * mean_y;
    m.yy = syy / s[0] - mean_y * mean_y;
    return m;
}

// Mean distance between the outline and the ellipse of equal moments, px: pixels on the wrong side per pixel
// of outline.
double QuickMeasure::deviation_px(const SoftMoments& m, double radius_px) const {
    const double determinant = m.xx * m.yy - m.xy * m.xy;
    if (determinant <= 0.0) return kBlobWindowPx;
    // Row by row the ellipse is one span: about m.x + lean dy, half as wide as the root of
    // width (4 - dy^2 / yy).
    const auto lean = static_cast<float>(m.xy / m.yy);
    const auto width = static_cast<float>(determinant / m.yy);
    const auto per_yy = static_cast<float>(1.0 / m.yy);
    const auto x = static_cast<float>(m.x);
    const auto top = static_cast<float>(first_ - 2) - static_cast<float>(m.y);
    const int rows = last_ - first_ + 5;
    std::array<float, kQuickWindowPx> half;
    for (int i = 0; i < (rows + 3) / 4 * 4; ++i) {
        const float dy = top + static_cast<float>(i);
        const float square = width * (4.0F - dy * dy * per_yy);
        half[static_cast<std::size_t>(i)] = std::sqrt(square > 0.0F ? square : 0.0F);
    }
    int wrong = 0;
    for (int i = 0; i < rows; ++i) {
        const int y = first_ - 2 + i;
        const std::uint64_t row = y >= first_ && y <= last_ ? w_.blob[static_cast<std::size_t>(y)] : 0;
        const float reach = half[static_cast<std::size_t>(i)];
        const float middle = x + lean * (top + static_cast<float>(i));
        const auto begin = static_cast<int>(std::clamp(middle - reach, 0.0F, 63.0F) + 0.99999F);
        const auto end = static_cast<int>(std::clamp(middle + reach, -1.0F, 63.0F) + 1.0F);
        const std::uint64_t ellipse = reach > 0.0F && begin < end ? bit_span(begin, end) : 0;
        if (ellipse != row) wrong += ones(ellipse ^ row);
    }
    return wrong / (6.283185307179586 * radius_px);
}

// Of the moat, from one to three steps outside the blob, the part that is no background.
double QuickMeasure::open_part(double contrast) const {
    if (clean_ >= kCleanRim) return 0.0;
    BitRows& moat = w_.moat;
    BitRows& set = w_.set;
    std::fill_n(set.begin(), s_.height, std::uint64_t{0});
    std::copy(w_.blob.begin() + first_, w_.blob.begin() + last_ + 1, set.begin() + first_);
    draw_moat(set, s_.width, s_.height, moat);
    const Slope level = level_at(kOpenCover, kFine, contrast);
    int total = 0;
    int open = 0;
    for (int y = 0; y < s_.height; ++y) {
        const auto at = static_cast<std::size_t>(y);
        const std::uint64_t look = moat[at];
        if (look == 0) continue;
        total += ones(look);
        const std::uint64_t dusky = marked(level, y, look);
        if (dusky != 0) open += ones(dusky);
    }
    return total == 0 ? 1.0 : static_cast<double>(open) / total;
}

void QuickMeasure::judge(double outline, Blob& blob) {
    const SoftMoments m = moments(outline, blob.contrast);
    if (m.weight <= 0.0) {
        blob.rejection = Rejection::kSmall;
        return;
    }
    set_axes(m, s_.left, s_.top, blob);
    blob.deviation = deviation_px(without_blur(m), mean_radius_px(blob));
    blob.open = open_part(blob.contrast);
    judge_shape(rms_, limits_, blob);
}

bool QuickMeasure::run(Blob& blob) {
    const int core = core_level();
    guess_ = rim_level();
    if (!fit_background(core)) return false;
    blob.background = plane_.level;
    blob.contrast = plane_.level - core;
    blob.depth = blob.contrast / light();
    if (blob.contrast < limits_.min_contrast) {
        blob.rejection = Rejection::kFaint;
        return true;
    }
    if (!draw(kHalfOutline, blob.contrast)) return false;
    judge(kHalfOutline, blob);
    if (looks_shadowed(blob) && draw(kDeepOutline, blob.contrast)) {
        judge(kDeepOutline, blob);
        blob.badness += kDeepBadness;
    }
    if (hidden_ || blob.rejection == Rejection::kIrregular) return false;
    return blob.rejection != Rejection::kNone || blob.badness < kSure;
}

}  // namespace

bool frame_component(const ImageView& image, const Component& component, QuickStart& start) {
    start.left = component.left - kQuickMarginPx;
    start.top = component.top - kQuickMarginPx;
    start.width = component.right - component.left + 1 + 2 * kQuickMarginPx;
    start.height = component.bottom - component.top + 1 + 2 * kQuickMarginPx;
    const int read = (start.width + kPixelLanes - 1) / kPixelLanes * kPixelLanes;
    if (start.width < kPixelLanes || start.left < 0 || start.top < 0 || start.width > kQuickWindowPx ||
        start.height > kQuickWindowPx || start.left + read > image.width_px ||
        start.top + start.height > image.height_px) {
        return false;
    }
    return true;
}

bool measure_quickly(const ImageView& image, Side side, const QuickStart& start, const BlobLimits& limits,
                     QuickWorkspace& workspace, Blob& blob) {
    return QuickMeasure(image, side, start, limits, workspace).run(blob);
}

}  // namespace rig
