// headrig report: what a solve pack can see and how well, as one HTML page.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/report/pack_page.hpp"
#include "firmware_host/companion/rig_folder/take_file.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct ReportCommand {
    std::string pack;
    std::string take;
    std::string out;
};

Result<Take, FileError> read_take(const std::string& path, const SolvePack& pack) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    std::vector<std::string> names;
    for (std::size_t i = 0; i < pack.shape_count; ++i) names.emplace_back(pack.shape_names[i]);
    return parse_take(*text, path, names);
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
    const PackPageInput input{.name = std::string(opened->manifest().name),
                              .pack = opened->pack(),
                              .analysis = *analysis,
                              .rbf = std::nullopt,
                              .coverage = std::nullopt,
                              .curves = {}};
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
    verb->add_option("--out", command->out, "page to write")->required()->type_name("HTML");
    verb->footer(
        "Observability, conditioning, error by facial region, noise and priors. A pack keeps no training "
        "curves:\n"
        "`headrig train --report` writes the page with them.\n"
        "Examples:\n  headrig report face.pack --out report.html\n"
        "  headrig report face.pack --take take.csv --out report.html\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, 4 the page could not "
        "be\n"
        "written.");
    verb->callback([command, &exit_code] { exit_code = run_report(*command); });
}

}  // namespace rig::host
