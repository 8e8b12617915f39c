// The verbs of the companion. Each file of this folder defines one.
#pragma once

#include <CLI/CLI.hpp>

namespace rig::host {

// Exit codes of every verb.
inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;  // ran, and its own bounds did not hold
inline constexpr int kExitUsage = 2;   // the command line is wrong
inline constexpr int kExitInput = 3;   // a file or stream is missing, malformed or inconsistent
inline constexpr int kExitOutput = 4;  // a result could not be written
inline constexpr int kExitDevice = 5;  // the rig, link or world is not there or went away
inline constexpr int kExitInterrupted = 130;

// Each adds its subcommand to `app` and stores its exit code in `exit_code` when it is run. One a line, in
// alphabetical order.
void add_calibrate_verb(CLI::App& app, int& exit_code);
void add_control_verb(CLI::App& app, int& exit_code);
void add_neutral_verb(CLI::App& app, int& exit_code);
void add_demo_verb(CLI::App& app, int& exit_code);
void add_detect_verb(CLI::App& app, int& exit_code);
void add_experiment_verb(CLI::App& app, int& exit_code);
void add_fit_verb(CLI::App& app, int& exit_code);
void add_import_verb(CLI::App& app, int& exit_code);
void add_info_verb(CLI::App& app, int& exit_code);
void add_inspect_verb(CLI::App& app, int& exit_code);
void add_keyshapes_verb(CLI::App& app, int& exit_code);
void add_monitor_verb(CLI::App& app, int& exit_code);
void add_pack_verb(CLI::App& app, int& exit_code);
void add_record_verb(CLI::App& app, int& exit_code);
void add_replay_verb(CLI::App& app, int& exit_code);
void add_report_verb(CLI::App& app, int& exit_code);
void add_sample_verb(CLI::App& app, int& exit_code);
void add_smooth_verb(CLI::App& app, int& exit_code);
void add_solve_verb(CLI::App& app, int& exit_code);
void add_status_verb(CLI::App& app, int& exit_code);
void add_train_verb(CLI::App& app, int& exit_code);
void add_world_verb(CLI::App& app, int& exit_code);

void add_all_verbs(CLI::App& app, int& exit_code);

}  // namespace rig::host
