// headrig detect: marker observations of single images, by the code that runs on the rig.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/detect/detector.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/inspect/detection_overlay.hpp"

namespace rig::host {

namespace {

struct DetectOptions {
    std::vector<std::string> images;
    MarkerPolarity polarity = MarkerPolarity::kAuto;
    double min_diameter_px = DetectorConfig{}.blob.min_diameter_px;
    double max_diameter_px = DetectorConfig{}.blob.max_diameter_px;
    std::string overlay;
    bool report = false;
};

void print_observations(const std::string& stem, const Observations& observations) {
    for (const Observation& seen : observations) {
        fmt::print("{},{:.4f},{:.4f},{:.3f},{:.4f},{:.3f}\n", stem, seen.x_px, seen.y_px, seen.diameter_px,
                   seen.contrast, seen.score);
    }
}

void print_report(const std::string& stem, const DetectorReport& report) {
    using enum Rejection;
    const auto count = [&](Rejection reason) { return report.rejected[static_cast<std::size_t>(reason)]; };
    fmt::print(stderr,
               "{}: {} polarity, mean {:.1f}, saturated {:.1f} %, {} runs, {} candidates; rejected: {} "
               "small, {} large, "
               "{} at the edge, {} faint, {} elongated, {} irregular, {} open, {} in pieces, {} of odd size, "
               "{} low score; "
               "{} left out\n",
               stem, report.polarity == MarkerPolarity::kDark ? "dark" : "bright", report.mean_luma,
               100.0 * report.saturated_fraction, report.runs, report.candidates, count(kSmall),
               count(kLarge), count(kEdge), count(kFaint), count(kElongated), count(kIrregular), count(kOpen),
               count(kSeveral), count(kOddSize), report.low_score, report.left_out);
}

int run_detect(const DetectOptions& options) {
    DetectorConfig config;
    config.polarity = options.polarity;
    config.blob.min_diameter_px = options.min_diameter_px;
    config.blob.max_diameter_px = options.max_diameter_px;
    const auto detector = std::make_unique<Detector>();
    if (!detector->configure(config)) {
        print_error(fmt::format("diameters {} to {} px: want 2 <= least <= greatest <= {}",
                                options.min_diameter_px, options.max_diameter_px, kMaxDotDiameterPx));
        return kExitUsage;
    }
    const std::vector<std::filesystem::path> images(options.images.begin(), options.images.end());
    std::vector<std::filesystem::path> overlays;
    if (!options.overlay.empty()) {
        auto paths = overlay_paths(options.overlay, images);
        if (!paths) {
            print_error(paths.error().message);
            return kExitUsage;
        }
        overlays = std::move(*paths);
    }
    const auto observations = std::make_unique<Observations>();
    int exit_code = kExitOk;
    fmt::print("image,x_px,y_px,diameter_px,contrast,score\n");
    Progress progress("detect", options.images.size());
    for (std::size_t i = 0; i < images.size() && !interrupted(); ++i) {
        const std::filesystem::path& path = images[i];
        const auto image = read_grey_image(path);
        if (!image) {
            print_error(image.error().message);
            exit_code = kExitInput;
            continue;
        }
        DetectorReport report;
        detector->reset();  // every image stands for itself
        detector->detect(image->view(), *observations, report);
        if (report.unprocessable) {
            print_error(fmt::format("{}: {} x {} px, more than {} x {}: make it smaller", path.string(),
                                    image->width_px, image->height_px, kMaxImageWidth, kMaxImageHeight));
            exit_code = kExitInput;
            continue;
        }
        print_observations(path.stem().string(), *observations);
        if (options.report) print_report(path.stem().string(), report);
        if (!overlays.empty()) {
            if (const auto written = draw_detections(overlays[i], *image, observations->span()); !written) {
                print_error(written.error().message);
                return kExitOutput;
            }
        }
        progress.update(i + 1);
    }
    return interrupted() ? kExitInterrupted : exit_code;
}

}  // namespace

void add_detect_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<DetectOptions>();
    CLI::App* verb = app.add_subcommand("detect", "Find the markers in images; CSV on standard output");
    verb->add_option("images", options->images, "PGM, PNG or JPEG files")->required()->type_name("IMAGE");
    const std::map<std::string, MarkerPolarity> names = {{"auto", MarkerPolarity::kAuto},
                                                         {"dark", MarkerPolarity::kDark},
                                                         {"bright", MarkerPolarity::kBright}};
    verb->add_option("--polarity", options->polarity,
                     "markers darker or brighter than the skin: dark, bright or auto")
        ->transform(CLI::CheckedTransformer(names, CLI::ignore_case).description(""))
        ->type_name("SIDE")
        ->default_str("auto");
    verb->add_option("--min-diameter", options->min_diameter_px, "least diameter of a marker, px")
        ->capture_default_str()
        ->type_name("PX");
    verb->add_option("--max-diameter", options->max_diameter_px, "greatest diameter of a marker, px")
        ->capture_default_str()
        ->type_name("PX");
    verb->add_option(
            "--overlay", options->overlay,
            "picture of what was found; for several images a folder, or NAME.png for NAME_<image>.png")
        ->type_name("PNG|DIR");
    verb->add_flag("--report", options->report,
                   "what was looked at and why it was rejected, on standard error");
    verb->footer(
        "Columns: image (file name without ending), x_px, y_px (integers are pixel centres), diameter_px, "
        "contrast "
        "(0..1), score (0..1).\nOverlays: outline of each blob "
        "from red (score 0) to green (1), a cross at its centre, its row among the image's rows from 0."
        "\nExamples:\n  headrig detect take/*.png > dots.csv\n"
        "  headrig detect frame.pgm --polarity bright --overlay frame_dots.png\n"
        "  headrig detect take/*.png --overlay dots/ > dots.csv");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_detect(*options);
    });
}

}  // namespace rig::host
