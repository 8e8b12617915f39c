#include "firmware_host/companion/experiments/performance.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

Result<RecordedHead, FileError> load_recorded_head(const std::filesystem::path& data,
                                                   const std::string& layout) {
    RecordedHead out;
    auto rig = load_rig(data / "rig");
    if (!rig) return failure(rig.error());
    out.rig = std::move(*rig);
    auto markers = load_layout(data / "rig", layout, out.rig);
    if (!markers) return failure(markers.error());
    out.layout = std::move(*markers);
    out.model = marker_model(out.rig, out.layout);
    auto range_of_motion = load_take(data / "takes/alex_rom_3_weights60.csv", out.rig);
    if (!range_of_motion) return failure(range_of_motion.error());
    out.range_of_motion = std::move(*range_of_motion);
    auto speech = load_take(data / "takes/facegood_3_15_weights60.csv", out.rig);
    if (!speech) return failure(speech.error());
    out.speech = std::move(*speech);
    return out;
}

std::span<const float> frame_weights(const Take& take, std::size_t frame) {
    const std::size_t n = take.shape_names.size();
    return std::span(take.weights).subspan(frame * n, n);
}

std::vector<float> marker_frame(const MarkerModel& model, const Take& take, std::size_t frame,
                                double noise_mm, std::uint64_t seed) {
    const std::span<const float> w = frame_weights(take, frame);
    std::vector<float> out(model.neutral_mm.size());
    WhiteNoise noise(seed + 7919 * frame);
    for (std::size_t r = 0; r < out.size(); ++r) {
        auto t = static_cast<double>(model.neutral_mm[r]) + noise_mm * noise.next();
        for (std::size_t i = 0; i < w.size(); ++i) {
            t += static_cast<double>(model.basis_mm[r * w.size() + i]) * static_cast<double>(w[i]);
        }
        out[r] = static_cast<float>(t);
    }
    return out;
}

WeightError::WeightError(const MarkerModel& model) {
    const std::size_t rows = model.neutral_mm.size();
    const std::size_t n = model.basis_mm.size() / rows;
    for (std::size_t i = 0; i < n; ++i) {
        double square = 0.0;
        for (std::size_t r = 0; r < rows; ++r) {
            const auto b = static_cast<double>(model.basis_mm[r * n + i]);
            square += b * b;
        }
        if (square > 1.0) visible_.push_back(i);
    }
}

void WeightError::add(std::span<const float> solved, std::span<const float> truth) {
    for (const std::size_t i : visible_) {
        const double error = static_cast<double>(solved[i]) - static_cast<double>(truth[i]);
        sum_ += error * error;
    }
    count_ += static_cast<double>(visible_.size());
}

double WeightError::rms() const {
    return count_ > 0.0 ? std::sqrt(sum_ / count_) : 0.0;
}

double quantile(std::vector<double>& values, double share) {
    if (values.empty()) return 0.0;
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::ranges::nth_element(values, values.begin() + at);
    return values[static_cast<std::size_t>(at)];
}

}  // namespace rig::host
