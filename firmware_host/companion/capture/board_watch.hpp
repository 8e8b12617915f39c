// Whether the board that one camera sees is held still. A moving board blurs, and two cameras that do not
// expose at the same instant see it in two places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware_host/companion/calibrate/board_detection.hpp"

namespace rig::host {

struct BoardWatchConfig {
    double most_move_px = 1.0;             // rms over the points, since the board came to rest
    std::int64_t hold_us = 300'000;        // at rest for so long ...
    std::size_t least_moments = 3;         // ... and seen so often in it,
    std::int64_t most_gap_us = 1'500'000;  // no longer apart than this: between, it may have been anywhere
    std::size_t least_points = 6;          // that two pictures share
};

enum class BoardMotion : std::uint8_t { kUnseen, kMoving, kStill };

class BoardWatch {
  public:
    explicit BoardWatch(const BoardWatchConfig& config) : config_(config) {}

    // Times rise. Displacements are from the first picture of the rest, not from the last one: a slow drift
    // does not pass for rest.
    BoardMotion push(std::int64_t time_us, const BoardSighting& sighting);

  private:
    BoardWatchConfig config_;
    std::optional<BoardSighting> rest_;  // first picture of the rest
    std::int64_t rest_us_ = 0;
    std::int64_t last_us_ = 0;
    std::size_t moments_ = 0;
};

// rms distance of the points that both have, px; nothing with under `least` of them.
[[nodiscard]] std::optional<double> sighting_distance_px(const BoardSighting& a, const BoardSighting& b,
                                                         std::size_t least);

}  // namespace rig::host
