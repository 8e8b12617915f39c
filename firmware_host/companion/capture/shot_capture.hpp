// Watches cameras, takes a shot whenever the board is held still in a view that adds something, and writes
// the shots as files that `headrig calibrate cameras --images` reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "firmware_host/companion/calibrate/board.hpp"
#include "firmware_host/companion/capture/board_watch.hpp"
#include "firmware_host/companion/capture/coverage_plan.hpp"
#include "firmware_host/companion/capture/live_cameras.hpp"

namespace rig::host {

struct CaptureTask {
    BoardSpec board;
    std::vector<std::string> names;  // of the cameras, in their order; each is a folder of shots
    std::filesystem::path folder;    // FOLDER/NAME/0001.png
    CoverageGoal goal;
    BoardWatchConfig watch;
    std::int64_t patience_us = 1'000'000;  // for a picture of a device ...
    std::size_t most_waits = 8;            // ... so often in a row, then it counts as gone
};

struct CameraStatusLine {
    BoardMotion motion = BoardMotion::kUnseen;
    std::size_t points = 0;
    std::string fault;  // why the board is not seen
};

struct CaptureStatus {
    const CoveragePlan* plan = nullptr;
    std::vector<CameraStatusLine> cameras;  // in the last moment
    bool took = false;                      // a shot, of the last moment
    std::size_t moments = 0;
};

enum class CaptureEndKind : std::uint8_t {
    kComplete,  // nothing is lacking
    kStopped,   // by the person
    kEnded,     // a recording is over
    kGone,      // a camera went away
};

struct CaptureEnd {
    CaptureEndKind kind = CaptureEndKind::kStopped;
    std::size_t camera = 0;  // that ended or went away
    std::string fault;       // of that camera
    std::size_t shots = 0;
    std::vector<std::size_t> seen;       // moments in which a camera saw the board
    std::vector<std::string> commonest;  // reason why a camera did not; empty when there is none
};

struct CaptureEvents {
    std::function<bool()> stop;                      // asked before every moment
    std::function<void(const CaptureStatus&)> show;  // after every moment
};

// Shots that the folder holds already count (`resume_shots`), and numbers go on after them. Errors: a shot
// cannot be written; what was taken before stays.
class ShotCapture {
  public:
    explicit ShotCapture(CaptureTask task);

    // Number of shots found; they must be pictures of the same board. Errors: a folder or file that cannot be
    // read.
    [[nodiscard]] Result<std::size_t, FileError> resume_shots();
    [[nodiscard]] Result<CaptureEnd, FileError> run(LiveCameras& cameras, const CaptureEvents& events);
    [[nodiscard]] const CoveragePlan& plan() const { return plan_; }

  private:
    [[nodiscard]] Result<void, FileError> look_at(const LiveMoment& moment);
    [[nodiscard]] Result<void, FileError> save(const LiveMoment& moment,
                                               const std::vector<BoardSighting>& sightings);
    [[nodiscard]] CaptureEnd ended(CaptureEndKind kind) const;
    [[nodiscard]] std::filesystem::path shot_path(std::size_t camera, std::size_t number) const;

    CaptureTask task_;
    CoveragePlan plan_;
    std::vector<BoardWatch> watches_;
    CaptureStatus status_;
    std::size_t next_number_ = 1;
    std::vector<std::size_t> seen_;
    std::vector<std::vector<std::pair<std::string, std::size_t>>> reasons_;  // [camera]
};

}  // namespace rig::host
