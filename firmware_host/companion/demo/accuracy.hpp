// How far a received run is from the truth of the world it was made in.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/face_state.hpp"
#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

// Shapes whose marker column is longer than this (mm per unit weight, all markers together) are judged; the
// others hardly move a marker, so that their weights say more about priors than about the solver.
inline constexpr double kObservableColumnMm = 1.0;

struct AccuracyFigures {
    std::uint64_t frames_judged = 0;  // with a solve behind them
    std::uint64_t frames_held = 0;    // without
    std::uint64_t observable_shapes = 0;
    double weight_rms = 0.0;  // over observable shapes and judged frames
    double worst_frame_weight_rms = 0.0;
    double marker_rms_mm =
        0.0;  // 3D distance, markers seen by two cameras or more; by one when the rig has one
    std::uint64_t markers_judged = 0;
    std::uint64_t identity_errors = 0;  // markers that lie on another marker's true place
    std::vector<double> shape_rms;      // per shape, judged frames
};

class Accuracy {
  public:
    Accuracy(const World& world, const MarkerModel& model);

    void add_state(std::size_t frame, const FaceState& state);
    void add_markers(std::size_t frame, const MarkerFrame& markers);
    [[nodiscard]] AccuracyFigures figures() const;
    [[nodiscard]] bool observable(std::size_t shape) const { return column_mm_[shape] > kObservableColumnMm; }

  private:
    [[nodiscard]] bool names_another(const FrameTruth& truth, std::size_t marker,
                                     const MarkerSample& sample) const;

    const World& world_;
    std::vector<double> column_mm_;
    std::vector<double> shape_squares_;
    std::uint64_t judged_ = 0;
    std::uint64_t held_ = 0;
    double worst_frame_ = 0.0;
    double marker_squares_mm2_ = 0.0;
    std::uint64_t markers_ = 0;
    std::uint64_t identity_errors_ = 0;
};

}  // namespace rig::host
