#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <system_error>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"

namespace {

constexpr std::string_view kFooter =
    "Each verb explains itself: headrig VERB --help\n"
    "Exit codes: 0 done; 1 ran, but its own bounds did not hold, or a fault of the program; 2 the command "
    "line\n"
    "is wrong; 3 an input is missing or malformed; 4 an output cannot be written; 5 the rig, link or world "
    "is\n"
    "not there or went away; 130 stopped by Ctrl-C.";

// What was printed must have arrived: a full disk behind a redirection is a failure like any other.
int flushed(int exit_code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
    rig::host::print_error(
        fmt::format("standard output: cannot be written: {}", std::generic_category().message(errno)));
    return rig::host::kExitOutput;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"headrig: train, simulate, watch and record a head-mounted facial solver"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "headrig " RIG_VERSION);
    app.get_formatter()->column_width(34);
    int exit_code = rig::host::kExitOk;
    rig::host::add_all_verbs(app, exit_code);
    app.footer(std::string(kFooter));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int cli_code = app.exit(error);
        return flushed(cli_code == 0 ? rig::host::kExitOk : rig::host::kExitUsage);
    } catch (const std::system_error& error) {  // what fmt throws when it cannot print
        rig::host::print_error(fmt::format("standard output: {}", error.what()));
        return rig::host::kExitOutput;
    } catch (const std::exception& error) {
        rig::host::print_error(error.what());
        return rig::host::kExitFailed;
    }
    return flushed(exit_code);
}
