// What a picture of one moment shows, kept until it is known which moments of a take are the worst.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "core/pipeline/pipeline.hpp"

namespace rig::host {

// A blob, or a point of a marker stream. Coordinates in the view's own px, integers at pixel centres.
struct SceneBlob {
    double x_px = 0.0;
    double y_px = 0.0;
    double diameter_px = 0.0;
    int marker = -1;  // -1: nobody's
};

// A marker that this view did not see, where it must be.
struct SceneGuess {
    double x_px = 0.0;
    double y_px = 0.0;
    int marker = 0;
    bool seen_elsewhere = false;  // by another camera
};

struct SceneView {
    std::string title;
    double width_px = 0.0;
    double height_px = 0.0;
    std::filesystem::path picture;  // grey image behind it; empty: none was recorded
    std::vector<SceneBlob> blobs;
    std::vector<SceneGuess> guesses;
};

struct Moment {
    std::size_t tick = 0;
    double time_s = 0.0;
    std::vector<std::string> reasons;
    std::vector<SceneView> views;
};

// Of the pipeline's last step on images or observations: a view for each camera. `pictures`: the files of
// this tick, empty where there are none; shorter than the cameras is the same.
[[nodiscard]] std::vector<SceneView> camera_views(const SolvePack& pack, const Pipeline& pipeline,
                                                  const FaceState& state, const FrameReport& report,
                                                  const std::vector<std::string>& cameras,
                                                  const std::vector<std::filesystem::path>& pictures);

// Of the last step on a marker stream: the face from the front, the performer's left on the right. `labels`:
// the marker of each position, -1 nobody's; positions that are not finite are left out.
[[nodiscard]] std::vector<SceneView> front_views(const SolvePack& pack, const Pipeline& pipeline,
                                                 const FaceState& state, const FrameReport& report,
                                                 std::span<const Vec3> positions_mm,
                                                 std::span<const std::int16_t> labels);

// Keeps the worst tick of each kind. Costs of the others are only compared, so that a view is drawn up for a
// new worst one alone.
class WorstMoments {
  public:
    enum class Kind : std::uint8_t { kLoss, kHidden, kResidual, kRepair, kGhosts, kSlip, kFirst };
    static constexpr std::size_t kKinds = 7;

    // True when a tick with this badness (> 0) is worse than any before it; then call keep().
    [[nodiscard]] bool is_worst(Kind kind, double badness) const;
    void keep(Kind kind, double badness, std::string reason, std::size_t tick, double time_s,
              const std::vector<SceneView>& views);
    // In order of time; ticks that are kept for several reasons, or lie within `apart_s` of a worse one,
    // once.
    [[nodiscard]] std::vector<Moment> taken(double apart_s) const;

  private:
    struct Kept {
        double badness = 0.0;
        Moment moment;
    };
    std::array<Kept, kKinds> kept_;
};

}  // namespace rig::host
