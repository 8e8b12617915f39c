// Real heads and real performances for replay tests: packs made straight from the arrays of a rig folder (so
// that they do not depend on the trainer), marker streams, and the true weights behind them. Data:
// ../shared/data, see its README.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::test {

// The numbers a trainer would choose for this head; written down here so that a change of the trainer's
// defaults cannot move these bounds.
class ReplayPack {
  public:
    // rig/markers_<markers>_neutral.npy and _B.npy under `data`. Throws std::runtime_error with the file's
    // error.
    ReplayPack(const std::filesystem::path& data, int markers);

    [[nodiscard]] SolvePack pack() const;
    [[nodiscard]] std::size_t shape_count() const { return low_.size(); }
    // Length of a shape's column in B, mm.
    [[nodiscard]] double column_length(std::size_t shape) const;
    // Sum of squares over coordinates of B d, mm^2.
    [[nodiscard]] double marker_error2(const std::vector<double>& difference) const;

  private:
    int markers_;
    std::vector<float> neutral_mm_;
    std::vector<float> basis_mm_;
    std::vector<float> low_;
    std::vector<float> high_;
    std::vector<float> mean_;
    std::vector<float> sigma_;
    std::vector<float> gamma_;
};

struct ReplayStream {
    std::size_t frames = 0;
    std::size_t slots = 0;
    std::vector<Vec3> points;  // [frames x slots], NaN = missing
    std::vector<std::int32_t>
        truth;  // [frames x slots] of an unlabelled stream: the marker, -1 a ghost; else empty
    bool unlabelled = false;
};
[[nodiscard]] ReplayStream read_stream(const std::filesystem::path& file);

// [1200 x shapes], the take's weights from the window's first frame on (manifest.json: window_frames).
[[nodiscard]] std::vector<std::vector<double>> read_truth(const std::filesystem::path& data,
                                                          const std::string& take);

struct ReplayRun {
    std::vector<std::vector<float>> weights;  // [frames x shapes]
    std::vector<TrackingState> states;
    std::vector<Slip> slips;
    std::size_t optimal = 0;
    double worst_kkt = 0.0;
    // unlabelled streams, from frame 30 on
    std::size_t visible = 0;
    std::size_t right = 0;
    std::size_t wrong = 0;  // a marker named as another
    std::size_t ghosts_named = 0;
    std::uint64_t digest = 0;  // FNV-1a of weights and states
};
[[nodiscard]] ReplayRun run_stream(const ReplayPack& pack, const ReplayStream& stream,
                                   const PipelineConfig& config);

}  // namespace rig::test
