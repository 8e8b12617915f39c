// headrig fit: where the markers of a performance really sit on the mesh, from a range-of-motion take.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/fit/fit_files.hpp"
#include "firmware_host/companion/fit/marker_noise.hpp"

namespace rig::host {

namespace {

constexpr double kOddScale = 0.15;  // heads of grown people differ less: more is a unit or another rig

struct FitCommand {
    std::string rig;
    std::string layout = "60";
    std::string take;
    std::string out;
    std::string neutral = "0:1";
    double rate_hz = 60.0;
    bool force = false;
    bool no_scale = false;
    bool no_stabilise = false;
    FitOptions options;
};

void print_rounds(const LayoutFit& fit) {
    fmt::print("round   rms mm  mean mm  worst mm  change mm  moved\n");
    for (std::size_t r = 0; r < fit.rounds.size(); ++r) {
        const FitRound& round = fit.rounds[r];
        fmt::print("{:>5} {:>8.3f} {:>8.3f} {:>9.3f} {:>10.3f} {:>6}{}\n", r, round.rms_mm, round.mean_mm,
                   round.worst_mm, round.change_mm, round.moved, r == 0 ? "  layout as given" : "");
    }
    fmt::print("with offsets subtracted: rms {:.3f} mm\n", fit.final_rms_mm);
}

void print_noise(const FitCommand& command, const MarkerTake& take) {
    const CoordinateNoise differences = noise_of_differences(take);
    const CoordinateNoise hold =
        noise_of_hold(take, command.options.neutral_begin, command.options.neutral_end);
    if (differences.markers > 0)
        fmt::print("noise of a coordinate: {:.4f} mm from fourth differences", differences.pooled_mm);
    if (hold.markers > 0) fmt::print("; {:.4f} mm from the neutral hold", hold.pooled_mm);
    if (differences.markers > 0) fmt::print("\n");
}

void print_result(const FitCommand& command, const LayoutFit& fit, const MarkerTake& take) {
    print_rounds(fit);
    print_noise(command, take);
    if (fit.projection_refused) {
        print_error(
            fmt::format("warning: the face is not neutral in frames {}, or the layout was better than they "
                        "are: markers started from the layout; name neutral frames with --neutral",
                        command.neutral));
    }
    if (!fit.converged) {
        print_error(fmt::format("warning: markers still moved after {} rounds; allow more with --rounds",
                                command.options.most_rounds));
    }
    if (std::abs(fit.rig_scale - 1.0) > kOddScale) {
        print_error(fmt::format(
            "warning: the take is {:.3f} times as large as the rig; check the units of both", fit.rig_scale));
    }
    if (command.no_scale) {
        fmt::print("next: headrig train --rig {} --layout {}/markers_{}.csv --out face.pack\n", command.rig,
                   command.out, fit.markers.size());
        return;
    }
    fmt::print("rig scaled by {:.5f} into {}\nnext: headrig train --rig {} --layout {} --out face.pack\n",
               fit.rig_scale, command.out, command.out, fit.markers.size());
}

struct FitInputs {
    Rig rig;
    MarkerLayout layout;
    MarkerTake take;
};

Result<FitInputs, FileError> load_inputs(const FitCommand& command) {
    auto rig = load_rig(command.rig);
    if (!rig) return failure(rig.error());
    auto layout = load_layout(command.rig, command.layout, *rig);
    if (!layout) return failure(layout.error());
    auto take = load_marker_take(command.take, command.rate_hz);
    if (!take) return failure(take.error());
    return FitInputs{std::move(*rig), std::move(*layout), std::move(*take)};
}

int run_fit(FitCommand& command) {
    const auto neutral = read_frame_range(command.neutral);
    if (!neutral) {
        print_error(fmt::format("--neutral {}: give the frames that hold the neutral face, e.g. 0:30",
                                command.neutral));
        return kExitUsage;
    }
    command.options.neutral_begin = neutral->begin;
    command.options.neutral_end = neutral->end;
    command.options.scaled = !command.no_scale;
    command.options.stabilised = !command.no_stabilise;
    if (const std::string fault = fault_of_options(command.options); !fault.empty()) {
        print_error(fault);
        return kExitUsage;
    }
    const auto inputs = load_inputs(command);
    if (!inputs) {
        print_error(inputs.error().message);
        return kExitInput;
    }
    Result<LayoutFit, FileError> fit = failure(FileError{});
    {
        Progress bar("fit", 1000);
        fit = fit_layout(inputs->rig, inputs->layout, inputs->take, command.options,
                         [&](double share, const std::string& stage) {
                             bar.update(static_cast<std::uint64_t>(std::lround(1000.0 * share)), stage);
                         });
    }
    if (!fit) {
        print_error(fit.error().message);
        return kExitInput;
    }
    const auto save = [&]() -> Result<void, FileError> {
        if (const auto ok = make_output_folder(command.out, command.force); !ok) return ok;
        return save_fit(command.out, inputs->rig, *fit, !command.no_scale);
    };
    if (const auto saved = save(); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    print_result(command, *fit, inputs->take);
    return kExitOk;
}

}  // namespace

void add_fit_verb(CLI::App& app, int& exit_code) {
    auto command = std::make_shared<FitCommand>();
    CLI::App* verb =
        app.add_subcommand("fit", "Find where the markers sit on the mesh, from a range-of-motion take");
    verb->add_option("--rig", command->rig, "rig folder")->required()->type_name("DIR");
    verb->add_option("--layout", command->layout, "the layout as far as it is known: number or file")
        ->capture_default_str()
        ->type_name("N|CSV");
    verb->add_option(
            "--take", command->take,
            "range-of-motion take (frames, markers, 3), float32 .npy, NaN = missing, any frame and scale")
        ->required()
        ->type_name("M.npy");
    verb->add_option("--out", command->out, "folder to write: rig, layout and report")
        ->required()
        ->type_name("DIR");
    verb->add_option("--neutral", command->neutral, "frames that hold the neutral face, END not included")
        ->capture_default_str()
        ->type_name("BEGIN:END");
    verb->add_option("--landmarks", command->options.landmarks,
                     "markers that were placed with care, for the first alignment [all]")
        ->delimiter(',')
        ->type_name("NAME,...");
    verb->add_option("--candidates", command->options.candidates,
                     "triangles tried for each marker in a round")
        ->capture_default_str()
        ->type_name("Q");
    verb->add_option("--rounds", command->options.most_rounds, "rounds at most")
        ->capture_default_str()
        ->type_name("R");
    verb->add_option("--threshold", command->options.threshold_mm,
                     "end when no marker's error changes by more than this")
        ->capture_default_str()
        ->type_name("MM");
    verb->add_option("--noise-mm", command->options.noise_mm, "standard deviation of one marker coordinate")
        ->capture_default_str()
        ->type_name("MM");
    verb->add_option("--rate", command->rate_hz, "frames per second")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 1000.0));
    verb->add_flag("--no-scale", command->no_scale, "rig and take are in the same millimetres: keep the rig");
    verb->add_flag("--no-stabilise", command->no_stabilise, "nothing moves the head in the take");
    verb->add_flag("--force", command->force, "write into a folder that is not empty");
    verb->footer(
        "Marker k of the take is marker k of the layout. The folder then holds markers_<n>.csv with "
        "offsets,\n"
        "fit_rounds.csv (error of every round) and fit_markers.csv.\n"
        "Examples:\n"
        "  headrig fit --rig head/ --layout 60 --take rom.npy --neutral 0:30 --out fitted/\n"
        "  headrig fit --rig head/ --layout rough.csv --take rom.npy --no-scale --out fitted/\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing, malformed or does not fit, 4 the\n"
        "folder could not be written or is not empty.");
    verb->callback([command, &exit_code] { exit_code = run_fit(*command); });
}

}  // namespace rig::host
