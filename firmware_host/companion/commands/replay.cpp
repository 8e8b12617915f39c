// headrig replay: a take as detection saw it on the rig, solved again on the desk to the same bytes.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/links/head_csv.hpp"
#include "firmware_host/companion/replay/replay_log.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct ReplayOptions {
    std::string log;
    std::string pack;
    std::string weights_csv;
    std::string head_csv;
    bool another_pack = false;
};

// The table of head poses, when one is wanted; it is written while the log is solved.
Result<std::optional<HeadCsv>, FileError> head_table(const std::string& path) {
    if (path.empty()) return std::optional<HeadCsv>{};
    auto csv = HeadCsv::create(path);
    if (!csv) return failure(csv.error());
    return std::optional<HeadCsv>(std::move(*csv));
}

// Empty, or what went wrong with a table that was wanted.
std::string finish_head(std::optional<HeadCsv>& head, bool camera_on_head, const std::string& log) {
    if (!head) return {};
    const auto closed = head->close();
    if (!closed) return closed.error().message;
    if (camera_on_head)
        return log + ": the cameras were on the head, which cannot tell where it is; no pose is known";
    return {};
}

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
    auto head = head_table(options.head_csv);
    if (!head) {
        print_error(head.error().message);
        return kExitOutput;
    }
    install_interrupt_handler();
    Result<void, FileError> written;
    const auto replayed =
        replay_log({options.log, options.pack, options.another_pack}, *opened, [&](const ReplayedTick& tick) {
            csv.integer(row++).number(tick.time_s, 6);
            for (std::size_t i = 0; i < pack.shape_count; ++i) {
                csv.number(static_cast<double>(tick.state.weights[i]), 6);
            }
            csv.end_row();
            if (*head && written) written = (*head)->add(tick.state);
            return written.has_value() && !interrupted();
        });
    if (interrupted()) return kExitInterrupted;
    if (!replayed) {
        print_error(replayed.error().message);
        return kExitInput;
    }
    if (!written) {
        print_error(written.error().message);
        return kExitOutput;
    }
    if (!options.weights_csv.empty()) {
        if (const auto saved = csv.save(options.weights_csv); !saved) {
            print_error(saved.error().message);
            return kExitOutput;
        }
    }
    fmt::print("digest {:016x} over {} ticks\n", replayed->digest, replayed->ticks);
    if (const std::string fault = finish_head(*head, replayed->camera_on_head, options.log); !fault.empty()) {
        print_error(fault);
        return kExitInput;
    }
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
    verb->add_option("--head", options->head_csv,
                     "where the head was, when the cameras were not on it, as `headrig record` writes it")
        ->type_name("H.csv");
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
