#include "firmware_host/companion/fit/marker_noise.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

namespace {

using Eigen::Index;

constexpr double kMedianOfNormal = 0.6744897501960817;       // of |x|, x ~ N(0, 1)
constexpr double kFourthDifferenceGain = 8.366600265340756;  // sqrt(1 + 16 + 36 + 16 + 1)
constexpr double kAtBound = 1e-4;                            // a weight this near its bound is held by it

void pool(CoordinateNoise& noise) {
    double sum = 0.0;
    for (const Vec3& sigma : noise.sigma_mm) {
        if (sigma == Vec3::Zero()) continue;
        sum += sigma.squaredNorm() / 3.0;
        ++noise.markers;
    }
    if (noise.markers > 0) noise.pooled_mm = std::sqrt(sum / static_cast<double>(noise.markers));
}

double median(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

// True when frames [first, first + 5) saw the marker.
bool five_seen(const MarkerTake& take, std::size_t first, std::size_t marker) {
    for (std::size_t f = first; f < first + 5; ++f) {
        if (!take.seen(f, marker)) return false;
    }
    return true;
}

}  // namespace

CoordinateNoise noise_of_hold(const MarkerTake& take, std::size_t begin, std::size_t end) {
    CoordinateNoise noise;
    noise.sigma_mm.assign(take.marker_count, Vec3::Zero());
    const std::size_t last = std::min(end, take.frame_count);
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        Vec3 mean = Vec3::Zero();
        std::size_t count = 0;
        for (std::size_t f = begin; f < last; ++f) {
            if (!take.seen(f, k)) continue;
            mean += take.at(f, k);
            ++count;
        }
        if (count < kLeastNoiseSamples) continue;
        mean /= static_cast<double>(count);
        Vec3 squares = Vec3::Zero();
        for (std::size_t f = begin; f < last; ++f) {
            if (take.seen(f, k)) squares += (take.at(f, k) - mean).cwiseAbs2();
        }
        noise.sigma_mm[k] = (squares / static_cast<double>(count - 1)).cwiseSqrt();
    }
    pool(noise);
    return noise;
}

CoordinateNoise noise_of_differences(const MarkerTake& take) {
    CoordinateNoise noise;
    noise.sigma_mm.assign(take.marker_count, Vec3::Zero());
    std::array<std::vector<double>, 3> differences;
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        for (std::vector<double>& axis : differences) axis.clear();
        for (std::size_t f = 0; f + 5 <= take.frame_count; ++f) {
            if (!five_seen(take, f, k)) continue;
            const Vec3 d = take.at(f, k) - 4.0 * take.at(f + 1, k) + 6.0 * take.at(f + 2, k) -
                           4.0 * take.at(f + 3, k) + take.at(f + 4, k);
            for (std::size_t a = 0; a < 3; ++a) differences[a].push_back(std::abs(d[static_cast<Index>(a)]));
        }
        if (differences[0].size() < kLeastNoiseSamples) continue;
        for (std::size_t a = 0; a < 3; ++a) {
            noise.sigma_mm[k][static_cast<Index>(a)] =
                median(differences[a]) / (kMedianOfNormal * kFourthDifferenceGain);
        }
    }
    pool(noise);
    return noise;
}

std::optional<double> noise_of_residual(const SolvePack& pack, const MarkerTake& take,
                                        const SolvedTake& solved) {
    using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto rows = static_cast<Index>(3 * take.marker_count);
    const Eigen::MatrixXd basis =
        Eigen::Map<const FloatRows>(pack.basis_mm.data(), rows, pack.shape_count).cast<double>();
    const Eigen::VectorXd neutral =
        Eigen::Map<const Eigen::VectorXf>(pack.neutral_mm.data(), rows).cast<double>();
    double squares = 0.0;
    double freedom = 0.0;
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        if (!solved.solved[f]) continue;
        const Eigen::VectorXd w = solved.weights.row(static_cast<Index>(f)).transpose();
        const Eigen::VectorXd model = neutral + basis * w;
        for (Index i = 0; i < w.size(); ++i) {
            const auto at = static_cast<std::size_t>(i);
            const bool held = w[i] <= static_cast<double>(pack.weight_low[at]) + kAtBound ||
                              w[i] >= static_cast<double>(pack.weight_high[at]) - kAtBound;
            freedom -= held ? 0.0 : 1.0;
        }
        for (std::size_t k = 0; k < take.marker_count; ++k) {
            if (!take.seen(f, k)) continue;
            const Vec3 x = solved.headset_from_face[f].apply_inverse(take.at(f, k));
            squares += (x - model.segment<3>(static_cast<Index>(3 * k))).squaredNorm();
            freedom += 3.0;
        }
    }
    if (freedom <= 0.0) return std::nullopt;
    return std::sqrt(squares / freedom);
}

}  // namespace rig::host
