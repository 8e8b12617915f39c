// Solves a recorded observation log again, with the settings it was recorded with. The same pack and the same
// observations give the same bytes on every machine and with every build; the digest says so in one number.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/face_state.hpp"
#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

struct ReplayRequest {
    std::filesystem::path log;
    std::string pack_name;      // for messages
    bool another_pack = false;  // accept a pack other than the recorded one
    bool as_solved =
        false;  // without smoothing and an artist's controls: the weights that the markers ask for
};

struct ReplayResult {
    std::uint64_t digest = 0;
    std::uint64_t ticks = 0;
    double rate_hz = 0.0;   // as recorded
    bool controls = false;  // the log sets some
    bool camera_on_head = true;
    std::string cut;  // why the log ended early; empty when it is whole
};

// One tick, right after its step().
struct ReplayedTick {
    const FaceState& state;
    const FrameReport& report;
    const Pipeline& pipeline;
    bool reset_before = false;  // tracking was reset by hand
    double time_s = 0.0;        // since the first tick
    double share = 0.0;         // of the log that is read, 0..1
};
// Each tick in order. Return false to stop.
using ReplayVisitor = std::function<bool(const ReplayedTick& tick)>;

// Errors: the log is missing or no log, was recorded with another pack or number of cameras.
[[nodiscard]] Result<ReplayResult, FileError> replay_log(const ReplayRequest& request, const OpenedPack& pack,
                                                         const ReplayVisitor& visit);

}  // namespace rig::host
