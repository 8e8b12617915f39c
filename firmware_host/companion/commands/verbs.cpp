#include "firmware_host/companion/commands/verbs.hpp"

namespace rig::host {

void add_all_verbs(CLI::App& app, int& exit_code) {
    // one call a line, in the order in which a newcomer meets them
    add_detect_verb(app, exit_code);
    add_solve_verb(app, exit_code);
    add_info_verb(app, exit_code);
    add_status_verb(app, exit_code);
    add_monitor_verb(app, exit_code);
    add_record_verb(app, exit_code);
}

}  // namespace rig::host
