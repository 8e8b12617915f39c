// Solves a recorded observation log again, with the settings it was recorded with. The same pack and the same
// observations give the same bytes on every machine and with every build; the digest says so in one number.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/face_state.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

struct ReplayRequest {
    std::filesystem::path log;
    std::string pack_name;      // for messages
    bool another_pack = false;  // accept a pack other than the recorded one
};

struct ReplayResult {
    std::uint64_t digest = 0;
    std::uint64_t ticks = 0;
    std::string cut;  // why the log ended early; empty when it is whole
};

// state: of each tick in order, with the time since the first, seconds. Return false to stop.
using ReplayedTick = std::function<bool(const FaceState& state, double time_s)>;

// Errors: the log is missing or no log, was recorded with another pack or number of cameras.
[[nodiscard]] Result<ReplayResult, FileError> replay_log(const ReplayRequest& request, const OpenedPack& pack,
                                                         const ReplayedTick& tick);

}  // namespace rig::host
