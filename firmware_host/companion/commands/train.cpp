// headrig train: a pack for a head, a marker layout and a solver.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/fit/layout_fit.hpp"
#include "firmware_host/companion/fit/marker_noise.hpp"
#include "firmware_host/companion/report/pack_page.hpp"
#include "firmware_host/companion/train/camera_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/companion/train/training_record.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

constexpr double kResidualAlarm = 2.0;  // times the noise, from which the layout is doubted

struct TrainCommand {
    std::string rig;
    std::string layout = "60";
    std::string out;
    std::string cameras;
    std::string markers;
    std::string hold;
    std::string temporal = "auto";
    bool noise_given = false;
    std::string report;
    std::string name;
    std::string method = "spread";
    std::vector<std::string> takes;
    std::vector<double> hull_fallback;  // near, far
    TrainOptions options;
    PackIdentity identity;
};

// False when the text is neither auto, on, off nor a number.
bool read_temporal(const std::string& text, TemporalPull& temporal) {
    const std::map<std::string, TemporalPull::Mode> modes = {{"auto", TemporalPull::Mode::kSolversOwn},
                                                             {"on", TemporalPull::Mode::kOn},
                                                             {"off", TemporalPull::Mode::kOff}};
    if (const auto found = modes.find(text); found != modes.end()) {
        temporal.mode = found->second;
        return true;
    }
    double step = 0.0;
    if (!CLI::detail::lexical_cast(text, step)) return false;
    temporal = {TemporalPull::Mode::kOn, step};
    return true;
}

void print_result(const TrainCommand& command, const TrainedPack& pack) {
    fmt::print("{}: {} markers, {} shapes, {} cameras, {} bytes\n", command.out, pack.marker_names.size(),
               pack.shape_names.size(), pack.cameras.size(), std::filesystem::file_size(command.out));
    fmt::print("basis: rank {} of {}, condition {:.0f}\n", pack.report.rank, pack.shape_names.size(),
               pack.report.condition);
    fmt::print("noise {:.4g} mm, sparsity {:.4g} mm^2, ridge {:.4g} mm^2\n", pack.noise_mm, pack.sparsity_mm2,
               pack.ridge_mm2);
    for (const TrainedRegion& region : pack.regions) {
        fmt::print("region {}: {} markers, {} examples\n", region.name, region.markers.size(),
                   region.example_count);
    }
    if (!pack.marker_sets.empty()) {
        fmt::print("marker sets: {}, the whole face with {} components\n", pack.marker_sets.size(),
                   pack.marker_sets[0].mode_count);
    }
    if (!pack.report.rbf) return;
    const RbfTrainingReport& rbf = *pack.report.rbf;
    fmt::print(
        "rbf: {} kernel, {} frames, {} references, {} dimensions ({:.2f} % of the variance), width {} x "
        "spacing, lambda {:.2g}\n",
        rbf_kernel_name(pack.rbf.kernel), rbf.frames, rbf.centres, rbf.dimensions, 100.0 * rbf.variance_kept,
        rbf.width_factor, rbf.median_lambda);
    fmt::print(
        "rbf: the take's own frames lie {:.2f} widths from their nearest reference, 95 % within {:.2f}\n",
        rbf.distance_p50, rbf.distance_p95);
    if (pack.rbf.hull_far_widths > 0.0F) {
        fmt::print("rbf: goes over to the box QP from {} to {} widths from its nearest reference\n",
                   pack.rbf.hull_near_widths, pack.rbf.hull_far_widths);
    }
    fmt::print("rbf weight rms: {:.4f} in the take ({:.4f} over visible shapes), {:.4f} on blocks left out\n",
               rbf.in_take_rms, rbf.visible_in_take_rms, rbf.cross_validated_rms);
    const Coverage& coverage = *pack.report.coverage;
    fmt::print(
        "coverage: {:.1f} % of the frames within one width of a reference, {:.1f} % beyond three; distance "
        "p50 {:.2f}, p90 {:.2f}, p99 {:.2f}, max {:.2f} widths; p90 {:.2f} mm of a spread of {:.2f} mm\n",
        100.0 * coverage.covered_share, 100.0 * coverage.lost_share, coverage.widths[0], coverage.widths[1],
        coverage.widths[2], coverage.widths[3], coverage.distance_mm[1], coverage.spread_mm);
}

// Of the pack that has just been written; nothing for a pack without a regression.
Result<std::optional<TrainingRecord>, FileError> record_of(const TrainCommand& command,
                                                           const TrainedPack& pack) {
    if (!pack.report.rbf) return std::nullopt;
    const auto opened = open_pack_file(command.out);
    if (!opened) return failure(FileError{opened.error().message});
    return TrainingRecord{.pack_uuid = uuid_text(opened->manifest()),
                          .rbf = *pack.report.rbf,
                          .coverage = pack.report.coverage.value_or(Coverage{}),
                          .shape_names = pack.shape_names};
}

// What training knows and the pack does not hold: the curves beside it, and the page when it is asked for.
Result<void, FileError> write_reports(const TrainCommand& command, const TrainedPack& pack) {
    auto record = record_of(command, pack);
    if (!record) return failure(record.error());
    if (*record) {
        const auto saved =
            write_whole_text(training_record_path(command.out), training_record_text(**record));
        if (!saved) return saved;
    }
    if (command.report.empty()) return {};
    const SolvePack view = pack.view();
    const Take* take = command.options.takes.empty() ? nullptr : &command.options.takes.front();
    const auto analysis = analyse_pack(view, take);
    if (!analysis) return failure(analysis.error());
    const PackPageInput input{
        .name = command.identity.name, .pack = view, .analysis = *analysis, .training = std::move(*record)};
    return write_whole_text(command.report, pack_page(input));
}

constexpr std::size_t kUsualComponents = 5;  // of a marker set, at least  [Zhang06 section 14]

void print_warnings(const TrainedPack& pack) {
    const std::size_t shapes = pack.shape_names.size();
    if (pack.report.rank < shapes) {
        print_error(fmt::format(
            "warning: the layout tells only {} of {} shapes apart (rank of B); a layout with more "
            "markers tells more",
            pack.report.rank, shapes));
    }
    for (const TrainedMarkerSet& set : pack.marker_sets) {
        if (set.mode_count >= kUsualComponents) continue;
        print_error(
            fmt::format("warning: the expressions move marker set {} in {} ways only; the source keeps {} "
                        "components or more",
                        set.name, set.mode_count, kUsualComponents));
    }
    if (pack.report.invisible.empty()) return;
    std::string list;
    for (const InvisibleShape& shape : pack.report.invisible) {
        list += fmt::format("{}{} {:.2f} mm", list.empty() ? "" : ", ", shape.name, shape.column_mm);
    }
    print_error(fmt::format(
        "warning: {} shapes hardly move any marker of this layout (less than {} mm in sum), their "
        "weights will be guesses: {}",
        pack.report.invisible.size(), kInvisibleMm, list));
}

// A pack of --out that is about to be replaced by one that no longer watches the cameras.
void warn_of_lost_marks(const TrainCommand& command) {
    if (command.options.cameras.empty() || !command.options.reference_marks.empty()) return;
    const auto before = open_pack_file(command.out);
    if (!before || before->pack().helmet_marks().empty()) return;
    print_error(fmt::format(
        "warning: {} held {} reference marks of the helmet and {} has none: the new pack will not notice a "
        "camera that is knocked; `headrig calibrate cameras --reference` carries marks over",
        command.out, before->pack().helmet_marks().size(), command.cameras));
}

// Loads what the options name; the message of the first file that is wrong, or nothing.
Result<void, FileError> load_inputs(TrainCommand& command, Rig& rig, MarkerLayout& layout) {
    auto loaded_rig = load_rig(command.rig);
    if (!loaded_rig) return failure(loaded_rig.error());
    rig = std::move(*loaded_rig);
    auto loaded_layout = load_layout(command.rig, command.layout, rig);
    if (!loaded_layout) return failure(loaded_layout.error());
    layout = std::move(*loaded_layout);
    for (const std::string& path : command.takes) {
        auto take = load_take(path, rig);
        if (!take) return failure(take.error());
        command.options.takes.push_back(std::move(*take));
    }
    if (!command.cameras.empty()) {
        auto cameras = load_cameras(command.cameras);
        if (!cameras) return failure(cameras.error());
        command.options.cameras = std::move(*cameras);
        auto marks = load_reference_marks(command.cameras);
        if (!marks) return failure(marks.error());
        command.options.reference_marks = std::move(*marks);
    }
    return {};
}

// From the recorded markers that --markers names, before training: the noise that the pack is to expect.
Result<void, FileError> estimate_noise(TrainCommand& command, const MarkerLayout& layout, MarkerTake& take) {
    auto loaded = load_marker_take(command.markers, command.options.rate_hz);
    if (!loaded) return failure(loaded.error());
    take = std::move(*loaded);
    if (take.marker_count != layout.markers.size()) {
        return failure(FileError{fmt::format("{}: {} markers a frame, but the layout has {}", command.markers,
                                             take.marker_count, layout.markers.size())});
    }
    const CoordinateNoise differences = noise_of_differences(take);
    CoordinateNoise hold;
    if (const auto range = read_frame_range(command.hold))
        hold = noise_of_hold(take, range->begin, range->end);
    if (!command.hold.empty() && hold.markers == 0) {
        return failure(FileError{fmt::format("{}: no marker is seen in {} frames of the hold {}",
                                             command.markers, kLeastNoiseSamples, command.hold)});
    }
    const double chosen = hold.markers > 0 ? hold.pooled_mm : differences.pooled_mm;
    if (!(chosen > 0.0)) {
        return failure(
            FileError{fmt::format("{}: too few frames to tell the noise ({} in which a marker is seen five "
                                  "times in a row are needed); "
                                  "give it with --noise-mm",
                                  command.markers, kLeastNoiseSamples)});
    }
    fmt::print("noise of a coordinate: {:.4f} mm from fourth differences ({} markers)", differences.pooled_mm,
               differences.markers);
    if (hold.markers > 0) fmt::print("; {:.4f} mm from the hold {}", hold.pooled_mm, command.hold);
    fmt::print("; the pack takes {}\n", command.noise_given ? "that of --noise-mm"
                                        : hold.markers > 0  ? "the hold's"
                                                            : "the differences'");
    if (!command.noise_given) command.options.noise_mm = std::clamp(chosen, 1e-4, 100.0);
    return {};
}

// After training: what the model cannot explain of the same markers.
void print_residual(const TrainedPack& pack, const MarkerTake& take) {
    // A regression and regions have no degrees of freedom of the weights to take off.
    if (pack.solver == SolverKind::kRbf || is_regional(pack.solver)) return;
    const MarkerTake thin = thinned(take, kMostFitFrames);
    const auto residual = noise_of_residual(pack.view(), thin, solve_take(pack.view(), thin, true));
    if (!residual) return;
    fmt::print("residual of a coordinate after the solve: {:.4f} mm\n", *residual);
    if (*residual <= kResidualAlarm * pack.noise_mm) return;
    print_error(fmt::format(
        "warning: the residual is {:.1f} times the noise: markers are not where the layout says, names "
        "are swapped, or the shapes cannot make these faces; see `headrig fit`",
        *residual / pack.noise_mm));
}

// Reads the options that are text; what is wrong with the command line, empty when nothing is.
std::string fault_of_command(TrainCommand& command) {
    if (!read_temporal(command.temporal, command.options.temporal)) {
        return fmt::format(
            "--temporal {}: give auto, on, off or the step a weight takes in a frame, e.g. 0.03",
            command.temporal);
    }
    if (!command.hold.empty() && (command.markers.empty() || !read_frame_range(command.hold))) {
        return fmt::format("--hold {}: give the frames of --markers in which the face holds still, e.g. 0:60",
                           command.hold);
    }
    const auto method = key_shape_method(command.method);
    if (!method) {
        return fmt::format("--method {}: give spread, clusters2, clusters3 or hull", command.method);
    }
    command.options.regional.method = *method;
    if (!command.hull_fallback.empty()) {
        command.options.rbf.hull_near_widths = command.hull_fallback.front();
        command.options.rbf.hull_far_widths = command.hull_fallback.back();
    }
    return fault_of_options(command.options, command.takes.size());
}

int run_train(TrainCommand& command) {
    if (const std::string fault = fault_of_command(command); !fault.empty()) {
        print_error(fault);
        return kExitUsage;
    }
    Rig rig;
    MarkerLayout layout;
    if (const auto loaded = load_inputs(command, rig, layout); !loaded) {
        print_error(loaded.error().message);
        return kExitInput;
    }
    MarkerTake markers;
    if (!command.markers.empty()) {
        if (const auto told = estimate_noise(command, layout, markers); !told) {
            print_error(told.error().message);
            return kExitInput;
        }
    }
    Progress bar("train", 1000);
    const auto pack = train(rig, layout, command.options, [&](double share) {
        bar.update(static_cast<std::uint64_t>(std::lround(1000.0 * share)));
    });
    if (!pack) {
        print_error(pack.error().message);
        return kExitInput;
    }
    warn_of_lost_marks(command);
    command.identity.name =
        command.name.empty() ? std::filesystem::path(command.out).stem().string() : command.name;
    if (const auto saved = save_pack(command.out, pack->view(), command.identity); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    if (const auto written = write_reports(command, *pack); !written) {
        print_error(written.error().message);
        return kExitOutput;
    }
    print_result(command, *pack);
    if (!command.markers.empty()) print_residual(*pack, markers);
    print_warnings(*pack);
    return kExitOk;
}

CLI::Option* add_noise_options(CLI::App& verb, TrainCommand& command) {
    CLI::Option* noise = verb.add_option("--noise-mm", command.options.noise_mm,
                                         "standard deviation of one marker coordinate");
    noise->capture_default_str()->type_name("MM");
    verb.add_option("--markers", command.markers,
                    "recorded markers (frames, markers, 3) .npy to estimate the noise from")
        ->type_name("M.npy");
    verb.add_option("--hold", command.hold,
                    "frames of --markers in which the face holds still; END not included")
        ->type_name("BEGIN:END");
    return noise;
}

void add_rbf_options(CLI::App& verb, TrainCommand& command) {
    RbfTrainingOptions& rbf = command.options.rbf;
    verb.add_option("--centres", rbf.centres, "reference frames of the rbf")
        ->capture_default_str()
        ->type_name("K");
    verb.add_option("--dimensions", rbf.dimensions, "components of the rbf; 0: by cross-validation")
        ->capture_default_str()
        ->type_name("D");
    const std::map<std::string, RbfKernel> kernels = {{"gaussian", RbfKernel::kGaussian},
                                                      {"thin-plate", RbfKernel::kThinPlate},
                                                      {"multiquadric", RbfKernel::kMultiquadric}};
    verb.add_option("--rbf-kernel", rbf.kernel, "gaussian, thin-plate or multiquadric")
        ->transform(CLI::CheckedTransformer(kernels, CLI::ignore_case).description(""))
        ->type_name("NAME")
        ->default_str("gaussian");
    verb.add_option("--hull-fallback", command.hull_fallback,
                    "distances to the nearest reference, in its widths, between which the rbf's answer goes "
                    "over to the box QP's; this verb says what the take's own frames have [none]")
        ->delimiter(',')
        ->expected(2)
        ->type_name("NEAR,FAR");
}

void add_pack_options(CLI::App& verb, TrainCommand& command) {
    verb.add_flag("!--no-marker-sets", command.options.marker_sets,
                  "leave out how unseen markers move with seen ones: a pack for older rigs");
    verb.add_option("--report", command.report, "HTML page about the pack and its training")
        ->type_name("HTML");
    verb.add_option("--name", command.name, "name inside the pack [the file's]")->type_name("NAME");
    verb.add_option("--pack-version", command.identity.pack_version, "version inside the pack")
        ->capture_default_str();
    verb.add_option("--out", command.out, "pack file to write")->required()->type_name("PACK");
}

}  // namespace

void add_train_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<TrainCommand>();
    CLI::App* verb = app.add_subcommand("train", "Make a solve pack from a rig folder");
    verb->add_option("--rig", command->rig, "rig folder")->required()->type_name("DIR");
    verb->add_option("--layout", command->layout, "number of a layout of the folder, or a layout file")
        ->capture_default_str()
        ->type_name("N|CSV");
    const std::map<std::string, SolverKind> solvers = {{"boxqp", SolverKind::kBoxQp},
                                                       {"nnls", SolverKind::kNonNegative},
                                                       {"rbf", SolverKind::kRbf},
                                                       {"lsq", SolverKind::kLeastSquares},
                                                       {"keyshapes", SolverKind::kKeyShapes},
                                                       {"examples", SolverKind::kExamples}};
    verb->add_option("--solver", command->options.solver, "boxqp, nnls, rbf, lsq, keyshapes or examples")
        ->transform(CLI::CheckedTransformer(solvers, CLI::ignore_case).description(""))
        ->type_name("NAME")
        ->default_str("boxqp");
    verb->add_option("--take", command->takes,
                     "performances to learn from (CSV); rbf, keyshapes and examples need one")
        ->type_name("CSV...");
    verb->add_option("--cameras", command->cameras,
                     "cameras.json of the helmet, its reference marks too; without it the pack solves marker "
                     "streams only")
        ->type_name("JSON");
    CLI::Option* noise = add_noise_options(*verb, *command);
    verb->add_option("--rate", command->options.rate_hz, "frame rate it is for")
        ->capture_default_str()
        ->type_name("HZ");
    verb->add_option("--temporal", command->temporal,
                     "pull towards the previous frame: on, off, auto (on for boxqp), or the step of a weight "
                     "in a frame")
        ->capture_default_str()
        ->type_name("MODE");
    verb->add_option("--sparsity", command->options.sparsity,
                     fmt::format("weight of sum |w|, in units of the summed squared marker noise [boxqp: {}]",
                                 kDefaultSparsity))
        ->type_name("X");
    verb->add_option("--ridge", command->options.ridge,
                     fmt::format("weight of sum w^2, in the same units [boxqp: {}]", kDefaultRidge))
        ->type_name("X");
    add_rbf_options(*verb, *command);
    verb->add_option("--method", command->method,
                     "choice of key shapes: spread, clusters2, clusters3 or hull")
        ->capture_default_str()
        ->type_name("NAME");
    verb->add_option("--key-shapes", command->options.regional.key_shapes, "key shapes of a region")
        ->capture_default_str()
        ->type_name("K");
    verb->add_option("--examples", command->options.regional.examples,
                     "examples of the face, the neutral one among them")
        ->capture_default_str()
        ->type_name("K");
    add_pack_options(*verb, *command);
    verb->footer(
        "Examples:\n  headrig train --rig sample --layout 60 --solver boxqp --cameras cameras.json --out "
        "face.pack\n"
        "  headrig train --rig sample --solver rbf --take sample/take.csv --out rbf.pack --report rbf.html\n"
        "  headrig train --rig fitted --markers rom.npy --hold 0:60 --out face.pack\n"
        "A regression also leaves what training saw beside the pack, NAME.training.csv, for `headrig "
        "report`.");
    verb->callback([command, noise, &exit_code] {
        command->noise_given = noise->count() > 0;
        exit_code = run_train(*command);
    });
}

}  // namespace rig::host
