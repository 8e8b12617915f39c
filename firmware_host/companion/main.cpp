#include <CLI/CLI.hpp>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"

int main(int argc, char** argv) {
    CLI::App app{"headrig: train, simulate, watch and record a head-mounted facial solver"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "headrig " RIG_VERSION);
    app.get_formatter()->column_width(34);
    int exit_code = rig::host::kExitOk;
    rig::host::add_all_verbs(app, exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int cli_code = app.exit(error);
        return cli_code == 0 ? rig::host::kExitOk : rig::host::kExitUsage;
    }
    return exit_code;
}
