// headrig experiment: a result of the sources, measured again.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/experiments/experiment.hpp"

namespace rig::host {

namespace {

struct ExperimentCommand {
    std::string name;
    std::string data = "../shared/data";
};

void list_experiments() {
    for (const Experiment& experiment : all_experiments())
        fmt::print("{:<22} {}\n", experiment.name, experiment.repeats);
}

void print_row(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
    std::string line = "|";
    for (std::size_t c = 0; c < cells.size(); ++c) line += fmt::format(" {:<{}} |", cells[c], widths[c]);
    fmt::print("{}\n", line);
}

void print_table(const ExperimentTable& table) {
    std::vector<std::size_t> widths;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        std::size_t widest = table.columns[c].size();
        for (const auto& row : table.rows) widest = std::max(widest, row[c].size());
        widths.push_back(widest);
    }
    print_row(table.columns, widths);
    std::string rule = "|";
    for (std::size_t c = 0; c < widths.size(); ++c) rule += "---|";
    fmt::print("{}\n", rule);
    for (const auto& row : table.rows) print_row(row, widths);
    for (const std::string& remark : table.remarks) fmt::print("\n{}\n", remark);
    for (const ExperimentBound& bound : table.bounds) {
        fmt::print("\n{}: {} {:.3f}, at most {:.3f}\n", bound.holds() ? "holds" : "MISSED", bound.what,
                   bound.value, bound.most);
    }
}

int run_experiment(const ExperimentCommand& command) {
    if (command.name.empty()) {
        list_experiments();
        return kExitOk;
    }
    const Experiment* experiment = find_experiment(command.name);
    if (experiment == nullptr) {
        print_error(
            fmt::format("there is no experiment \"{}\"; `headrig experiment` lists them", command.name));
        return kExitUsage;
    }
    const auto table = experiment->run(command.data);
    if (!table) {
        print_error(table.error().message);
        return kExitInput;
    }
    fmt::print("{}\n\n", experiment->repeats);
    print_table(*table);
    return all_bounds_hold(*table) ? kExitOk : kExitFailed;
}

}  // namespace

void add_experiment_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<ExperimentCommand>();
    CLI::App* verb = app.add_subcommand("experiment", "Measure a result of the sources again");
    verb->add_option("name", command->name, "which one; without it the list")->type_name("NAME");
    verb->add_option("--data", command->data, "folder with rig/, takes/ and markers/")
        ->capture_default_str()
        ->type_name("DIR");
    verb->footer(
        "Examples:\n  headrig experiment\n  headrig experiment deng06-proportions --data ../shared/data\n"
        "Exit codes: 0 every bound holds, 1 a bound is missed, 2 wrong command line, 3 the data are missing "
        "or "
        "malformed.");
    verb->callback([command, &exit_code] { exit_code = run_experiment(*command); });
}

}  // namespace rig::host
