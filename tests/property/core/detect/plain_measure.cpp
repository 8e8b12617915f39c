#include "tests/property/core/detect/plain_measure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rig::test {

namespace {

struct Sample {
    double x;
    double y;
    double value;
};

std::vector<Sample> samples_between(const Picture& picture, double x, double y, double inner, double outer) {
    std::vector<Sample> samples;
    for (int v = static_cast<int>(y - outer) - 1; v <= static_cast<int>(y + outer) + 1; ++v) {
        for (int u = static_cast<int>(x - outer) - 1; u <= static_cast<int>(x + outer) + 1; ++u) {
            const double distance = std::hypot(u - x, v - y);
            if (u < 0 || v < 0 || u >= picture.width_px || v >= picture.height_px || distance < inner ||
                distance > outer)
                continue;
            const auto index = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width_px) +
                               static_cast<std::size_t>(u);
            samples.push_back({u - x, v - y, static_cast<double>(picture.pixels[index])});
        }
    }
    return samples;
}

struct PlainPlane {
    double level = 0.0;
    double slope_x = 0.0;
    double slope_y = 0.0;
    [[nodiscard]] double at(double x, double y) const { return level + slope_x * x + slope_y * y; }
};

// Normal equations by Cramer's rule.
PlainPlane fit(const std::vector<Sample>& samples) {
    double m[3][4] = {};
    for (const Sample& s : samples) {
        const double row[3] = {1.0, s.x, s.y};
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) m[i][j] += row[i] * row[j];
            m[i][3] += row[i] * s.value;
        }
    }
    const auto determinant = [&](int a, int b, int c) {
        return m[0][a] * (m[1][b] * m[2][c] - m[1][c] * m[2][b]) -
               m[0][b] * (m[1][a] * m[2][c] - m[1][c] * m[2][a]) +
               m[0][c] * (m[1][a] * m[2][b] - m[1][b] * m[2][a]);
    };
    const double whole = determinant(0, 1, 2);
    return {determinant(3, 1, 2) / whole, determinant(0, 3, 2) / whole, determinant(0, 1, 3) / whole};
}

}  // namespace

PlainCentre plain_centre(const Picture& picture, double x_px, double y_px, double diameter_px) {
    const double radius = 0.5 * diameter_px;
    const std::vector<Sample> ring = samples_between(picture, x_px, y_px, radius + 3.0, radius + 5.0);
    if (ring.size() < 20) return {};
    const PlainPlane skin = fit(ring);
    const std::vector<Sample> inside = samples_between(picture, x_px, y_px, 0.0, radius + 2.0);
    std::vector<double> dark;
    for (const Sample& s : inside) {
        if (s.value < 0.6 * skin.at(s.x, s.y)) dark.push_back(s.value);
    }
    if (dark.size() < 4) return {};
    std::sort(dark.begin(), dark.end());
    const double share = 1.0 - dark[dark.size() * 3 / 10] / skin.level;  // of the light that the ink takes
    double sum = 0.0;
    double sum_x = 0.0;
    double sum_y = 0.0;
    for (const Sample& s : inside) {
        const double light = skin.at(s.x, s.y);
        const double cover = (light - s.value) / (share * light);
        const double weight = std::clamp((cover - 0.25) / 0.5, 0.0, 1.0);
        sum += weight;
        sum_x += weight * s.x;
        sum_y += weight * s.y;
    }
    return {x_px + sum_x / sum, y_px + sum_y / sum, sum > 0.0};
}

}  // namespace rig::test
