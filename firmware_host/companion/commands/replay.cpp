// headrig replay: a take as detection saw it on the rig, solved again on the desk to the same bytes.
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/replay/replay_log.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct ReplayOptions {
    std::string log;
    std::string pack;
    std::string weights_csv;
    bool another_pack = false;
};

int run_replay(const ReplayOptions& options) {
    const auto opened = open_pack_file(options.pack);
    if (!opened) {
        print_error(opened.error().message);
        return kExitInput;
    }
    const SolvePack& pack = opened->pack();
    std::vector<std::string> columns{"frame", "time_s"};
    for (std::size_t i = 0; i < pack.shape_count; ++i) columns.emplace_back(pack.shape_names[i]);
    CsvWriter csv(columns);
    std::int64_t row = 0;
    install_interrupt_handler();
    const auto replayed =
        replay_log({options.log, options.pack, options.another_pack}, *opened, [&](const ReplayedTick& tick) {
            csv.integer(row++).number(tick.time_s, 6);
            for (std::size_t i = 0; i < pack.shape_count; ++i) {
                csv.number(static_cast<double>(tick.state.weights[i]), 6);
            }
            csv.end_row();
            return !interrupted();
        });
    if (interrupted()) return kExitInterrupted;
    if (!replayed) {
        print_error(replayed.error().message);
        return kExitInput;
    }
    if (!options.weights_csv.empty()) {
        if (const auto saved = csv.save(options.weights_csv); !saved) {
            print_error(saved.error().message);
            return kExitOutput;
        }
    }
    fmt::print("digest {:016x} over {} ticks\n", replayed->digest, replayed->ticks);
    if (replayed->cut.empty()) return kExitOk;
    print_error(replayed->cut);
    return kExitInput;
}

}  // namespace

void add_replay_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<ReplayOptions>();
    CLI::App* verb =
        app.add_subcommand("replay", "Solve a take again from the observations recorded on the rig");
    verb->add_option("log", options->log, "observation log of `headrigd --log-observations`")
        ->required()
        ->type_name("FILE.rgo");
    verb->add_option("--pack", options->pack, "the pack it was recorded with")->required()->type_name("FILE");
    verb->add_option("--out", options->weights_csv, "weights: frame,time_s,<shapes>")->type_name("W.csv");
    verb->add_flag("--another-pack", options->another_pack, "solve with a pack other than the recorded one");
    verb->footer(
        "The digest is the one that `headrigd --digest` printed for the take: the same pack and the same "
        "observations\n"
        "give the same bytes on every machine and with every build.\n"
        "Examples:\n"
        "  headrig replay take.rgo --pack face.pack --out weights.csv\n"
        "  headrig replay take.rgo --pack retrained.pack --another-pack --out weights.csv\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing, malformed or cut, 4 an output "
        "could not be\n"
        "written, 130 interrupted.");
    verb->callback([options, &exit_code] { exit_code = run_replay(*options); });
}

}  // namespace rig::host
