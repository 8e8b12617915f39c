// headrig control: an artist's wishes to a rig that is running.
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "core/wire/control_message.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/settings/control_settings.hpp"
#include "firmware_host/settings/settings_file.hpp"

namespace rig::host {

namespace {

struct ControlOptions {
    std::string link;
    std::vector<std::string> controls;
    std::string file;
    bool neutral = false;
    bool list_shapes = false;
    double timeout_s = kAnswerTimeout_s;
};

std::vector<ControlMessage> messages_of(const std::vector<ControlEdit>& edits, bool neutral_first) {
    std::vector<ControlMessage> messages(1);
    messages[0].neutral_first = neutral_first;
    for (const ControlEdit& edit : edits) {
        if (messages.back().edits.full()) messages.emplace_back();
        static_cast<void>(messages.back().edits.push_back(edit));
    }
    return messages;
}

const char* refusal_text(NakReason reason) {
    switch (reason) {
        case NakReason::kUnknownType:
        case NakReason::kVersion:
        case NakReason::kBadLength:
            return "this board takes no such controls; update the older of the two programs";
        case NakReason::kBadValue:
            return "the board refuses a value, or there are more than 128 pairs";
        case NakReason::kNotNow:
            return "the board has no pack to control";
        case NakReason::kBusy:
        case NakReason::kDenied:
            break;
    }
    return "the board does not allow this over this link";
}

int list_shapes(const std::vector<std::string_view>& names) {
    for (const std::string_view name : names) fmt::print("{}\n", name);
    return kExitOk;
}

int send_controls(const ControlOptions& options, const std::vector<std::string>& lines, LinkSession& link) {
    const std::vector<std::string>& own = link.session().shape_names();
    const std::vector<std::string_view> names(own.begin(), own.end());
    if (options.list_shapes) return list_shapes(names);
    const auto edits = parse_controls(lines, names);
    if (!edits) {
        print_error(edits.error());
        return kExitUsage;
    }
    for (const ControlMessage& message : messages_of(*edits, options.neutral))
        link.session().control(message);
    const auto end = link.run([&] { return link.session().controls_waiting() == 0; }, options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, link);
    if (const auto& refusal = link.session().control_refusal()) {
        print_error(fmt::format("{}: {}", link.link_text(), refusal_text(*refusal)));
        return kExitDevice;
    }
    fmt::print("{} controls set\n", edits->size());
    return kExitOk;
}

int run_control(const ControlOptions& options) {
    std::vector<std::string> lines;
    if (!options.file.empty()) {
        auto file = read_settings_file(options.file);
        if (!file) {
            print_error(file.error());
            return kExitInput;
        }
        lines = std::move(file->controls);
    }
    lines.insert(lines.end(), options.controls.begin(), options.controls.end());
    SessionOptions wanted;
    wanted.streams = 0;
    const auto link = LinkSession::open(options.link, wanted, {});
    if (!link) return kExitDevice;
    const auto end = link->run_until_ready(options.timeout_s);
    if (end != LinkSession::End::kDone) return report_end(end, *link);
    return send_controls(options, lines, *link);
}

}  // namespace

void add_control_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<ControlOptions>();
    CLI::App* verb = app.add_subcommand("control", "Set an artist's controls on a running rig, live");
    add_link_option(*verb, options->link)->required();
    verb->add_option("--set", options->controls, "one wish, see below; may be repeated")
        ->type_name("CONTROL");
    verb->add_option("--controls", options->file, "the [controls] of a settings file, before those of --set")
        ->type_name("FILE.toml");
    verb->add_flag("--neutral", options->neutral, "first take back everything that was ever set");
    verb->add_flag("--list-shapes", options->list_shapes, "only print the shapes of the rig's pack");
    add_timeout_option(*verb, options->timeout_s);
    verb->footer(
        "Controls: WHO.CONTROL=VALUE, WHO a shape's name or a region: brows, lids, cheeks, nose, mouth, "
        "jaw,\n"
        "left, right, all.\n"
        "  sparsity, ridge, temporal   factor 0..10000 on how much the solve avoids small weights, large\n"
        "                              weights, change; 1 neutral\n"
        "  multiplier, offset          of the answer: +-10000 (1 neutral), +-1000 (0 neutral)\n"
        "  range                       LOW,HIGH, inside the pack's own\n"
        "  symmetry                    strength 0..10000 that ties left and right; 1 pulls as hard as all\n"
        "                              markers hold; A,B.symmetry=S ties two shapes\n"
        "  cancel                      A,B.cancel=1: the two are never on together; 0 allows it again\n"
        "They stay until they are changed or the board restarts. Owns nothing: another host may stream.\n"
        "Examples:\n"
        "  headrig control --link /dev/pts/5 --set brows.sparsity=2 --set jaw.range=0,0.8\n"
        "  headrig control --link udp:127.0.0.1:7777 --neutral --set lids.symmetry=10\n"
        "  headrig control --link /dev/pts/5 --set jawLeft,jawRight.cancel=1\n"
        "Exit codes: 0 set, 2 a control is wrong, 3 the file is, 5 no rig answers or it refuses.");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_control(*options);
    });
}

}  // namespace rig::host
