// The command line of headrigd.
#pragma once

#include <cstdint>
#include <string>

#include "core/pipeline/frame_types.hpp"
#include "core/wire/session_messages.hpp"
#include "firmware_host/settings/filter_settings.hpp"

namespace rig {

enum ExitCode : int {
    kExitOk = 0,        // stopped by a signal, or the world ended
    kExitInternal = 1,  // a bug
    kExitUsage = 2,     // the command line
    kExitInput = 3,     // board file, pack (with --require-pack) or fault plan cannot be used
    kExitLink = 4,      // the link to the host cannot be opened
    kExitWorld = 5,     // no world, or it went away before its end
    kExitOutput = 6,    // a file cannot be written
};

enum class ExecutorChoice : std::uint8_t { kAuto, kThreads, kLockstep };

struct CommandLine {
    std::string board = "sim";
    std::string boards_folder;
    std::string world;
    std::string pack;
    std::string link;
    std::string name = "headrig";
    std::string log_observations;
    std::string faults;
    ExecutorChoice executor = ExecutorChoice::kAuto;
    StartStreams streams{.mask = 0};
    PipelineConfig pipeline;
    FilterSettings smoothing;  // what is said here goes before the board's
    double world_timeout_s = 30.0;
    double wait_host_s = 0.0;
    bool auto_exposure = false;
    double most_exposure_us = 4000.0;  // what motion allows
    int mains_hz = 0;                  // of lamps that flicker; 0: none
    bool require_pack = false;
    bool digest = false;
    bool real_time = false;
};

// False: `exit_code` is final, and what there is to say has been said.
[[nodiscard]] bool parse_command_line(int argc, char** argv, CommandLine& into, int& exit_code);

}  // namespace rig
