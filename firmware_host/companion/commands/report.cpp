// headrig report: what a solve pack can see and how well, as one HTML page.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/report/pack_page.hpp"
#include "firmware_host/companion/rig_folder/take_file.hpp"
#include "firmware_host/companion/train/training_record.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct ReportCommand {
    std::string pack;
    std::string take;
    std::string training;
    std::string out;
};

Result<Take, FileError> read_take(const std::string& path, const SolvePack& pack) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    std::vector<std::string> names;
    for (std::size_t i = 0; i < pack.shape_count; ++i) names.emplace_back(pack.shape_names[i]);
    return parse_take(*text, path, names);
}

// The file that training left beside the pack, or the one that is named. A file that nobody named and that is
// of another pack is left out with a warning.
Result<std::optional<TrainingRecord>, FileError> read_training(const ReportCommand& command,
                                                               const PackManifest& manifest) {
    const bool named = !command.training.empty();
    const std::filesystem::path path =
        named ? std::filesystem::path(command.training) : training_record_path(command.pack);
    if (!named && !std::filesystem::exists(path)) return std::nullopt;
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    auto record = parse_training_record(*text, path);
    if (!record) return failure(record.error());
    if (record->pack_uuid == uuid_text(manifest)) return std::optional(std::move(*record));
    const std::string fault = fmt::format("{} is of another pack than {}", path.string(), command.pack);
    if (named) return failure(FileError{fault});
    print_error("warning: " + fault + "; the page goes without its curves");
    return std::nullopt;
}

int run_report(const ReportCommand& command) {
    const auto opened = open_pack_file(command.pack);
    if (!opened) {
        print_error(opened.error().message);
        return kExitInput;
    }
    Take take;
    if (!command.take.empty()) {
        auto read = read_take(command.take, opened->pack());
        if (!read) {
            print_error(read.error().message);
            return kExitInput;
        }
        take = std::move(*read);
    }
    const auto analysis = analyse_pack(opened->pack(), command.take.empty() ? nullptr : &take);
    if (!analysis) {
        print_error(analysis.error().message);
        return kExitInput;
    }
    auto training = read_training(command, opened->manifest());
    if (!training) {
        print_error(training.error().message);
        return kExitInput;
    }
    const PackPageInput input{.name = std::string(opened->manifest().name),
                              .pack = opened->pack(),
                              .analysis = *analysis,
                              .training = std::move(*training)};
    if (const auto saved = write_whole_text(command.out, pack_page(input)); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    fmt::print("{}: {} shapes, rank {}, condition {:.0f}\n", command.out, analysis->shapes.size(),
               analysis->rank, analysis->condition);
    return kExitOk;
}

}  // namespace

void add_report_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<ReportCommand>();
    CLI::App* verb = app.add_subcommand("report", "What a solve pack can see and how well, as one HTML page");
    verb->add_option("pack", command->pack, "pack made by `headrig train`")->required()->type_name("PACK");
    verb->add_option(
            "--take", command->take,
            "weights (CSV) that are played on the pack's markers and solved again, for measured errors")
        ->type_name("T.csv");
    verb->add_option("--training", command->training,
                     "what training wrote beside the pack [its name with .training.csv]")
        ->type_name("CSV");
    verb->add_option("--out", command->out, "page to write")->required()->type_name("HTML");
    verb->footer(
        "Observability of each shape, conditioning, error by facial region, noise and priors; for a "
        "regression "
        "also\n"
        "cross-validation, GCV path and coverage, which `headrig train` writes into NAME.training.csv beside "
        "the "
        "pack.\n"
        "Examples:\n  headrig report face.pack --out report.html\n"
        "  headrig report face.pack --take take.csv --out report.html\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, 4 the page could not "
        "be\n"
        "written.");
    verb->callback([command, &exit_code] { exit_code = run_report(*command); });
}

}  // namespace rig::host
