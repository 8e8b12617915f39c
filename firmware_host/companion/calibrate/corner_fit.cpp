#include "firmware_host/companion/calibrate/corner_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace rig::host {

namespace {

constexpr double kReach = 0.33;          // of a square
constexpr double kMarkerKeepOff_px = 1;  // of blur that a marker spills into the bare rim
constexpr int kSteps = 15;
constexpr double kLeastAmplitude = 6.0;  // grey levels between ink and paper, halved: less is noise
constexpr double kMostMisfit = 0.25;     // of the amplitude: more is another pattern, or a finger
constexpr double kFurthest_px = 2.5;     // from the guess
constexpr int kSize = 8;

using Vec8 = Eigen::Matrix<double, kSize, 1>;
using Mat8 = Eigen::Matrix<double, kSize, kSize>;

struct Pixel {
    double x;
    double y;
    double value;
};

// Which pixels see nothing but the two edges.
std::vector<Pixel> bare_pixels(const ImageView& image, const CornerGuess& guess) {
    const double determinant = guess.px_from_square.determinant();
    const double longest = std::max(guess.px_from_square.col(0).norm(), guess.px_from_square.col(1).norm());
    const double shortest = std::min(guess.px_from_square.col(0).norm(), guess.px_from_square.col(1).norm());
    if (!(std::abs(determinant) > 0.05 * longest * longest) || !(shortest > 4.0)) return {};
    const Mat2 square_from_px = guess.px_from_square.inverse();
    // In an oblique square the reach spreads over the sum of both axes.
    const Vec2 spread = kReach * guess.px_from_square.cwiseAbs().rowwise().sum();
    const int left = static_cast<int>(std::floor(guess.at_px[0] - spread[0]));
    const int right = static_cast<int>(std::ceil(guess.at_px[0] + spread[0]));
    const int top = static_cast<int>(std::floor(guess.at_px[1] - spread[1]));
    const int bottom = static_cast<int>(std::ceil(guess.at_px[1] + spread[1]));
    if (left < 0 || top < 0 || right >= image.width_px || bottom >= image.height_px) return {};
    const double bare = guess.bare_share - kMarkerKeepOff_px / shortest;
    std::vector<Pixel> pixels;
    for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
            const Vec2 at =
                square_from_px * (Vec2{static_cast<double>(x), static_cast<double>(y)} - guess.at_px);
            const double u = std::abs(at[0]);
            const double v = std::abs(at[1]);
            if (std::max(u, v) > kReach || std::min(u, v) > bare) continue;
            pixels.push_back(
                {static_cast<double>(x), static_cast<double>(y), static_cast<double>(image.row(y)[x])});
        }
    }
    return pixels;
}

// x, y, angles of the two edges' normals, base, amplitude, blur across each.
enum Number : std::uint8_t { kX, kY, kFirst, kSecond, kBase, kAmplitude, kFirstBlur, kSecondBlur };

struct Edge {
    double value;     // erf
    double slope;     // along the distance
    double widening;  // along the blur
    double nx, ny, along;
};

Edge edge_of(const Vec8& p, Number angle, Number blur, double dx, double dy) {
    Edge edge{};
    edge.nx = std::cos(p[angle]);
    edge.ny = std::sin(p[angle]);
    const double distance = edge.nx * dx + edge.ny * dy;
    edge.along = edge.nx * dy - edge.ny * dx;
    const double u = distance / p[blur];
    edge.value = std::erf(u / std::numbers::sqrt2);
    edge.slope = std::exp(-0.5 * u * u) * 2.0 / (std::sqrt(2.0 * std::numbers::pi) * p[blur]);
    edge.widening = -u * edge.slope;
    return edge;
}

// Sums of the normal equations and the squared error.
double sum_up(const std::vector<Pixel>& pixels, const Vec8& p, Mat8& system, Vec8& right) {
    system.setZero();
    right.setZero();
    double squared = 0.0;
    for (const Pixel& pixel : pixels) {
        const double dx = pixel.x - p[kX];
        const double dy = pixel.y - p[kY];
        const Edge a = edge_of(p, kFirst, kFirstBlur, dx, dy);
        const Edge b = edge_of(p, kSecond, kSecondBlur, dx, dy);
        Vec8 slope;
        slope[kX] = -p[kAmplitude] * (a.slope * a.nx * b.value + a.value * b.slope * b.nx);
        slope[kY] = -p[kAmplitude] * (a.slope * a.ny * b.value + a.value * b.slope * b.ny);
        slope[kFirst] = p[kAmplitude] * a.slope * a.along * b.value;
        slope[kSecond] = p[kAmplitude] * a.value * b.slope * b.along;
        slope[kBase] = 1.0;
        slope[kAmplitude] = a.value * b.value;
        slope[kFirstBlur] = p[kAmplitude] * a.widening * b.value;
        slope[kSecondBlur] = p[kAmplitude] * a.value * b.widening;
        const double error = pixel.value - p[kBase] - p[kAmplitude] * a.value * b.value;
        system += slope * slope.transpose();
        right += error * slope;
        squared += error * error;
    }
    return squared;
}

Vec8 start_of(const std::vector<Pixel>& pixels, const CornerGuess& guess) {
    Vec8 p;
    p[kX] = guess.at_px[0];
    p[kY] = guess.at_px[1];
    // The edge along y has its normal across it, and the other way round; both towards rising board numbers.
    const Vec2 x = guess.px_from_square.col(0);
    const Vec2 y = guess.px_from_square.col(1);
    const double hand = guess.px_from_square.determinant() > 0.0 ? 1.0 : -1.0;
    p[kFirst] = std::atan2(-hand * y[0], hand * y[1]);
    p[kSecond] = std::atan2(hand * x[0], -hand * x[1]);
    p[kFirstBlur] = p[kSecondBlur] = 0.8;
    p[kBase] = 0.0;
    p[kAmplitude] = 1.0;
    // With the geometry given, base and amplitude are a straight line.
    double n = 0.0, sum = 0.0, sum_value = 0.0, square = 0.0, product = 0.0;
    for (const Pixel& pixel : pixels) {
        const Edge a = edge_of(p, kFirst, kFirstBlur, pixel.x - p[kX], pixel.y - p[kY]);
        const Edge b = edge_of(p, kSecond, kSecondBlur, pixel.x - p[kX], pixel.y - p[kY]);
        const double model = a.value * b.value;
        n += 1.0;
        sum += model;
        square += model * model;
        sum_value += pixel.value;
        product += model * pixel.value;
    }
    p[kAmplitude] = (n * product - sum * sum_value) / (n * square - sum * sum);
    p[kBase] = (sum_value - p[kAmplitude] * sum) / n;
    return p;
}

}  // namespace

CornerFit fit_corner(const ImageView& image, const CornerGuess& guess) {
    CornerFit fit;
    const std::vector<Pixel> pixels = bare_pixels(image, guess);
    if (pixels.size() < 3U * kSize) return fit;
    Vec8 p = start_of(pixels, guess);
    if (!p.allFinite()) return fit;
    Mat8 system;
    Vec8 right;
    double squared = sum_up(pixels, p, system, right);
    double damping = 1e-3;
    for (int step = 0; step < kSteps; ++step) {
        Mat8 damped = system;
        damped.diagonal() *= 1.0 + damping;
        damped.diagonal().array() += 1e-12;
        Vec8 next = p + damped.ldlt().solve(right);
        for (const Number blur : {kFirstBlur, kSecondBlur}) next[blur] = std::clamp(next[blur], 0.25, 10.0);
        Mat8 next_system;
        Vec8 next_right;
        const double next_squared =
            next.allFinite() ? sum_up(pixels, next, next_system, next_right) : HUGE_VAL;
        if (!(next_squared < squared)) {
            damping *= 10.0;
            continue;
        }
        const bool settled = (next.head<2>() - p.head<2>()).norm() < 1e-5;
        p = next;
        squared = next_squared;
        system = next_system;
        right = next_right;
        damping *= 0.1;
        if (settled) break;
    }
    fit.at_px = p.head<2>();
    fit.blur_px = std::max(p[kFirstBlur], p[kSecondBlur]);
    const double misfit = std::sqrt(squared / static_cast<double>(pixels.size()));
    fit.ok = std::abs(p[kAmplitude]) > kLeastAmplitude && misfit < kMostMisfit * std::abs(p[kAmplitude]) &&
             (fit.at_px - guess.at_px).norm() < kFurthest_px;
    return fit;
}

}  // namespace rig::host
