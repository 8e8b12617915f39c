#include "firmware_host/companion/sample/sample.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

struct SampleOptions {
    std::string folder;
    bool force = false;
};

int run_sample(const SampleOptions& options) {
    if (const auto ok = make_output_folder(options.folder, options.force); !ok) {
        print_error(ok.error().message);
        return kExitOutput;
    }
    if (const auto ok = save_sample(options.folder); !ok) {
        print_error(ok.error().message);
        return kExitOutput;
    }
    const Rig rig = sample_rig();
    const Take take = sample_take(rig);
    fmt::print("{}: {} vertices, {} triangles, {} shapes, {} markers; take.csv: {} frames at {} Hz\n",
               options.folder, rig.vertices_mm.size(), rig.triangles.size(), rig.shapes.size(),
               sample_layout(rig).markers.size(), take.frame_count, take.rate_hz);
    fmt::print("next: headrig train --rig {} --layout 60 --solver boxqp --out face.pack\n", options.folder);
    return kExitOk;
}

}  // namespace

void add_sample_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<SampleOptions>();
    CLI::App* verb =
        app.add_subcommand("sample", "Write the built-in head, its markers and a 20 s performance");
    verb->add_option("folder", options->folder, "Rig folder to write")->required()->type_name("DIR");
    verb->add_flag("--force", options->force, "Write into a folder that is not empty");
    verb->footer(
        "The same bytes every time.\n"
        "Example:\n"
        "  headrig sample head/\n"
        "Exit codes: 0 done, 2 wrong command line, 4 the folder could not be written or is not empty.");
    verb->callback([options, &exit_code] { exit_code = run_sample(*options); });
}

}  // namespace rig::host
