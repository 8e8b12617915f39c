// What a set of board pictures still lacks, and whether a view adds to it: areas of each picture, tilts of
// the board, moments that link the cameras. Numbers alone; no pictures, cameras or clocks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware_host/companion/calibrate/board.hpp"
#include "firmware_host/companion/calibrate/board_detection.hpp"
#include "firmware_host/companion/calibrate/calibration.hpp"

namespace rig::host {

// How the board leans, as the camera sees it: which side of the picture of it is further away.
enum class BoardTilt : std::uint8_t { kFacing, kTopAway, kBottomAway, kLeftAway, kRightAway };
inline constexpr std::size_t kTiltCount = 5;

struct PictureSize {
    int width_px = 0;
    int height_px = 0;
};

// Sine of the angle between board and picture plane, as a vector towards the side that is further away
// (x right, y down). From the perspective of the board's homography (Hartley and Zisserman 2004 section 2.3);
// the focal length is not known yet and taken as the longer side of the picture, so it is good to some tens
// of percent. Nothing with under kLeastPoints points or points in a row.
struct BoardLean {
    double x = 0.0;
    double y = 0.0;
};
[[nodiscard]] std::optional<BoardLean> board_lean(const BoardSpec& board, const BoardSighting& sighting,
                                                  PictureSize size);
[[nodiscard]] BoardTilt tilt_of(const BoardLean& lean);

struct CoverageGoal {
    std::size_t pictures = kGoodPictures + 3;  // of each camera; some are left out by calibration
    double fields = 0.6;                       // share of kCoverageFields^2 with a point
    std::size_t each_tilt = 2;                 // pictures of each tilt but facing
    std::size_t linked = kLeastShared + 2;     // moments that a camera shares with one linked already
};

// Of one camera.
struct CoverageProgress {
    std::size_t pictures = 0;
    std::array<bool, kCoverageFields * kCoverageFields> seen{};
    std::array<std::size_t, kTiltCount> tilts{};
    bool linked = true;  // to the first camera, directly or through others

    [[nodiscard]] double share() const;
};

class CoveragePlan {
  public:
    CoveragePlan(BoardSpec board, std::size_t cameras, const CoverageGoal& goal = {});

    // One sighting a camera, without points where the board is not seen, and the pictures' sizes. True when a
    // camera gets at least two new fields, a tilt that it lacks, a link, or another picture unlike every
    // earlier one while it has too few. A view that all cameras have had adds nothing.
    [[nodiscard]] bool adds(std::span<const BoardSighting> sightings,
                            std::span<const PictureSize> sizes) const;
    void take(std::span<const BoardSighting> sightings, std::span<const PictureSize> sizes);

    [[nodiscard]] bool complete() const;
    // Share of the goal that is reached, 0 to 1; 1 exactly when complete.
    [[nodiscard]] double progress() const;
    // What to do next, for the camera that lacks most: "hold the board in the upper left of camera b". Empty
    // when complete. `names`: of the cameras.
    [[nodiscard]] std::string advice(std::span<const std::string> names) const;
    [[nodiscard]] const CoverageProgress& camera(std::size_t c) const { return cameras_[c]; }
    [[nodiscard]] const CoverageGoal& goal() const { return goal_; }
    [[nodiscard]] std::size_t shots() const { return shots_; }

  private:
    struct TakenView {
        BoardSighting sighting;
        std::optional<BoardLean> lean;
    };
    [[nodiscard]] bool adds_to(std::size_t c, std::span<const BoardSighting> sightings,
                               PictureSize size) const;
    [[nodiscard]] bool is_unlike_earlier(std::size_t c, const BoardSighting& sighting,
                                         PictureSize size) const;
    [[nodiscard]] double camera_progress(std::size_t c) const;
    void update_links();

    BoardSpec board_;
    CoverageGoal goal_;
    std::size_t shots_ = 0;
    std::vector<CoverageProgress> cameras_;
    std::vector<std::vector<TakenView>> earlier_;   // [camera]
    std::vector<std::vector<std::size_t>> shared_;  // [camera][camera]: moments
};

}  // namespace rig::host
