// headrig neutral: the face at rest becomes the neutral one of a rig that is running.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

namespace {

struct NeutralOptions {
    std::string link;
    bool forget = false;
    double timeout_s = 2.0 * kAnswerTimeout_s;
};

// The board's own words, once the taking has ended.
struct Ending {
    std::string text;
    bool taken = false;
};

const char* refusal_text(NakReason reason) {
    return reason == NakReason::kNotNow
               ? "the board has no pack whose neutral could be taken, or is older than this program"
               : "this board takes no such command; update the older of the two programs";
}

int ask(const NeutralOptions& options, LinkSession& link, const Ending& ending) {
    HostSession& session = link.session();
    session.command(options.forget ? BoardCommand::kForgetNeutral : BoardCommand::kNeutral);
    auto end = link.run([&] { return session.command_answered(); }, options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, link);
    if (session.command_refusal()) {
        print_error(fmt::format("{}: {}", link.link_text(), refusal_text(*session.command_refusal())));
        return kExitDevice;
    }
    if (options.forget) {
        fmt::print("neutral forgotten\n");
        return kExitOk;
    }
    end = link.run([&] { return !ending.text.empty(); }, options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, link);
    if (!ending.taken) {
        print_error(ending.text);
        return kExitDevice;
    }
    fmt::print("{}\n", ending.text);
    return kExitOk;
}

int run_neutral(const NeutralOptions& options) {
    Ending ending;
    SessionOptions wanted;
    wanted.streams = 0;
    wanted.names = false;
    SessionEvents events;
    events.event = [&](const EventMessage& event) {
        const std::string_view text = event.text.view();
        if (event.kind != EventKind::kLog || !text.starts_with("neutral ")) return;
        ending.taken = text.starts_with("neutral taken");
        ending.text = printable(text);
    };
    const auto link = LinkSession::open(options.link, wanted, std::move(events));
    if (!link) return kExitDevice;
    const auto end = link->run_until_ready(options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, *link);
    return ask(options, *link, ending);
}

}  // namespace

void add_neutral_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<NeutralOptions>();
    CLI::App* verb = app.add_subcommand("neutral", "Take the face at rest for the neutral one, live");
    add_link_option(*verb, options->link)->required();
    verb->add_flag("--forget", options->forget, "go back to the neutral of the pack");
    add_timeout_option(*verb, options->timeout_s);
    verb->footer(
        "The performer rests for a second; each dot's offset from the pack's neutral is then taken off.\n"
        "Refused, with the reason, when the face moves, holds an expression, is not seen, or a dot is more\n"
        "than 5 mm off. Holds until it is taken anew, forgotten, or the board restarts.\n"
        "Examples:\n"
        "  headrig neutral --link /dev/pts/5\n"
        "  headrig neutral --link udp:127.0.0.1:7777 --forget\n"
        "Exit codes: 0 taken or forgotten, 5 no rig answers or it refuses.");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_neutral(*options);
    });
}

}  // namespace rig::host
