// The recorded head and takes, and marker frames made from them, as the experiments need them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

struct RecordedHead {
    Rig rig;
    MarkerLayout layout;
    MarkerModel model;  // b0 and B of the layout
    Take range_of_motion;
    Take speech;
};

// `layout`: "50", "60" or "102".
[[nodiscard]] Result<RecordedHead, FileError> load_recorded_head(const std::filesystem::path& data,
                                                                 const std::string& layout);

// The markers of one frame, b0 + B w [3m], plus white noise that depends on `seed` and `frame` alone.
[[nodiscard]] std::vector<float> marker_frame(const MarkerModel& model, const Take& take, std::size_t frame,
                                              double noise_mm, std::uint64_t seed);

// Root mean square of weight errors over the shapes whose marker column is longer than 1 mm: the others are
// guesses with any solver.
class WeightError {
  public:
    explicit WeightError(const MarkerModel& model);
    void add(std::span<const float> solved, std::span<const float> truth);  // [N] each
    [[nodiscard]] double rms() const;

  private:
    std::vector<std::size_t> visible_;
    double sum_ = 0.0;
    double count_ = 0.0;
};

// The weights of one frame of a take [N].
[[nodiscard]] std::span<const float> frame_weights(const Take& take, std::size_t frame);

// 0..1; values are reordered.
[[nodiscard]] double quantile(std::vector<double>& values, double share);

}  // namespace rig::host
