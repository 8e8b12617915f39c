// headrig smooth: a finished take, band by band or with a Gaussian.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/smooth/motion_bands.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct SmoothOptions {
    std::string take;
    std::string out;
    std::string pack;
    std::vector<double> gains;
    double gaussian_ms = 0.0;
    bool list_bands = false;
};

struct WeightRange {
    double low = 0.0;
    double high = 1.0;
};

constexpr std::size_t kFirstShape = 2;  // behind frame and time_s

// Empty when the take is a table of weights, frame after frame.
std::string fault_of(const NumericTable& take) {
    if (take.columns.size() <= kFirstShape || take.columns[0] != "frame" || take.columns[1] != "time_s")
        return "is no table of weights: expected frame,time_s,<shapes>";
    if (take.row_count == 0) return "has no frames";
    for (std::size_t row = 1; row < take.row_count; ++row) {
        const double* const at = take.values.data() + row * take.columns.size();
        const double* const before = at - take.columns.size();
        if (at[0] != before[0] + 1.0) {
            return fmt::format("frame {:.0f} follows frame {:.0f}; a filter needs every frame", at[0],
                               before[0]);
        }
    }
    return "";
}

double frames_per_second(const NumericTable& take) {
    if (take.row_count < 2) return 60.0;
    const std::size_t last = (take.row_count - 1) * take.columns.size();
    const double seconds = take.values[last + 1] - take.values[1];
    return seconds > 0.0 ? static_cast<double>(take.row_count - 1) / seconds : 60.0;
}

// The pack's, or 0..1 and as far beyond as the take itself goes.
Result<std::vector<WeightRange>, std::string> ranges_of(const SmoothOptions& options,
                                                        const NumericTable& take) {
    const std::size_t shapes = take.columns.size() - kFirstShape;
    std::vector<WeightRange> ranges(shapes);
    if (options.pack.empty()) {
        for (std::size_t row = 0; row < take.row_count; ++row) {
            for (std::size_t i = 0; i < shapes; ++i) {
                const double w = take.values[row * take.columns.size() + kFirstShape + i];
                ranges[i] = {std::min(ranges[i].low, w), std::max(ranges[i].high, w)};
            }
        }
        return ranges;
    }
    const auto opened = open_pack_file(options.pack);
    if (!opened) return failure(opened.error().message);
    const SolvePack& pack = opened->pack();
    for (std::size_t i = 0; i < shapes; ++i) {
        const auto begin = pack.shape_names.begin();
        const auto end = begin + pack.shape_count;
        const auto found = std::find(begin, end, take.columns[kFirstShape + i]);
        if (found == end)
            return failure(fmt::format("{}: has no shape '{}'", options.pack, take.columns[kFirstShape + i]));
        const auto k = static_cast<std::size_t>(found - begin);
        ranges[i] = {static_cast<double>(pack.weight_low[k]), static_cast<double>(pack.weight_high[k])};
    }
    return ranges;
}

int list_bands(const NumericTable& take) {
    const double rate_hz = frames_per_second(take);
    fmt::print("band  period_frames  frequency_hz\n");
    for (std::size_t k = 0; k < band_count(take.row_count); ++k) {
        const double period = band_period_frames(k);
        fmt::print("{:4}  {:13.1f}  {:12.3f}\n", k, period, rate_hz / period);
    }
    return kExitOk;
}

CsvWriter smoothed(const SmoothOptions& options, const NumericTable& take,
                   const std::vector<WeightRange>& ranges) {
    const std::size_t width = take.columns.size();
    std::vector<std::vector<double>> curves;
    for (std::size_t i = 0; i + kFirstShape < width; ++i) {
        std::vector<double> curve(take.row_count);
        for (std::size_t row = 0; row < take.row_count; ++row)
            curve[row] = take.values[row * width + kFirstShape + i];
        const auto& [low, high] = ranges[i];
        if (options.gaussian_ms > 0.0) {
            const double sigma_frames = options.gaussian_ms * 1e-3 * frames_per_second(take);
            curve = smooth_gaussian(curve, sigma_frames, low, high);
        }
        curves.push_back(shape_bands(curve, options.gains, low, high));
    }
    CsvWriter csv(take.columns);
    for (std::size_t row = 0; row < take.row_count; ++row) {
        csv.integer(std::llround(take.values[row * width]));
        csv.number(take.values[row * width + 1], 6);
        for (const std::vector<double>& curve : curves) csv.number(curve[row], 6);
        csv.end_row();
    }
    return csv;
}

int run_smooth(const SmoothOptions& options) {
    const auto take = read_numeric_csv(options.take);
    if (!take) {
        print_error(take.error().message);
        return kExitInput;
    }
    if (const std::string fault = fault_of(*take); !fault.empty()) {
        print_error(options.take + ": " + fault);
        return kExitInput;
    }
    if (options.list_bands) return list_bands(*take);
    if (options.gains.size() > band_count(take->row_count)) {
        print_error(fmt::format("--gains: {} gains, but a take of {} frames has {} bands",
                                options.gains.size(), take->row_count, band_count(take->row_count)));
        return kExitUsage;
    }
    const auto ranges = ranges_of(options, *take);
    if (!ranges) {
        print_error(ranges.error());
        return kExitInput;
    }
    const CsvWriter csv = smoothed(options, *take, *ranges);
    if (options.out.empty()) {
        fmt::print("{}", csv.contents());
        return kExitOk;
    }
    if (const auto saved = csv.save(options.out); !saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    return kExitOk;
}

}  // namespace

void add_smooth_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<SmoothOptions>();
    CLI::App* verb =
        app.add_subcommand("smooth", "Smooth a finished take: gains for bands of motion, or a Gaussian");
    verb->add_option("--take", options->take, "Weights: frame,time_s,<shapes>, every frame")
        ->required()
        ->type_name("W.csv");
    verb->add_option("--gains", options->gains,
                     "Gain of each band, the fastest first; bands beyond the list keep 1")
        ->delimiter(',')
        ->check(CLI::Range(-100.0, 100.0).description(""))
        ->type_name("G0,G1,...");
    verb->add_option("--gaussian", options->gaussian_ms,
                     "Standard deviation of a Gaussian in milliseconds, before the bands")
        ->check(CLI::Range(0.0, 60000.0).description(""))
        ->type_name("MS");
    verb->add_option("--pack", options->pack,
                     "Pack whose ranges hold; without it 0 to 1, and as far beyond as the take goes")
        ->type_name("FILE");
    verb->add_option("--out", options->out, "Smoothed weights (default: standard output)")
        ->type_name("S.csv");
    verb->add_flag("--list-bands", options->list_bands,
                   "Only print the bands of this take and their periods");
    verb->footer(
        "Band 0 is motion from frame to frame; band k is centred at a period of about 3.7 frames times 2^k,\n"
        "see --list-bands. A gain under 1 "
        "takes\n"
        "that motion back, one over 1 exaggerates it; all 1 changes nothing. Every weight stays in its "
        "range.\n"
        "Examples:\n"
        "  headrig smooth --take w.csv --gains 0,0.5 --out calm.csv\n"
        "  headrig smooth --take w.csv --gains 0.2,0.6,1,1.3,1.3 --out livelier.csv\n"
        "  headrig smooth --take w.csv --gaussian 40 --out soft.csv\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, 4 the output could "
        "not "
        "be\nwritten.");
    verb->callback([options, &exit_code] { exit_code = run_smooth(*options); });
}

}  // namespace rig::host
