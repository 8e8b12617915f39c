// headrig status: one look at a rig's health.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/links/fault_text.hpp"
#include "firmware_host/companion/links/session_text.hpp"

namespace rig::host {

namespace {

struct StatusOptions {
    std::string link;
    bool list_faults = false;
    bool check = false;
    double timeout_s = kAnswerTimeout_s;
};

int list_faults() {
    for (int number = 1; number <= kLastFault; ++number) {
        fmt::print("{} {}\n", fault_code(number), fault_text(number));
    }
    return kExitOk;
}

// Boards tell it before the status that was asked for.
void note_marker_trouble(const EventMessage& event, std::vector<std::string>& told) {
    if (event.kind == EventKind::kLog && event.text.view().starts_with("marker "))
        told.push_back(printable(event.text.view()));
}

int run_status(const StatusOptions& options) {
    std::optional<Health> health;
    SessionOptions wanted;
    wanted.streams = 0;
    wanted.names = false;
    SessionEvents events;
    std::vector<std::string> told;
    events.event = [&](const EventMessage& event) { note_marker_trouble(event, told); };
    events.status = [&](const Health& received) { health = received; };
    const auto link = LinkSession::open(options.link, wanted, std::move(events));
    if (!link) return kExitDevice;
    link->session().request_status();
    const auto end = link->run([&] { return health.has_value(); }, options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, *link);
    for (const std::string& line : health_lines(*health)) fmt::print("{}\n", line);
    const auto faults = fault_lines(*health);
    if (faults.empty()) fmt::print("faults: none\n");
    for (const std::string& line : faults) fmt::print("{}\n", line);
    for (const std::string& line : told) fmt::print("{}\n", line);
    const bool well = health->faults == 0 && health->state >= TrackingState::kPartial;
    return options.check && !well ? kExitFailed : kExitOk;
}

}  // namespace

void add_status_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<StatusOptions>();
    CLI::App* verb = app.add_subcommand("status", "One look at a rig's health, faults in plain words");
    add_link_option(*verb, options->link);
    verb->add_flag("--check", options->check,
                   "exit code 1 when a fault is present or the face is not tracked");
    verb->add_flag("--list-faults", options->list_faults, "what every fault code means; needs no rig");
    add_timeout_option(*verb, options->timeout_s);
    verb->footer(
        "Owns nothing: another host may stream meanwhile.\nExamples:\n  headrig status --link /dev/pts/5\n"
        "  headrig status --link udp:127.0.0.1:7777 --check && echo well\n  headrig status --list-faults\n"
        "Exit codes: 0 told, 1 not well (with --check), 5 no rig answers.");
    verb->callback([verb, options, &exit_code] {
        if (options->link.empty() && !options->list_faults) {
            throw CLI::RequiredError(verb->get_name() + ": --link LINK");
        }
        install_interrupt_handler();
        exit_code = options->list_faults ? list_faults() : run_status(*options);
    });
}

}  // namespace rig::host
