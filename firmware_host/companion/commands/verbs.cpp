#include "firmware_host/companion/commands/verbs.hpp"

namespace rig::host {

void add_all_verbs(CLI::App& app, int& exit_code) {
    // in the order in which a newcomer meets them
    add_demo_verb(app, exit_code);
    add_sample_verb(app, exit_code);
    add_import_verb(app, exit_code);
    add_world_verb(app, exit_code);
    add_calibrate_verb(app, exit_code);
    add_fit_verb(app, exit_code);
    add_train_verb(app, exit_code);
    add_keyshapes_verb(app, exit_code);
    add_pack_verb(app, exit_code);
    add_report_verb(app, exit_code);
    add_solve_verb(app, exit_code);
    add_smooth_verb(app, exit_code);
    add_detect_verb(app, exit_code);
    add_monitor_verb(app, exit_code);
    add_record_verb(app, exit_code);
    add_replay_verb(app, exit_code);
    add_inspect_verb(app, exit_code);
    add_status_verb(app, exit_code);
    add_control_verb(app, exit_code);
    add_neutral_verb(app, exit_code);
    add_info_verb(app, exit_code);
    add_experiment_verb(app, exit_code);
}

}  // namespace rig::host
