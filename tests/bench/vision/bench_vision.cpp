// bench_vision    detection against what OpenCV offers, on the same frames in one run: the shared faces where
// they are present, and drawn scenes with clutter. Times are of one thread, methods interleaved so that all
// share the weather.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/detect/detector.hpp"
#include "tests/bench/vision/opencv_methods.hpp"
#include "tests/support/dot_scene/disc_scene.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"
#include "tests/support/image_truth/image_truth.hpp"
#include "tests/support/random.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace rig;

struct BenchFrame {
    std::string set;
    test::Picture picture;
    std::vector<test::TrueDot> dots;
    bool bright = false;
};

struct Method {
    const char* name;
    const char* short_name;
    std::function<std::vector<test::SeenDot>(const BenchFrame&)> look;
    bool counts_only = false;
};

struct Tally {
    test::MatchCounts counts;
    std::vector<double> times_ms;
};

void add_shared_faces(std::vector<BenchFrame>& frames) {
    const auto folder = test::shared_data("images");
    if (folder.empty()) {
        fmt::print("no ../shared/data/images: drawn scenes only\n");
        return;
    }
    auto images = test::read_true_images(folder);
    if (!images) {
        fmt::print(stderr, "bench_vision: {}\n", images.error().message);
        std::exit(3);
    }
    const auto detector = std::make_unique<Detector>();
    for (test::TrueImage& image : *images) {
        Observations observations;
        DetectorReport report;
        detector->reset();
        detector->detect(image.image.view(), observations,
                         report);  // polarity, for the methods that must be told
        frames.push_back({"faces",
                          {image.image.width_px, image.image.height_px, std::move(image.image.pixels)},
                          std::move(image.dots),
                          report.polarity == MarkerPolarity::kBright});
    }
}

void add_scenes(std::vector<BenchFrame>& frames) {
    for (std::uint64_t k = 0; k < 6; ++k) {
        const bool bright = k % 2 == 1;
        test::Scene scene = test::lattice_scene(10.0, 2.2, bright, 100 + k);
        scene.width_px = 640;
        scene.height_px = 480;
        scene.clutter = {.lines = 10, .hairs = 20, .patches = 4, .shadows = 4, .silhouette = true};
        BenchFrame frame{"scenes", test::render(scene), {}, bright};
        for (const test::SceneDot& dot : scene.dots) frame.dots.push_back({dot.x_px, dot.y_px, 3.0, true});
        frames.push_back(std::move(frame));
    }
}

// As in a take: the detector has seen frames like this one before.
std::vector<test::SeenDot> run_settled(Detector& detector, const BenchFrame& frame,
                                       std::span<const ExpectedMarker> expected) {
    static Observations observations;
    DetectorReport report;
    if (expected.empty()) {
        detector.detect(frame.picture.view(), observations, report);
    } else {
        detector.detect_around(frame.picture.view(), expected, observations, report);
    }
    return test::seen_dots(observations);
}

// What a tracker would predict: up to three pixels off.
std::vector<ExpectedMarker> predictions(const BenchFrame& frame) {
    test::SeededRandom random(1);
    std::vector<ExpectedMarker> expected;
    for (const test::TrueDot& dot : frame.dots) {
        expected.push_back({static_cast<float>(dot.x_px + random.uniform(-2.0, 2.0)),
                            static_cast<float>(dot.y_px + random.uniform(-2.0, 2.0)), 6.0F});
    }
    return expected;
}

std::string disc_set(test::Disturbance disturbance, bool bright) {
    return fmt::format("{} discs, {}", bright ? "bright" : "dark", test::name_of(disturbance));
}

// Discs on a round head; the truth is the projected 3D centre. Clean ones for accuracy, others for what
// hurts.
void add_discs(std::vector<BenchFrame>& frames) {
    for (int k = 0; k < static_cast<int>(test::Disturbance::kCount); ++k) {
        for (std::uint64_t i = 0; i < 8; ++i) {
            test::DiscSceneConfig config;
            config.disturbance = static_cast<test::Disturbance>(k);
            config.bright = i % 2 == 1;
            config.seed = 700 + i;
            config.head_radius_mm = 60.0 + 4.0 * static_cast<double>(i);
            config.texture = config.disturbance == test::Disturbance::kNone ? 0.0 : 0.04;
            test::DiscPicture picture = test::render(config);
            auto dots = test::true_dots(picture);
            frames.push_back({disc_set(config.disturbance, config.bright), std::move(picture.picture),
                              std::move(dots), config.bright});
        }
    }
}

// One row per disturbance: recall and precision of each method.
void print_disturbances(const std::vector<BenchFrame>& frames, const std::vector<Method>& methods) {
    fmt::print("\n{:<34}", "recall / precision");
    for (const Method& method : methods) {
        if (!method.counts_only) fmt::print("{:>17.16}", method.short_name);
    }
    fmt::print("\n");
    for (const bool bright : {false, true}) {
        for (int k = 0; k < static_cast<int>(test::Disturbance::kCount); ++k) {
            const std::string set = disc_set(static_cast<test::Disturbance>(k), bright);
            fmt::print("{:<34}", set);
            for (const Method& method : methods) {
                if (method.counts_only) continue;
                test::MatchCounts counts;
                for (const BenchFrame& frame : frames) {
                    if (frame.set == set) counts += test::match(frame.dots, method.look(frame));
                }
                fmt::print("{:>9.3f} / {:.3f}", counts.recall(), counts.precision());
            }
            fmt::print("\n");
        }
    }
}

std::vector<test::SeenDot> run_detector(Detector& detector, const BenchFrame& frame,
                                        MarkerPolarity polarity) {
    DetectorConfig config;
    config.polarity = polarity;
    if (!detector.configure(config)) std::abort();
    static Observations observations;
    DetectorReport report;
    detector.detect(frame.picture.view(), observations, report);
    return test::seen_dots(observations);
}

// Of this thread: what other programs take does not count, though the caches they spoil do.
double cpu_ms() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double percentile(std::vector<double> values, double part) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

void print_table(const std::string& set, const std::vector<BenchFrame>& frames,
                 const std::vector<Method>& methods, int repeat) {
    std::vector<Tally> tallies(methods.size());
    for (int round = 0; round < repeat; ++round) {
        for (const BenchFrame& frame : frames) {
            if (frame.set != set) continue;
            for (std::size_t m = 0; m < methods.size(); ++m) {
                const double start_ms = cpu_ms();
                const std::vector<test::SeenDot> seen = methods[m].look(frame);
                tallies[m].times_ms.push_back(cpu_ms() - start_ms);
                if (round == 0) tallies[m].counts += test::match(frame.dots, seen);
            }
        }
    }
    if (tallies[0].times_ms.empty()) return;
    fmt::print("\n{}\n{:<42}{:>9}{:>9}{:>10}{:>9}{:>11}\n", set, "method", "p50 ms", "p99 ms", "rms px",
               "recall", "precision");
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const Tally& tally = tallies[m];
        fmt::print("{:<42}{:>9.3f}{:>9.3f}", methods[m].name, percentile(tally.times_ms, 0.5),
                   percentile(tally.times_ms, 0.99));
        if (methods[m].counts_only) {
            fmt::print("{:>10}{:>9}{:>11}\n", "-", "-", "-");
        } else {
            fmt::print("{:>10.3f}{:>9.3f}{:>11.3f}\n", tally.counts.rms_px(), tally.counts.recall(),
                       tally.counts.precision());
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"bench_vision: marker detection against OpenCV on the same frames"};
    int repeat = 50;
    app.add_option("--repeat", repeat, "rounds over all frames")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    bench::use_one_thread();

    std::vector<BenchFrame> frames;
    add_shared_faces(frames);
    add_scenes(frames);
    add_discs(frames);
    const auto detector = std::make_unique<Detector>();
    volatile std::size_t sink = 0;
    // One for each polarity, as each camera of a rig has its own.
    std::array<std::unique_ptr<Detector>, 2> settled;
    for (const bool bright : {false, true}) {
        settled[bright] = std::make_unique<Detector>();
        DetectorConfig config;
        config.polarity = bright ? MarkerPolarity::kBright : MarkerPolarity::kDark;
        if (!settled[bright]->configure(config)) std::abort();
    }
    const auto make_predictions = [&] {
        std::vector<std::vector<ExpectedMarker>> all;
        for (const BenchFrame& frame : frames) all.push_back(predictions(frame));
        return all;
    };
    const std::vector<std::vector<ExpectedMarker>> expected = make_predictions();
    const std::vector<Method> methods = {
        {"detector, whole image", "whole image",
         [&](const BenchFrame& f) { return run_settled(*settled[f.bright], f, {}); }},
        {"detector, windows about predictions", "windows",
         [&](const BenchFrame& f) {
             return run_settled(*settled[f.bright], f,
                                expected[static_cast<std::size_t>(&f - frames.data())]);
         }},
        {"detector, first frame", "detector",
         [&](const BenchFrame& f) {
             return run_detector(*detector, f, f.bright ? MarkerPolarity::kBright : MarkerPolarity::kDark);
         }},
        {"detector, polarity found (first frames)", "polarity found",
         [&](const BenchFrame& f) { return run_detector(*detector, f, MarkerPolarity::kAuto); }},
        {"OpenCV SimpleBlobDetector", "SimpleBlob",
         [](const BenchFrame& f) { return bench::simple_blob_detector(f.picture.view(), f.bright); }},
        {"OpenCV threshold, findContours", "findContours",
         [](const BenchFrame& f) { return bench::threshold_contours(f.picture.view(), f.bright); }},
        {"OpenCV threshold, connectedComponents", "components",
         [](const BenchFrame& f) { return bench::threshold_components(f.picture.view(), f.bright); }},
        {"plain threshold and count", "",
         [&](const BenchFrame& f) {
             sink = sink + bench::threshold_count(f.picture.view(), f.bright);
             return std::vector<test::SeenDot>{};
         },
         true},
    };
    print_table("faces", frames, methods, repeat);
    print_table("scenes", frames, methods, repeat);
    for (const bool bright : {false, true}) {
        print_table(disc_set(test::Disturbance::kNone, bright), frames, methods, repeat);
    }
    print_disturbances(frames, methods);
    return 0;
}
