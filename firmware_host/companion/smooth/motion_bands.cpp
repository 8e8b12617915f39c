#include "firmware_host/companion/smooth/motion_bands.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace rig::host {

namespace {

constexpr std::array<double, 5> kSpline{1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0};

// x at any index: point reflection about the ends, over and over where the curve is short.
double continued(std::span<const double> x, std::ptrdiff_t at) {
    const auto last = static_cast<std::ptrdiff_t>(x.size()) - 1;
    if (last == 0) return x[0];
    double sign = 1.0;
    double shift = 0.0;
    while (at < 0 || at > last) {
        const double end = at < 0 ? x[0] : x[static_cast<std::size_t>(last)];
        shift += sign * 2.0 * end;
        sign = -sign;
        at = at < 0 ? -at : 2 * last - at;
    }
    return shift + sign * x[static_cast<std::size_t>(at)];
}

// w_k * x, spacing = 2^k.
std::vector<double> lower_pass(std::span<const double> x, std::ptrdiff_t spacing) {
    std::vector<double> smoothed(x.size());
    for (std::size_t n = 0; n < x.size(); ++n) {
        double sum = 0.0;
        for (std::size_t j = 0; j < kSpline.size(); ++j) {
            const std::ptrdiff_t offset = (static_cast<std::ptrdiff_t>(j) - 2) * spacing;
            sum += kSpline[j] * continued(x, static_cast<std::ptrdiff_t>(n) + offset);
        }
        smoothed[n] = sum;
    }
    return smoothed;
}

void clamp_all(std::vector<double>& values, double low, double high) {
    for (double& value : values) value = std::clamp(value, low, high);
}

}  // namespace

std::size_t band_count(std::size_t frames) {
    std::size_t bands = 0;
    while ((std::size_t{2} << bands) <= frames) ++bands;
    return bands;
}

double band_period_frames(std::size_t band) {
    // |L_k| = B_k (1 - W(2^k f)), B_k = product of W(2^j f), j < k, W(f) = cos^4(pi f): its peak on a fine
    // grid.
    double best_f = 0.5;
    double best = 0.0;
    const double scale = std::pow(2.0, static_cast<double>(band));
    for (int i = 1; i <= 4000; ++i) {
        const double f = 0.5 / scale * static_cast<double>(i) / 4000.0 * (band == 0 ? 1.0 : 1.5);
        double response = 1.0 - std::pow(std::cos(M_PI * scale * f), 4);
        for (std::size_t j = 0; j < band; ++j)
            response *= std::pow(std::cos(M_PI * std::pow(2.0, static_cast<double>(j)) * f), 4);
        if (response > best) {
            best = response;
            best_f = f;
        }
    }
    return 1.0 / best_f;
}

std::vector<double> shape_bands(std::span<const double> x, std::span<const double> gains, double low,
                                double high) {
    std::vector<double> level(x.begin(), x.end());
    std::vector<double> shaped(x.size(), 0.0);
    const std::size_t bands = band_count(x.size());
    for (std::size_t k = 0; k < bands; ++k) {
        std::vector<double> below = lower_pass(level, std::ptrdiff_t{1} << k);
        const double gain = k < gains.size() ? gains[k] : 1.0;
        for (std::size_t n = 0; n < x.size(); ++n) shaped[n] += gain * (level[n] - below[n]);
        level = std::move(below);
    }
    for (std::size_t n = 0; n < x.size(); ++n) shaped[n] += level[n];
    clamp_all(shaped, low, high);
    return shaped;
}

std::vector<double> smooth_gaussian(std::span<const double> x, double sigma_frames, double low, double high) {
    std::vector<double> smoothed(x.begin(), x.end());
    if (sigma_frames > 0.0) {
        const auto reach = static_cast<std::ptrdiff_t>(std::ceil(4.0 * sigma_frames));
        std::vector<double> kernel;
        double total = 0.0;
        for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
            const double at = static_cast<double>(j) / sigma_frames;
            kernel.push_back(std::exp(-0.5 * at * at));
            total += kernel.back();
        }
        for (std::size_t n = 0; n < x.size(); ++n) {
            double sum = 0.0;
            for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
                sum += kernel[static_cast<std::size_t>(j + reach)] *
                       continued(x, static_cast<std::ptrdiff_t>(n) + j);
            }
            smoothed[n] = sum / total;
        }
    }
    clamp_all(smoothed, low, high);
    return smoothed;
}

}  // namespace rig::host
