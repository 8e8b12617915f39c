#include "core/detect/quick_blob.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/math.hpp"
#include "core/detect/blob_shape.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr int kChunks = kQuickWindowPx / kPixelLanes;
constexpr int kRimSamples = 20;
constexpr int kRingPx = 3;   // the window's rim carries the background
constexpr int kClip = 48;    // grey levels about the guess: 16 bits hold the sums of 48 rows of them
constexpr int kFine = 32;    // fixed point of a grey level in outlines,
constexpr int kCoarse = 16;  // and in distances from the plane
constexpr int kHalf = 128;   // outlines, parts of 256 of the contrast: where it is drawn,
constexpr int kDeep = 176;   // or here where shadow touches the marker
constexpr int kOpen = 112;   // a moat pixel darker than this is no background
constexpr int kRamp = 64;    // soft threshold: weight 0 to 1 from outline - kRamp to outline + kRamp
constexpr int kCorePercent = 30;
constexpr double kDeepBadness = 0.25;  // of a marker that only shows at the deep outline
constexpr double kSteepest = 0.6;      // change of the light from the centre to the window's corner
constexpr double kMeanToRms = 1.2533;  // of a normal spread: mean distance -> rms
constexpr double kSpread = 0.2;        // of the contrast, that the skin around may stray from its plane

// Over the pixels that count: x and y from the window's centre, t = grey level - guess.
struct RimSums {
    int n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, t = 0, tx = 0, ty = 0;
    int astray = 0;  // sum of distances from the plane, 1/kCoarse of a grey level
};

struct Plane {
    double level = 0.0;  // at the window's centre
    double slope_x = 0.0;
    double slope_y = 0.0;
};

// Which grey levels count as skin: between least and most about a guess, or about a plane.
struct RimTest {
    RimTest(const Plane& p, int below, int above, int guess_level)
        : plane(p), least(all_lanes(-below)), most(all_lanes(above)), guess(guess_level) {}
    const Plane& plane;
    PixelLanes least;
    PixelLanes most;
    int guess;
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
            astray_ += ((off > -off ? off : -off) & keep) >> 1;
        } else {
            keep &= (t >= test_.least) & (t <= test_.most);
        }
        const PixelLanes kept = t & keep;
        const auto at = static_cast<std::int16_t>(y);
        n_ -= keep;
        ny_ += keep & at;
        nyy_ += keep & static_cast<std::int16_t>(at * at);
        t_ += kept;
        ty_ += kept * at;
    }

    void collect(RimSums& sums) const {
        sums.n += sum_of_lanes(n_), sums.y += sum_of_lanes(ny_), sums.yy += sum_of_lanes(nyy_);
        sums.t += sum_of_lanes(t_), sums.ty += sum_of_lanes(ty_);
        const PixelLanes nx = n_ * x_;
        sums.x += sum_of_lanes(nx), sums.xx += sum_of_lanes(nx * x_), sums.xy += sum_of_lanes(ny_ * x_);
        sums.tx += sum_of_products(t_, x_);
        sums.astray += 2 * sum_of_lanes(astray_);
    }

  private:
    const RimTest& test_;
    PixelLanes x_;
    PixelLanes level_;
    PixelLanes n_{}, ny_{}, nyy_{}, t_{}, ty_{}, astray_{};
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
    [[nodiscard]] const std::uint8_t* pixels(int y) const { return image_.row(s_.top + y) + s_.left; }
    [[nodiscard]] int core() const;
    [[nodiscard]] int rim_level() const;
    template <bool kAboutPlane>
    [[nodiscard]] RimSums sum_rim(const Plane& plane, int below, int above) const;
    bool fit_background(int core);
    bool solve_plane(const RimSums& sums);
    void mark(int outline, const BitRows& where, BitRows& rows, double contrast) const;
    bool draw(int outline, double contrast);
    [[nodiscard]] bool is_simple() const;
    [[nodiscard]] SoftMoments moments(int outline, double contrast) const;
    [[nodiscard]] double deviation_px(const SoftMoments& m, double radius_px) const;
    [[nodiscard]] double open_part(double contrast);
    void judge(int outline, Blob& blob);

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
    double rms_ = 0.0;
    bool holes_ = false;  // the outline was drawn over some
};

// The value that kCorePercent of the blob's pixels lie below or at.
int QuickMeasure::core() const {
    w_.histogram.fill(0);
    int count = 0;
    for (int y = 0; y < s_.height; ++y) {
        const std::uint8_t* row = pixels(y);
        for (std::uint64_t bits = w_.blob[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
            ++w_.histogram[static_cast<std::size_t>(row[std::countr_zero(bits)] ^ turn_)];
            ++count;
        }
    }
    const int rank = count * kCorePercent / 100;
    int seen = 0;
    for (std::size_t v = 0; v < 256; ++v) {
        seen += w_.histogram[v];
        if (seen > rank) return static_cast<int>(v);
    }
    return 0;
}

// The median of a few pixels of the rim.
int QuickMeasure::rim_level() const {
    std::array<std::uint8_t, kRimSamples> samples;
    for (int i = 0; i < kRimSamples / 4; ++i) {
        const int x = (2 * i + 1) * s_.width / (kRimSamples / 2);
        const int y = (2 * i + 1) * s_.height / (kRimSamples / 2);
        const auto at = static_cast<std::size_t>(4 * i);
        samples[at] = pixels(1)[x];
        samples[at + 1] = pixels(s_.height - 2)[x];
        samples[at + 2] = pixels(y)[1];
        samples[at + 3] = pixels(y)[s_.width - 2];
    }
    std::nth_element(samples.begin(), samples.begin() + kRimSamples / 2, samples.end());
    return samples[kRimSamples / 2] ^ turn_;
}

// Rim pixels whose grey level is within `below` under and `above` over the guess, or over the plane.
template <bool kAboutPlane>
RimSums QuickMeasure::sum_rim(const Plane& plane, int below, int above) const {
    const RimTest test(plane, kAboutPlane ? below * kCoarse : below, kAboutPlane ? above * kCoarse : above,
                       guess_);
    RimSums sums;
    for (int chunk = 0; chunk < chunks_; ++chunk) {  // the rows above and below
        const PixelLanes x = counting_lanes(chunk * kPixelLanes - centre_x_);
        RimLanes lanes(test, x);
        const PixelLanes inside = x < all_lanes(s_.width - centre_x_);
        for (int i = 0; i < kRingPx; ++i) {
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
    for (int row = kRingPx; row < s_.height - kRingPx; ++row) {
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
    const int rim = s_.width * s_.height - (s_.width - 2 * kRingPx) * (s_.height - 2 * kRingPx);
    if (s.n * 4 < rim) return false;
    const double n = s.n;
    const double cxx = n * s.xx - static_cast<double>(s.x) * s.x;
    const double cxy = n * s.xy - static_cast<double>(s.x) * s.y;
    const double cyy = n * s.yy - static_cast<double>(s.y) * s.y;
    const double cxt = n * s.tx - static_cast<double>(s.x) * s.t;
    const double cyt = n * s.ty - static_cast<double>(s.y) * s.t;
    const double determinant = cxx * cyy - cxy * cxy;
    if (!(determinant > 0.1 * cxx * cyy)) return false;
    plane_.slope_x = (cxt * cyy - cyt * cxy) / determinant;
    plane_.slope_y = (cyt * cxx - cxt * cxy) / determinant;
    plane_.level = guess_ + (s.t - plane_.slope_x * s.x - plane_.slope_y * s.y) / n;
    return true;
}

// The skin around the blob as a plane, first from what is on the skin's side of mid contrast, then from what
// lies near that plane.
bool QuickMeasure::fit_background(int core) {
    const int depth = std::max(8, guess_ - core);
    const RimSums rough = sum_rim<false>(plane_, std::min(kClip, depth / 2), std::min(kClip, depth));
    if (!solve_plane(rough)) return false;
    const double steep = std::abs(plane_.slope_x) * centre_x_ + std::abs(plane_.slope_y) * centre_y_;
    if (steep > kClip) return false;
    const int reach = std::clamp(static_cast<int>(kSpread * (plane_.level - core)), 6, 24);
    const RimSums fine = sum_rim<true>(plane_, reach, reach);
    if (!solve_plane(fine)) return false;
    rms_ = kMeanToRms * fine.astray / (static_cast<double>(kCoarse) * fine.n);
    return true;
}

// Pixels whose cover reaches `outline`: on or below a plane under the background's, since paint scales light.
void QuickMeasure::mark(int outline, const BitRows& where, BitRows& rows, double contrast) const {
    const double light = std::max(1.0, light_sign_ * (plane_.level - turn_));
    const double depth = contrast * outline / 256.0;
    const double tilt = 1.0 - light_sign_ * depth / light;  // of the outline's plane against the background's
    const auto slope = static_cast<std::int16_t>(plane_.slope_x * tilt * kFine);
    std::array<PixelLanes, kChunks> level{};
    for (std::size_t c = 0; c < static_cast<std::size_t>(chunks_); ++c)
        level[c] = counting_lanes(static_cast<int>(c) * kPixelLanes - centre_x_) * slope;
    for (int y = 0; y < s_.height; ++y) {
        const std::uint64_t look = where[static_cast<std::size_t>(y)];
        std::uint64_t bits = 0;
        if (look != 0) {
            const double height = plane_.level - depth + plane_.slope_y * tilt * (y - centre_y_);
            const auto base = static_cast<std::int16_t>(height * kFine);
            const std::uint8_t* from = pixels(y);
            for (int chunk = std::countr_zero(look) / kPixelLanes; chunk < chunks_; ++chunk) {
                const PixelLanes v = load_pixels(from + chunk * kPixelLanes, turn_);
                const PixelLanes mask =
                    v * static_cast<std::int16_t>(kFine) <= level[static_cast<std::size_t>(chunk)] + base;
                bits |= bits_of_lanes(mask) << (chunk * kPixelLanes);
            }
        }
        rows[static_cast<std::size_t>(y)] = bits & look;
    }
}

// One run of pixels in each of a row of rows, each touching the next: one piece without holes.
bool QuickMeasure::is_simple() const {
    std::uint64_t above = 0;
    bool begun = false;
    bool ended = false;
    for (int y = 0; y < s_.height; ++y) {
        const std::uint64_t row = w_.blob[static_cast<std::size_t>(y)];
        if ((row & (row + (row & (~row + 1)))) != 0) return false;
        if (row == 0) {
            ended = begun;
        } else {
            if (ended || (begun && (row & (above | above << 1 | above >> 1)) == 0)) return false;
            begun = true;
        }
        above = row;
    }
    return begun;
}

// The blob becomes its own outline at `outline` of the contrast, near where it was. False when less than
// four fifths of it hang together.
bool QuickMeasure::draw(int outline, double contrast) {
    BitRows& near = w_.scratch;
    near = w_.blob;
    grow_square(near, s_.height);
    grow_cross(near, s_.height);
    mark(outline, near, w_.covered, contrast);
    const BitRows before = w_.blob;
    w_.blob = w_.covered;
    holes_ = false;
    if (is_simple()) return true;
    BitRows piece{};
    for (std::size_t y = 0; y < static_cast<std::size_t>(s_.height); ++y)
        piece[y] = before[y] & w_.covered[y];
    const auto middle = static_cast<std::size_t>(centre_y_);
    BitRows seed{};
    seed[middle] = piece[middle];
    flood(seed, w_.covered, s_.height);
    const int count = count_bits(seed, s_.height);
    const int total = count_bits(w_.covered, s_.height);
    if (count == 0 || (total - count) * 5 > total) return false;
    w_.blob = seed;
    fill_holes(w_.blob, s_.width, s_.height);
    holes_ = true;
    return true;
}

// Weights of the soft threshold over the blob and one step around it; filled holes count as blob.
SoftMoments QuickMeasure::moments(int outline, double contrast) const {
    BitRows& region = w_.scratch;
    region = w_.blob;
    grow_square(region, s_.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(s_.height); ++y) region[y] &= row_mask(s_.width);
    const double light = std::max(1.0, light_sign_ * (plane_.level - turn_));
    const auto per_light = static_cast<float>(light_sign_ / light);
    const FourFloats scale = all_four(static_cast<float>(256.0 / contrast));
    const FourFloats low = all_four(static_cast<float>(outline - kRamp));
    const FourFloats high = all_four(static_cast<float>(outline + kRamp));
    const FourFloats inside_low = all_four(static_cast<float>(outline));
    std::array<EightFloats, kChunks> n{}, ny{}, nyy{}, tilt{};
    for (std::size_t c = 0; c < static_cast<std::size_t>(chunks_); ++c) {
        const EightFloats x = floats_of_lanes(counting_lanes(static_cast<int>(c) * kPixelLanes - centre_x_));
        const FourFloats slope = all_four(static_cast<float>(plane_.slope_x));
        tilt[c] = {x.low * slope, x.high * slope};
    }
    for (int row = 0; row < s_.height; ++row) {
        const std::uint64_t bits = region[static_cast<std::size_t>(row)];
        if (bits == 0) continue;
        const auto y = static_cast<float>(row - centre_y_);
        const FourFloats rise = all_four(static_cast<float>(plane_.slope_y) * y);
        const std::uint8_t* from = pixels(row);
        for (int chunk = std::countr_zero(bits) / kPixelLanes; chunk < chunks_; ++chunk) {
            const std::uint64_t part = bits >> (chunk * kPixelLanes) & 0xFFU;
            if (part == 0) break;
            const auto c = static_cast<std::size_t>(chunk);
            const EightFloats v = floats_of_lanes(load_pixels(from + chunk * kPixelLanes, turn_));
            const PixelLanes in_region = lanes_of_bits(part);
            const PixelLanes in_blob =
                lanes_of_bits(w_.blob[static_cast<std::size_t>(row)] >> (chunk * kPixelLanes));
            const auto weigh = [&](const FourFloats& pixel, const FourFloats& along, const FourFloats& inside,
                                   const FourFloats& keep) {
                const FourFloats change = along + rise;  // of the background from the centre
                const FourFloats t = change * per_light;
                const FourFloats cover = (change + static_cast<float>(plane_.level) - pixel) * scale *
                                         (1.0F - t + t * t * (1.0F - t));
                const FourFloats least = low + (inside_low - low) * inside;
                const FourFloats bounded = cover > least ? cover : least;
                const FourFloats weight = (bounded < high ? bounded : high) - low;
                return __builtin_convertvector(__builtin_convertvector(weight, FourInts), FourFloats) * keep;
            };
            const EightFloats keep = floats_of_lanes(-in_region);
            const EightFloats inside = floats_of_lanes(-in_blob);
            const FourFloats a = weigh(v.low, tilt[c].low, inside.low, keep.low);
            const FourFloats b = weigh(v.high, tilt[c].high, inside.high, keep.high);
            n[c].low += a, n[c].high += b;
            ny[c].low += a * y, ny[c].high += b * y;
            nyy[c].low += a * (y * y), nyy[c].high += b * (y * y);
        }
    }
    FourFloats sum[6]{};  // of n, x, y, xx, xy, yy: whole numbers, so their order is free
    for (std::size_t c = 0; c < static_cast<std::size_t>(chunks_); ++c) {
        const EightFloats x = floats_of_lanes(counting_lanes(static_cast<int>(c) * kPixelLanes - centre_x_));
        const auto add = [&](const FourFloats& at, const FourFloats& w, const FourFloats& wy,
                             const FourFloats& wyy) {
            sum[0] += w, sum[1] += at * w, sum[2] += wy;
            sum[3] += at * at * w, sum[4] += at * wy, sum[5] += wyy;
        };
        add(x.low, n[c].low, ny[c].low, nyy[c].low);
        add(x.high, n[c].high, ny[c].high, nyy[c].high);
    }
    double s[6];
    for (std::size_t i = 0; i < 6; ++i) {
        s[i] = static_cast<double>(sum[i][0]) + static_cast<double>(sum[i][1]) +
               static_cast<double>(sum[i][2]) + static_cast<double>(sum[i][3]);
    }
    SoftMoments m;
    if (s[0] <= 0.0) return m;
    m.weight = s[0] / (2 * kRamp);
    const double x = s[1] / s[0];
    const double y = s[2] / s[0];
    m.xx = s[3] / s[0] - x * x;
    m.xy = s[4] / s[0] - x * y;
    m.yy = s[5] / s[0] - y * y;
    m.x = centre_x_ + x;
    m.y = centre_y_ + y;
    return m;
}

// Mean distance between the outline and the ellipse of equal moments, px: pixels on the wrong side per pixel
// of outline.
double QuickMeasure::deviation_px(const SoftMoments& m, double radius_px) const {
    const double determinant = m.xx * m.yy - m.xy * m.xy;
    if (determinant <= 0.0) return kBlobWindowPx;
    // Row by row the ellipse (xx dy^2 - ...) <= 4: one span about middle + lean dy, half as wide as the root.
    const auto lean = static_cast<float>(m.xy / m.yy);
    const auto width = static_cast<float>(determinant / m.yy);  // half width^2 = width (4 - dy^2 / yy)
    const auto per_yy = static_cast<float>(1.0 / m.yy);
    std::array<float, kQuickWindowPx> half{};
    const int rows = (s_.height + 3) / 4 * 4;
    for (int y = 0; y < rows; ++y) {
        const float dy = static_cast<float>(y) - static_cast<float>(m.y);
        const float square = width * (4.0F - dy * dy * per_yy);
        half[static_cast<std::size_t>(y)] =
            std::sqrt(square > 0.0F ? square : 0.0F) - (square < 0.0F ? 1.0F : 0.0F);
    }
    int wrong = 0;
    for (int y = 0; y < s_.height; ++y) {
        const std::uint64_t row = w_.blob[static_cast<std::size_t>(y)];
        const float reach = half[static_cast<std::size_t>(y)];
        if (row == 0 && reach < 0.0F) continue;
        const float middle =
            static_cast<float>(m.x) + lean * (static_cast<float>(y) - static_cast<float>(m.y));
        const auto begin = static_cast<int>(std::clamp(middle - reach, 0.0F, 63.0F) + 0.99999F);
        const auto end = static_cast<int>(std::clamp(middle + reach, -1.0F, 63.0F) + 1.0F);
        const std::uint64_t ellipse = reach >= 0.0F && begin < end ? bit_span(begin, end) : 0;
        wrong += ones(ellipse ^ row);
    }
    return wrong / (6.283185307179586 * radius_px);
}

// Of the moat, from one to three steps outside the blob, the part that is no background.
double QuickMeasure::open_part(double contrast) {
    BitRows& moat = w_.scratch;  // the blob and one step, from moments()
    const BitRows inner = moat;
    grow_cross(moat, s_.height);
    grow_square(moat, s_.height);
    int total = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(s_.height); ++y) {
        moat[y] &= ~inner[y] & row_mask(s_.width);
        if (moat[y] != 0) total += ones(moat[y]);
    }
    mark(kOpen, moat, w_.dusky, contrast);
    int open = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(s_.height); ++y) {
        if (w_.dusky[y] != 0) open += ones(w_.dusky[y]);
    }
    return total == 0 ? 1.0 : static_cast<double>(open) / total;
}

void QuickMeasure::judge(int outline, Blob& blob) {
    const SoftMoments m = moments(outline, blob.contrast);
    if (m.weight <= 0.0) {
        blob.rejection = Rejection::kSmall;
        return;
    }
    set_axes(m, s_.left, s_.top, blob);
    blob.deviation = deviation_px(m, mean_radius_px(blob));
    blob.open = open_part(blob.contrast);
    judge_shape(rms_, limits_, blob);
}

bool QuickMeasure::run(Blob& blob) {
    int core_level = core();
    guess_ = rim_level();
    if (!fit_background(core_level)) return false;
    for (int round = 0; round < 2; ++round) {
        blob.background = plane_.level;
        blob.contrast = plane_.level - core_level;
        blob.depth = blob.contrast / std::max(1.0, light_sign_ * (plane_.level - turn_));
        if (blob.contrast < limits_.min_contrast) {
            blob.rejection = Rejection::kFaint;
            return true;
        }
        const double light = std::max(1.0, light_sign_ * (plane_.level - turn_));
        const double steep = std::abs(plane_.slope_x) * centre_x_ + std::abs(plane_.slope_y) * centre_y_;
        if (steep > kSteepest * light) return false;
        const int before = count_bits(w_.blob, s_.height);
        if (!draw(kHalf, blob.contrast)) return false;
        const int pixels = count_bits(w_.blob, s_.height);
        if (std::abs(pixels - before) * 4 <= before) break;
        core_level = core();
    }
    judge(kHalf, blob);
    const bool shadowed = blob.rejection == Rejection::kOpen || blob.rejection == Rejection::kIrregular ||
                          blob.rejection == Rejection::kElongated;
    if (shadowed && draw(kDeep, blob.contrast)) {
        judge(kDeep, blob);
        blob.badness += kDeepBadness;
    }
    return true;
}

}  // namespace

bool frame_component(const ImageView& image, const Component& component, std::span<const Run> runs,
                     QuickWorkspace& w, QuickStart& start) {
    start.left = component.left - kQuickMarginPx;
    start.top = component.top - kQuickMarginPx;
    start.width = component.right - component.left + 1 + 2 * kQuickMarginPx;
    start.height = component.bottom - component.top + 1 + 2 * kQuickMarginPx;
    const int read = (start.width + kPixelLanes - 1) / kPixelLanes * kPixelLanes;
    if (start.left < 0 || start.top < 0 || start.width > kQuickWindowPx || start.height > kQuickWindowPx ||
        start.left + read > image.width_px || start.top + start.height > image.height_px) {
        return false;
    }
    std::fill_n(w.blob.begin(), start.height, std::uint64_t{0});
    for (const Run& run : runs) {
        w.blob[static_cast<std::size_t>(run.y - start.top)] |=
            bit_span(run.begin - start.left, run.end - start.left);
    }
    return true;
}

bool measure_quickly(const ImageView& image, Side side, const QuickStart& start, const BlobLimits& limits,
                     QuickWorkspace& workspace, Blob& blob) {
    return QuickMeasure(image, side, start, limits, workspace).run(blob);
}

}  // namespace rig
