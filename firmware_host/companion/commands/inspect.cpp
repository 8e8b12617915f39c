// headrig inspect: what happened in a take, as one HTML page.
#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/inspect/inspect_page.hpp"
#include "firmware_host/companion/inspect/take_figures.hpp"
#include "firmware_host/companion/inspect/take_runs.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct InspectCommand {
    InspectRequest request;
    std::string take;
    std::string pack;
    std::string out;
};

int refuse(const std::string& message, int code) {
    print_error(message);
    return code;
}

Result<TakeRecord, FileError> inspect(const InspectRequest& request, TakeKind kind, const OpenedPack* pack) {
    std::optional<Progress> progress;
    const auto step = [&](std::uint64_t done, std::uint64_t total) {
        if (!progress) progress.emplace("inspect", total);
        progress->update(done, "frames");
        return !interrupted();
    };
    switch (kind) {
        case TakeKind::kLog:
            return inspect_log(request, *pack, step);
        case TakeKind::kStream:
            return inspect_stream(request, pack->pack(), step);
        case TakeKind::kPictures:
            return inspect_pictures(request, pack->pack(), step);
        case TakeKind::kRecording:
            break;
    }
    return inspect_recording(request, pack != nullptr ? &pack->pack() : nullptr, step);
}

int run_inspect(InspectCommand& command) {
    InspectRequest& request = command.request;
    request.take = command.take;
    request.pack_name = command.pack;
    const auto kind = kind_of_take(command.take);
    if (!kind) return refuse(kind.error().message, kExitInput);
    if (request.unlabelled && *kind != TakeKind::kStream)
        return refuse("--unlabelled is for marker streams (.npy)", kExitUsage);
    if (command.pack.empty() && *kind != TakeKind::kRecording)
        return refuse(command.take + ": say --pack FILE, the pack that it is to be solved with", kExitUsage);
    std::optional<OpenedPack> pack;
    if (!command.pack.empty()) {
        auto opened = open_pack_file(command.pack);
        if (!opened) return refuse(opened.error().message, kExitInput);
        pack.emplace(std::move(*opened));
    }
    const auto record = inspect(request, *kind, pack ? &*pack : nullptr);
    if (interrupted()) return kExitInterrupted;
    if (!record) return refuse(record.error().message, kExitInput);
    if (const auto saved = write_whole_text(command.out, inspect_page(*record)); !saved)
        return refuse(saved.error().message, kExitOutput);
    std::string line = command.out + ":";
    for (const std::string& fact : summary_facts(*record, figures_of(*record)))
        line += (line.ends_with(':') ? " " : "; ") + fact;
    fmt::print("{}\n", line);
    if (record->cut.empty()) return kExitOk;
    return refuse(record->cut, kExitInput);
}

}  // namespace

void add_inspect_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<InspectCommand>();
    CLI::App* verb = app.add_subcommand("inspect", "What happened in a take, as one HTML page");
    verb->add_option("take", command->take,
                     "observation log (.rgo), recording (.rec), marker stream (.npy) or folder of pictures")
        ->required()
        ->type_name("TAKE");
    verb->add_option("--pack", command->pack, "pack to solve with; of a recording: to place its markers")
        ->type_name("FILE");
    verb->add_option("--out", command->out, "page to write")->required()->type_name("HTML");
    verb->add_flag("--unlabelled", command->request.unlabelled,
                   "marker stream: rows come in any order, ghosts among them");
    verb->add_option("--rate", command->request.rate_hz, "stream, pictures: frames per second [the pack's]")
        ->check(CLI::Range(1.0, 1000.0))
        ->default_str("")
        ->type_name("HZ");
    const std::map<std::string, MarkerPolarity> names = {{"auto", MarkerPolarity::kAuto},
                                                         {"dark", MarkerPolarity::kDark},
                                                         {"bright", MarkerPolarity::kBright}};
    verb->add_option("--polarity", command->request.polarity,
                     "pictures: markers darker or brighter than the skin: dark, bright or auto")
        ->transform(CLI::CheckedTransformer(names, CLI::ignore_case).description(""))
        ->type_name("SIDE")
        ->default_str("auto");
    verb->add_flag_callback(
        "--no-stabilise", [command] { command->request.stabilise = false; },
        "stream: it is in the face frame already");
    verb->add_flag("--another-pack", command->request.another_pack,
                   "log: solve with a pack other than the recorded one");
    verb->footer(
        "Markers visible, inferred and lost over time, tracking state and faults, residual, slip, "
        "distributions, the\n"
        "worst markers, and pictures of the worst moments. The page needs no network and no scripts.\n"
        "Pictures are named MOMENT_CAMERA, as `headrig world --images` names them; a number at the end of "
        "the moment\n"
        "is the frame's.\n"
        "Examples:\n"
        "  headrig inspect take.rgo --pack face.pack --out take.html\n"
        "  headrig inspect cloud.npy --pack face.pack --unlabelled --out cloud.html\n"
        "  headrig inspect pictures/ --pack face.pack --out pictures.html\n"
        "  headrig inspect take.rec --out take.html\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, or was cut (the page "
        "shows\n"
        "what is whole), 4 the page could not be written, 130 interrupted.");
    verb->callback([command, &exit_code] {
        install_interrupt_handler();
        exit_code = run_inspect(*command);
    });
}

}  // namespace rig::host
