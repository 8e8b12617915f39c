#include "tests/support/dot_scene/light_field.hpp"

#include <algorithm>
#include <cmath>

namespace rig::test {

double LightField::clamped(int x, int y) const {
    const auto cx = static_cast<std::size_t>(std::clamp(x, 0, width - 1));
    const auto cy = static_cast<std::size_t>(std::clamp(y, 0, height - 1));
    return values[cy * static_cast<std::size_t>(width) + cx];
}

void blur(LightField& field, double sigma) {
    if (sigma <= 0.0) return;
    const int reach = static_cast<int>(std::ceil(3.5 * sigma));
    std::vector<double> kernel;
    double sum = 0.0;
    for (int i = -reach; i <= reach; ++i) {
        kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
        sum += kernel.back();
    }
    for (const bool across : {true, false}) {
        const LightField source = field;
        for (int y = 0; y < field.height; ++y) {
            for (int x = 0; x < field.width; ++x) {
                double total = 0.0;
                for (int i = -reach; i <= reach; ++i) {
                    total += kernel[static_cast<std::size_t>(i + reach)] *
                             (across ? source.clamped(x + i, y) : source.clamped(x, y + i));
                }
                field.at(x, y) = total / sum;
            }
        }
    }
}

// Eight steps a pixel, bilinear: the path is symmetric about its middle, so centres stay where they are.
void smear(LightField& field, double length_px, double angle_rad) {
    if (length_px <= 0.0) return;
    const LightField source = field;
    const int steps = static_cast<int>(std::ceil(8.0 * length_px));
    std::fill(field.values.begin(), field.values.end(), 0.0);
    for (int i = 0; i < steps; ++i) {
        const double along = length_px * ((i + 0.5) / steps - 0.5);
        const double dx = along * std::cos(angle_rad);
        const double dy = along * std::sin(angle_rad);
        const int left = static_cast<int>(std::floor(dx));
        const int top = static_cast<int>(std::floor(dy));
        const double u = dx - left;
        const double v = dy - top;
        for (int y = 0; y < field.height; ++y) {
            for (int x = 0; x < field.width; ++x) {
                const double upper =
                    (1.0 - u) * source.clamped(x + left, y + top) + u * source.clamped(x + left + 1, y + top);
                const double lower = (1.0 - u) * source.clamped(x + left, y + top + 1) +
                                     u * source.clamped(x + left + 1, y + top + 1);
                field.at(x, y) += ((1.0 - v) * upper + v * lower) / steps;
            }
        }
    }
}

Picture digitise(const LightField& field, double read_noise, double shot_noise, SeededRandom& random) {
    Picture picture{field.width, field.height, {}};
    picture.pixels.reserve(field.values.size());
    for (const double value : field.values) {
        const double sigma = std::sqrt(read_noise * read_noise + shot_noise * std::max(0.0, value));
        picture.pixels.push_back(
            static_cast<std::uint8_t>(std::clamp(random.normal(value, sigma) + 0.5, 0.0, 255.0)));
    }
    return picture;
}

}  // namespace rig::test
