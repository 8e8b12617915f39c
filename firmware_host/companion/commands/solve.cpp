// headrig solve: marker streams to weights, by the code that runs on the rig.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/base/math.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/solve/confidence.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/replay/offline_pipeline.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "firmware_host/settings/control_settings.hpp"
#include "firmware_host/settings/settings_file.hpp"
#include "firmware_host/settings/shape_selection.hpp"

namespace rig::host {

namespace {

struct SolveOptions {
    std::string pack;
    std::string markers;
    std::string weights_csv;
    std::string report_csv;
    std::string labels_npy;
    std::string points_npy;
    bool unlabelled = false;
    bool no_filter = false;
    FilterSettings smoothing;
    std::string controls_toml;
    std::vector<std::string> controls;  // behind those of the file, so these win
    bool no_stabilise = false;
    double rate_hz = 60.0;
};

// The parts of the face whose confidence is reported: those of the regions that this pack has shapes of.
struct ReportedRegion {
    std::string name;
    std::vector<std::size_t> shapes;
};

// What the outputs are collected in before any file is written.
struct SolveResults {
    std::vector<ReportedRegion> regions;
    CsvWriter weights;
    CsvWriter report;
    NpyArray<std::int32_t> labels;
    NpyArray<float> points;
};

std::vector<ReportedRegion> reported_regions(const SolvePack& pack) {
    std::vector<ReportedRegion> regions;
    for (const char* name : {"brows", "lids", "cheeks", "nose", "mouth", "jaw"}) {
        auto shapes = select_shapes(name, std::span(pack.shape_names).first(pack.shape_count));
        if (shapes && !shapes->empty()) regions.push_back({name, std::move(*shapes)});
    }
    return regions;
}

std::vector<std::string> report_columns(const SolvePack& pack, std::span<const ReportedRegion> regions) {
    std::vector<std::string> columns{"frame",        "state",        "kkt",
                                     "objective",    "iterations",   "working_set_changes",
                                     "optimal",      "markers_used", "residual_rms_mm",
                                     "slip_rx_rad",  "slip_ry_rad",  "slip_rz_rad",
                                     "slip_tx_mm",   "slip_ty_mm",   "slip_tz_mm",
                                     "delay_frames", "delay_ms"};
    for (const ReportedRegion& region : regions) columns.push_back("confidence_" + region.name);
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        columns.push_back(fmt::format("region_{}_residual_mm", pack.regions[r].name));
        columns.push_back(fmt::format("region_{}_confidence", pack.regions[r].name));
    }
    return columns;
}

std::vector<std::string> weight_columns(const SolvePack& pack) {
    std::vector<std::string> columns{"frame", "time_s"};
    for (std::size_t i = 0; i < pack.shape_count; ++i) columns.emplace_back(pack.shape_names[i]);
    return columns;
}

const char* state_name(TrackingState state) {
    switch (state) {
        case TrackingState::kSafe:
            return "SAFE";
        case TrackingState::kLost:
            return "LOST";
        case TrackingState::kHold:
            return "HOLD";
        case TrackingState::kPartial:
            return "PARTIAL";
        case TrackingState::kLive:
            return "LIVE";
    }
    return "?";
}

Result<void, FileError> check_stream(const SolveOptions& options, const SolvePack& pack,
                                     const NpyArray<float>& stream) {
    if (stream.shape.size() != 3 || stream.shape[2] != 3) {
        return failure(
            FileError{options.markers + ": not a marker stream; expected an array (frames, markers, 3)"});
    }
    if (options.unlabelled) {
        if (stream.shape[1] >= 1 && stream.shape[1] <= kMaxPoints) return {};
        return failure(FileError{fmt::format("{}: {} slots a frame; 1 to {} are possible", options.markers,
                                             stream.shape[1], kMaxPoints)});
    }
    if (stream.shape[1] == pack.marker_count) return {};
    return failure(
        FileError{fmt::format("{}: {} markers a frame, but {} was trained for {}; train a pack for this "
                              "layout, or say --unlabelled if "
                              "the rows are shuffled",
                              options.markers, stream.shape[1], options.pack, pack.marker_count)});
}

void add_report_row(std::size_t frame, const SolvePack& pack, std::span<const ReportedRegion> regions,
                    const FaceState& state, const FrameReport& report, const RegionalOutput& solved,
                    CsvWriter& csv) {
    csv.integer(static_cast<std::int64_t>(frame)).text(state_name(state.state));
    csv.number(report.kkt, 12).number(report.objective_mm2, 6).integer(report.iterations);
    csv.integer(report.working_set_changes).integer(report.optimal ? 1 : 0);
    csv.integer(report.markers_used).number(report.residual_rms_mm, 6);
    for (const float r : state.slip.rotation_rad) csv.number(static_cast<double>(r), 7);
    for (const float t : state.slip.translation_mm) csv.number(static_cast<double>(t), 5);
    csv.integer(report.delay_frames).number(static_cast<double>(report.delay_us) * 1e-3, 3);
    for (const ReportedRegion& region : regions) {
        csv.number(static_cast<double>(region_confidence(pack.prior_sigma, state.confidence, region.shapes)),
                   5);
    }
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        csv.number(report.solved ? solved.regions[r].residual_rms_mm : kNone, 6);
        csv.number(report.solved ? static_cast<double>(solved.regions[r].confidence) : kNone, 4);
    }
    csv.end_row();
}

void add_results(const SolveOptions& options, const SolvePack& pack, std::size_t frame,
                 const FaceState& state, const FrameReport& report, const RegionalOutput& regions,
                 std::size_t slots, SolveResults& results) {
    results.weights.integer(static_cast<std::int64_t>(frame));
    results.weights.number(static_cast<double>(frame) / options.rate_hz, 6);
    for (std::size_t i = 0; i < pack.shape_count; ++i)
        results.weights.number(static_cast<double>(state.weights[i]), 6);
    results.weights.end_row();
    add_report_row(frame, pack, results.regions, state, report, regions, results.report);
    for (std::size_t s = 0; s < slots; ++s) results.labels.values.push_back(report.labels[s]);
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
            // A frame without a solve has no completed markers: NaN, as in the input, never a position.
            results.points.values.push_back(report.solved
                                                ? static_cast<float>(report.face_markers_mm[k][axis])
                                                : std::numeric_limits<float>::quiet_NaN());
        }
    }
}

// A labelled stream's label is its own index, unless the names were found wrong and mended or dropped.
void label_own_rows(const Pipeline& pipeline, std::span<const Vec3> positions, FrameReport& report) {
    std::size_t sighting = 0;
    for (std::size_t slot = 0; slot < positions.size(); ++slot) {
        const Vec3& p = positions[slot];
        if (!is_finite(p[0]) || !is_finite(p[1]) || !is_finite(p[2]) || p.cwiseAbs().maxCoeff() > 1000.0)
            continue;
        const auto& taken = pipeline.matches()[0];
        for (std::size_t k = 0; k < positions.size(); ++k) {
            if (taken[k] == static_cast<std::int16_t>(sighting))
                report.labels[slot] = static_cast<std::int16_t>(k);
        }
        ++sighting;
    }
}

int solve_frames(const SolveOptions& options, const SolvePack& pack, const NpyArray<float>& stream,
                 Pipeline& pipeline, SolveResults& results) {
    const std::size_t frames = stream.shape[0];
    const std::size_t slots = stream.shape[1];
    std::vector<Vec3> positions(slots);
    auto state = std::make_unique<FaceState>();
    auto report = std::make_unique<FrameReport>();
    Progress progress("solve", frames);
    for (std::size_t frame = 0; frame < frames; ++frame) {
        if (interrupted()) return kExitInterrupted;
        for (std::size_t s = 0; s < slots; ++s) {
            const float* at = stream.values.data() + (frame * slots + s) * 3;
            positions[s] =
                Vec3{static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
        }
        const auto capture_us =
            static_cast<std::int64_t>(std::llround(static_cast<double>(frame) * 1e6 / options.rate_hz));
        if (options.unlabelled) {
            pipeline.step(PointFrame{capture_us, positions}, *state, *report);
        } else {
            pipeline.step(LabelledFrame{capture_us, positions}, *state, *report);
            label_own_rows(pipeline, positions, *report);
        }
        add_results(options, pack, frame, *state, *report, pipeline.regions(), slots, results);
        progress.update(frame + 1);
    }
    return kExitOk;
}

Result<void, FileError> save_results(const SolveOptions& options, const SolveResults& results) {
    if (!options.weights_csv.empty()) {
        if (const auto saved = results.weights.save(options.weights_csv); !saved) return saved;
    }
    if (!options.report_csv.empty()) {
        if (const auto saved = results.report.save(options.report_csv); !saved) return saved;
    }
    if (!options.labels_npy.empty()) {
        if (const auto saved = write_npy(options.labels_npy, results.labels); !saved) return saved;
    }
    if (!options.points_npy.empty()) return write_npy(options.points_npy, results.points);
    return {};
}

Result<PipelineConfig, std::string> pipeline_config(const SolveOptions& options, const SolvePack& pack) {
    PipelineConfig config;
    config.filter = !options.no_filter && !smooths_nothing(options.smoothing);
    config.stabilise = !options.no_stabilise;
    config.rate_hz = options.rate_hz;
    const auto choice = filter_choice(options.smoothing, std::span(pack.shape_names).first(pack.shape_count));
    if (!choice) return failure("--filter: " + choice.error());
    config.smoothing = *choice;
    return config;
}

// What the command line says goes before what the file says.
Result<SolveOptions, std::string> with_settings_file(const SolveOptions& options) {
    if (options.controls_toml.empty()) return options;
    auto file = read_settings_file(options.controls_toml);
    if (!file) return failure(file.error());
    SolveOptions both = options;
    both.smoothing = merged(file->smoothing, options.smoothing);
    both.controls = std::move(file->controls);
    both.controls.insert(both.controls.end(), options.controls.begin(), options.controls.end());
    return both;
}

Result<void, std::string> set_controls(const SolveOptions& options, const SolvePack& pack,
                                       Pipeline& pipeline) {
    const auto edits = parse_controls(options.controls, std::span(pack.shape_names).first(pack.shape_count));
    if (!edits) return failure(edits.error());
    auto set = std::make_unique<ControlSet>();
    for (const ControlEdit& edit : *edits) {
        if (!edit_controls(edit, pack.shape_count, *set))
            return failure(std::string("there is no room for so many pairs"));
    }
    if (!pipeline.set_controls(*set)) return failure(std::string("the solver refuses these controls"));
    return {};
}

int run_solve(const SolveOptions& command_line) {
    const auto with_file = with_settings_file(command_line);
    if (!with_file) {
        print_error(with_file.error());
        return kExitInput;
    }
    const SolveOptions& options = *with_file;
    const auto opened = open_pack_file(options.pack);
    if (!opened) {
        print_error(opened.error().message);
        return kExitInput;
    }
    const SolvePack& pack = opened->pack();
    const auto stream = read_npy<float>(options.markers);
    if (!stream) {
        print_error(stream.error().message);
        return kExitInput;
    }
    if (const auto fits = check_stream(options, pack, *stream); !fits) {
        print_error(fits.error().message);
        return kExitInput;
    }
    const auto config = pipeline_config(options, pack);
    if (!config) {
        print_error(config.error());
        return kExitUsage;
    }
    const auto pipeline = offline_pipeline(pack, *config, options.pack);
    if (!pipeline) {
        print_error(pipeline.error().message);
        return kExitInput;
    }
    if (const auto set = set_controls(options, pack, **pipeline); !set) {
        print_error(set.error());
        return kExitUsage;
    }
    std::vector<ReportedRegion> regions = reported_regions(pack);
    SolveResults results{
        {}, CsvWriter(weight_columns(pack)), CsvWriter(report_columns(pack, regions)), {}, {}};
    results.regions = std::move(regions);
    results.labels.shape = {stream->shape[0], stream->shape[1]};
    results.points.shape = {stream->shape[0], pack.marker_count, 3};
    install_interrupt_handler();
    const int code = solve_frames(options, pack, *stream, **pipeline, results);
    if (code != kExitOk) return code;
    if (const auto saved = save_results(options, results); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    if (options.weights_csv.empty()) fmt::print("{}", results.weights.contents());
    return kExitOk;
}

void add_filter_options(CLI::App& verb, SolveOptions& options) {
    verb.add_option_function<std::string>(
            "--filter", [&options](const std::string& word) { options.smoothing.kind = filter_kind(word); },
            "Smoothing of every shape: none (as --no-filter), one-euro (the "
            "default) or savitzky-golay")
        ->check(CLI::IsMember({"none", "one-euro", "savitzky-golay"}).description(""))
        ->type_name("KIND")
        ->excludes("--no-filter");
    verb.add_option("--window", options.smoothing.window_frames,
                    "savitzky-golay: frames that a fit goes through, 3 to 61 (15)")
        ->check(CLI::Range(3, static_cast<int>(kMaxWindowFrames)).description(""))
        ->type_name("FRAMES");
    verb.add_option("--delay", options.smoothing.delay_frames,
                    "savitzky-golay: how far back the answer lies, below the window (half of it); each row "
                    "then holds the weights of that earlier frame, see delay_ms of the report")
        ->check(CLI::Range(0, static_cast<int>(kMaxWindowFrames) - 1).description(""))
        ->type_name("FRAMES");
}

}  // namespace

void add_solve_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<SolveOptions>();
    CLI::App* verb = app.add_subcommand("solve", "Solve a recorded marker stream: positions in, weights out");
    verb->add_option("--pack", options->pack, "Pack made by `headrig train`")->required()->type_name("FILE");
    verb->add_option("--markers", options->markers,
                     "Stream (frames, markers, 3), float32 .npy, millimetres, NaN = missing")
        ->required()
        ->type_name("M.npy");
    verb->add_option("--out", options->weights_csv,
                     "Weights: frame,time_s,<shapes> (default: standard output)")
        ->type_name("W.csv");
    verb->add_option("--report", options->report_csv,
                     "Certificate, slip and delay of every frame; columns in the folder's README")
        ->type_name("R.csv");
    verb->add_option("--labels", options->labels_npy,
                     "(frames, slots) int32: the marker of each slot, -1 = ghost")
        ->type_name("L.npy");
    verb->add_option("--points", options->points_npy,
                     "(frames, markers, 3) float32: completed, stabilised markers, mm")
        ->type_name("P.npy");
    verb->add_flag("--unlabelled", options->unlabelled, "Rows come in any order, ghosts among them");
    verb->add_option("--rate", options->rate_hz, "Frames per second")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 1000.0));
    verb->add_flag("--no-filter", options->no_filter,
                   "No smoothing, no recovery blends (a pack's temporal prior stays)");
    add_filter_options(*verb, *options);
    verb->add_option("--controls", options->controls_toml,
                     "Artist's controls and smoothing, firmware_host/settings/settings_file.hpp")
        ->type_name("FILE.toml");
    verb->add_option("--set", options->controls, "One control, WHO.CONTROL=VALUE as in `headrig control`")
        ->type_name("CONTROL");
    verb->add_flag("--no-stabilise", options->no_stabilise, "The stream is in the face frame already");
    verb->footer(
        "Examples:\n"
        "  headrig train --rig head/ --layout 60 --solver boxqp --out face.pack\n"
        "  headrig solve --pack face.pack --markers take.npy --out weights.csv --report report.csv\n"
        "  headrig solve --pack face.pack --markers cloud.npy --unlabelled --labels names.npy --out "
        "weights.csv\n"
        "  headrig solve --pack face.pack --markers take.npy --filter savitzky-golay --window 15 --delay 7 "
        "--out w.csv\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, 4 an output could not "
        "be\n"
        "written, 130 interrupted.");
    verb->callback([options, &exit_code] { exit_code = run_solve(*options); });
}

}  // namespace rig::host
