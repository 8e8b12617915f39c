#include "firmware_host/companion/train/take_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

namespace {

double square(double x) {
    return x * x;
}

}  // namespace

WeightStatistics weight_statistics(std::span<const Take> takes, std::size_t shape_count, double rate_hz) {
    std::vector<double> sum(shape_count), steps(shape_count);
    double frames = 0.0;
    double pairs = 0.0;
    const auto weight = [&](const Take& take, std::size_t frame, std::size_t shape) {
        return static_cast<double>(take.weights[frame * shape_count + shape]);
    };
    for (const Take& take : takes) {
        frames += static_cast<double>(take.frame_count);
        pairs += take.frame_count > 1 ? static_cast<double>(take.frame_count - 1) : 0.0;
        for (std::size_t f = 0; f < take.frame_count; ++f) {
            for (std::size_t i = 0; i < shape_count; ++i) {
                sum[i] += weight(take, f, i);
                if (f > 0)
                    steps[i] +=
                        square((weight(take, f, i) - weight(take, f - 1, i)) * take.rate_hz / rate_hz);
            }
        }
    }
    const double scale = 60.0 / rate_hz;
    WeightStatistics out{std::vector<double>(shape_count, kDefaultMean),
                         std::vector<double>(shape_count, kDefaultSigma),
                         std::vector<double>(shape_count, kDefaultStepAt60Hz * scale)};
    if (frames == 0.0) return out;
    std::vector<double> spread(shape_count);
    for (std::size_t i = 0; i < shape_count; ++i) out.mean[i] = sum[i] / frames;
    for (const Take& take : takes) {
        for (std::size_t f = 0; f < take.frame_count; ++f) {
            for (std::size_t i = 0; i < shape_count; ++i)
                spread[i] += square(weight(take, f, i) - out.mean[i]);
        }
    }
    for (std::size_t i = 0; i < shape_count; ++i) {
        out.sigma[i] = std::max(kLeastSigma, std::sqrt(spread[i] / frames));
        if (pairs > 0.0) out.step[i] = std::max(kLeastStepAt60Hz * scale, std::sqrt(steps[i] / pairs));
    }
    return out;
}

}  // namespace rig::host
