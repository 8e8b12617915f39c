#include "firmware_host/companion/train/take_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace rig::host {

namespace {

double square(double x) {
    return x * x;
}

// Squared changes of one shape from frame to frame, at rate_hz.
std::vector<double> squared_steps(std::span<const Take> takes, std::size_t shape, std::size_t shape_count,
                                  double rate_hz) {
    std::vector<double> steps;
    for (const Take& take : takes) {
        for (std::size_t f = 1; f < take.frame_count; ++f) {
            const auto now = static_cast<double>(take.weights[f * shape_count + shape]);
            const auto before = static_cast<double>(take.weights[(f - 1) * shape_count + shape]);
            steps.push_back(square((now - before) * take.rate_hz / rate_hz));
        }
    }
    return steps;
}

// Root of the mean of the largest kLivelyShare of them; `steps` is not empty.
double lively_rms(std::vector<double> steps) {
    const auto share =
        static_cast<std::ptrdiff_t>(std::ceil(kLivelyShare * static_cast<double>(steps.size())));
    std::ranges::sort(steps, std::greater<>());  // sorted, so that the sum has one order
    double sum = 0.0;
    for (auto it = steps.begin(); it != steps.begin() + share; ++it) sum += *it;
    return std::sqrt(sum / static_cast<double>(share));
}

}  // namespace

WeightStatistics weight_statistics(std::span<const Take> takes, std::size_t shape_count, double rate_hz) {
    const double scale = 60.0 / rate_hz;
    WeightStatistics out{std::vector<double>(shape_count, kDefaultMean),
                         std::vector<double>(shape_count, kDefaultSigma),
                         std::vector<double>(shape_count, kDefaultStepAt60Hz * scale)};
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    if (frames == 0) return out;
    for (std::size_t i = 0; i < shape_count; ++i) {
        double sum = 0.0;
        double spread = 0.0;
        for (const Take& take : takes) {
            for (std::size_t f = 0; f < take.frame_count; ++f)
                sum += static_cast<double>(take.weights[f * shape_count + i]);
        }
        const double mean = sum / static_cast<double>(frames);
        for (const Take& take : takes) {
            for (std::size_t f = 0; f < take.frame_count; ++f) {
                spread += square(static_cast<double>(take.weights[f * shape_count + i]) - mean);
            }
        }
        const double sigma = std::sqrt(spread / static_cast<double>(frames));
        if (sigma < kAsleepSigma) continue;
        out.mean[i] = mean;
        out.sigma[i] = std::max(kLeastSigma, sigma);
        const std::vector<double> steps = squared_steps(takes, i, shape_count, rate_hz);
        if (!steps.empty()) out.step[i] = std::max(kLeastStepAt60Hz * scale, lively_rms(steps));
    }
    return out;
}

}  // namespace rig::host
