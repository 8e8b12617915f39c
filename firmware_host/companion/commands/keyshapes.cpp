// headrig keyshapes: which shapes of a performance the rest of it can be combined from, and how well.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/limits.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/train/error_chart.hpp"
#include "firmware_host/companion/train/face_regions.hpp"
#include "firmware_host/companion/train/key_shapes.hpp"

namespace rig::host {

namespace {

struct KeyShapesCommand {
    std::string rig;
    std::string layout = "60";
    std::vector<std::string> takes;
    std::string method = "spread";
    std::string region = "mouth";
    std::string axes = "xyz";
    std::size_t count = 12;
    std::size_t most = 24;
    std::string out;
};

struct Inputs {
    Rig rig;
    MarkerModel model;
    std::vector<MarkerRegion> regions;
    std::vector<Take> takes;
};

struct ErrorRow {
    KeyShapeMethod method;
    std::size_t count;
    KeyShapeError error;
};

Result<Inputs, FileError> load_inputs(const KeyShapesCommand& command) {
    Inputs inputs;
    auto rig = load_rig(command.rig);
    if (!rig) return failure(rig.error());
    inputs.rig = std::move(*rig);
    const auto layout = load_layout(command.rig, command.layout, inputs.rig);
    if (!layout) return failure(layout.error());
    inputs.model = marker_model(inputs.rig, *layout);
    inputs.regions = feature_regions(*layout);
    inputs.regions.push_back(lip_region(*layout));
    inputs.regions.push_back(whole_face(*layout)[0]);
    for (const std::string& path : command.takes) {
        auto take = load_take(path, inputs.rig);
        if (!take) return failure(take.error());
        inputs.takes.push_back(std::move(*take));
    }
    return inputs;
}

// Every method for every even count, and the hull once.
std::vector<ErrorRow> error_table(const RegionMotion& motion, std::size_t most, Progress& progress) {
    constexpr KeyShapeMethod kCounted[] = {KeyShapeMethod::kSpread, KeyShapeMethod::kClusters2,
                                           KeyShapeMethod::kClusters3};
    std::vector<ErrorRow> table;
    std::uint64_t done = 0;
    for (const KeyShapeMethod method : kCounted) {
        for (std::size_t count = 4; count <= most; count += 2) {
            const KeyShapes shapes = choose_key_shapes(motion, method, count);
            table.push_back({method, shapes.frames.size(), key_shape_error(motion.positions_mm, shapes)});
            progress.update(++done);
        }
    }
    const KeyShapes hull = choose_key_shapes(motion, KeyShapeMethod::kHull, 0);
    table.push_back({KeyShapeMethod::kHull, hull.frames.size(), key_shape_error(motion.positions_mm, hull)});
    return table;
}

void print_table(const std::vector<ErrorRow>& table) {
    fmt::print("{:<10} {:>5} {:>14} {:>9} {:>9}\n", "method", "count", "E mm^2", "rms mm", "largest w");
    for (const ErrorRow& row : table) {
        fmt::print("{:<10} {:>5} {:>14.1f} {:>9.4f} {:>9.3f}\n", key_shape_method_name(row.method), row.count,
                   row.error.sum_mm2, row.error.rms_mm, row.error.largest_weight);
    }
}

Result<void, FileError> save_table(const std::filesystem::path& folder, const std::vector<ErrorRow>& table) {
    CsvWriter csv({"method", "count", "sum_mm2", "rms_mm", "largest_weight"});
    for (const ErrorRow& row : table) {
        csv.text(key_shape_method_name(row.method)).integer(static_cast<std::int64_t>(row.count));
        csv.number(row.error.sum_mm2, 3).number(row.error.rms_mm, 6).number(row.error.largest_weight, 4);
        csv.end_row();
    }
    return csv.save(folder / "error.csv");
}

Result<void, FileError> save_picture(const KeyShapesCommand& command, const std::filesystem::path& folder,
                                     const std::vector<ErrorRow>& table) {
    // The source's colours: blue, green, magenta, and a red dot.
    std::vector<ErrorLine> lines{{"spread", {40, 60, 200}, {}, {}},
                                 {"clusters, 2D", {40, 150, 60}, {}, {}},
                                 {"clusters, 3D", {200, 40, 180}, {}, {}},
                                 {"hull, 2D", {210, 40, 40}, {}, {}}};
    for (const ErrorRow& row : table) {
        ErrorLine& line = lines[static_cast<std::size_t>(row.method)];
        line.counts.push_back(static_cast<double>(row.count));
        line.errors.push_back(row.error.rms_mm);
    }
    return draw_errors(
        folder / "error.png", lines,
        fmt::format("{}: rms error of a coordinate over all frames, axes {}", command.region, command.axes),
        "key shapes", "mm");
}

Result<void, FileError> save_shapes(const std::filesystem::path& folder, const Inputs& inputs,
                                    const KeyShapes& shapes) {
    std::vector<std::string> columns{"frame", "time_s"};
    for (const SparseShape& shape : inputs.rig.shapes) columns.push_back(shape.name);
    CsvWriter csv(columns);
    const double rate_hz = inputs.takes.front().rate_hz;
    for (std::size_t k = 0; k < shapes.frames.size(); ++k) {
        csv.integer(shapes.frames[k]).number(static_cast<double>(shapes.frames[k]) / rate_hz, 6);
        for (Eigen::Index i = 0; i < shapes.weights.cols(); ++i)
            csv.number(shapes.weights(static_cast<Eigen::Index>(k), i), 5);
        csv.end_row();
    }
    return csv.save(folder / "key_shapes.csv");
}

Result<void, FileError> save_all(const KeyShapesCommand& command, const Inputs& inputs,
                                 const KeyShapes& shapes, const std::vector<ErrorRow>& table) {
    const std::filesystem::path folder = command.out;
    std::error_code fault;
    std::filesystem::create_directories(folder, fault);
    if (fault) return failure(FileError{fmt::format("{}: cannot be made: {}", command.out, fault.message())});
    if (const auto saved = save_shapes(folder, inputs, shapes); !saved) return saved;
    if (const auto saved = save_table(folder, table); !saved) return saved;
    return save_picture(command, folder, table);
}

int run_key_shapes(const KeyShapesCommand& command) {
    const auto method = key_shape_method(command.method);
    if (!method) {
        print_error(fmt::format("--method {}: give spread, clusters2, clusters3 or hull", command.method));
        return kExitUsage;
    }
    const auto inputs = load_inputs(command);
    if (!inputs) {
        print_error(inputs.error().message);
        return kExitInput;
    }
    const auto region = std::ranges::find(inputs->regions, command.region, &MarkerRegion::name);
    if (region == inputs->regions.end()) {
        std::string names;
        for (const MarkerRegion& one : inputs->regions) names += " " + one.name;
        print_error(fmt::format("--region {}: this layout has the regions{}", command.region, names));
        return kExitUsage;
    }
    const std::vector<std::size_t> axes =
        command.axes == "xy" ? std::vector<std::size_t>{0, 1} : std::vector<std::size_t>{0, 1, 2};
    const RegionMotion motion =
        region_motion(*region, inputs->model.neutral_mm, inputs->model.basis_mm, inputs->takes, axes);
    if (motion.positions_mm.rows() < 2) {
        print_error("the takes have fewer than two frames to choose from");
        return kExitInput;
    }
    const KeyShapes shapes = choose_key_shapes(motion, *method, command.count);
    const KeyShapeError error = key_shape_error(motion.positions_mm, shapes);
    fmt::print("{} of {}: {} key shapes of {} frames, {} markers, E {:.1f} mm^2, rms {:.4f} mm\n\n",
               command.method, command.region, shapes.frames.size(), motion.positions_mm.rows(),
               region->markers.size(), error.sum_mm2, error.rms_mm);
    Progress progress("keyshapes", 3 * (command.most / 2 - 1));
    const std::vector<ErrorRow> table = error_table(motion, command.most, progress);
    print_table(table);
    if (const auto saved = save_all(command, *inputs, shapes, table); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    return kExitOk;
}

}  // namespace

void add_keyshapes_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<KeyShapesCommand>();
    CLI::App* verb = app.add_subcommand(
        "keyshapes", "Choose key shapes of a performance, and their error against their number");
    verb->add_option("--rig", command->rig, "rig folder")->required()->type_name("DIR");
    verb->add_option("--layout", command->layout, "number of a layout of the folder, or a layout file")
        ->capture_default_str()
        ->type_name("N|CSV");
    verb->add_option("--take", command->takes, "performances to choose from")
        ->required()
        ->type_name("CSV...");
    verb->add_option("--method", command->method, "spread, clusters2, clusters3 (or clusters) or hull")
        ->capture_default_str()
        ->type_name("NAME");
    verb->add_option("--count", command->count, "key shapes to choose")
        ->capture_default_str()
        ->check(CLI::Range(std::size_t{1}, kMaxRegionShapes))
        ->type_name("K");
    verb->add_option("--region", command->region, "eyes, mouth, pupils, lips or face")
        ->capture_default_str()
        ->type_name("NAME");
    verb->add_option("--axes", command->axes, "xyz, or xy as one camera in front sees it")
        ->capture_default_str()
        ->check(CLI::IsMember({"xy", "xyz"}));
    verb->add_option("--most", command->most, "largest count of the table")
        ->capture_default_str()
        ->check(CLI::Range(std::size_t{4}, kMaxRegionShapes))
        ->type_name("K");
    verb->add_option("--out", command->out, "folder for key_shapes.csv, error.csv and error.png")
        ->required()
        ->type_name("DIR");
    verb->footer(
        "Prints the error of every method against the number of key shapes, and writes it with a picture.\n"
        "Examples:\n"
        "  headrig keyshapes --rig sample --take sample/take.csv --out keys\n"
        "  headrig keyshapes --rig R --layout 102 --take T.csv --region lips --axes xy --method spread "
        "--count 16 "
        "--out keys\n"
        "Exit codes: 0 done, 2 wrong command line, 3 the data are missing or malformed, 4 nothing could be "
        "written.");
    verb->callback([command, &exit_code] { exit_code = run_key_shapes(*command); });
}

}  // namespace rig::host
