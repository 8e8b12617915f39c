// How well markers are found in drawn scenes of every kind. Bounds are two-sided where a result that is
// suddenly much better would mean that the scene, not the detector, has changed. Figures of the last run:
// core/detect/README.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/detect/detector.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"

namespace {

using namespace rig;

constexpr std::uint64_t kScenes = 3;

test::MatchCounts look_at(const test::Scene& scene) {
    const auto detector = std::make_unique<Detector>();
    const auto picture = test::render(scene);
    Observations observations;
    DetectorReport report;
    detector->detect(picture.view(), observations, report);
    std::vector<test::TrueDot> truth;
    for (const test::SceneDot& dot : scene.dots) {
        truth.push_back({dot.x_px, dot.y_px, std::max(1.5, 0.5 * dot.long_px), true});
    }
    return test::match(truth, test::seen_dots(observations));
}

void record(const char* name, const test::MatchCounts& counts) {
    testing::Test::RecordProperty(std::string(name) + "_recall", std::to_string(counts.recall()));
    testing::Test::RecordProperty(std::string(name) + "_rms_px", std::to_string(counts.rms_px()));
    std::printf("    %-18s %4zu dots  recall %.4f  precision %.4f  rms %.3f px  largest %.2f px\n", name,
                counts.expected, counts.recall(), counts.precision(), counts.rms_px(),
                counts.largest_error_px);
}

struct SizeCase {
    double diameter_px;
    double max_aspect;
    double least_recall;
};

class DotSizes : public testing::TestWithParam<bool> {};

TEST_P(DotSizes, FourToTwentyFourPixels) {
    const bool bright = GetParam();
    for (const SizeCase size :
         {SizeCase{4, 1.3, 0.97}, SizeCase{6, 1.8, 0.98}, SizeCase{8, 2.6, 0.98}, SizeCase{10, 2.6, 0.98},
          SizeCase{14, 2.6, 0.98}, SizeCase{18, 2.6, 0.98}, SizeCase{24, 2.6, 0.98}}) {
        test::MatchCounts counts;
        for (std::uint64_t k = 0; k < kScenes; ++k)
            counts += look_at(test::lattice_scene(size.diameter_px, size.max_aspect, bright, 7 * k + 1));
        record((std::string(bright ? "bright_" : "dark_") +
                std::to_string(static_cast<int>(size.diameter_px)) + "px")
                   .c_str(),
               counts);
        EXPECT_GE(counts.recall(), size.least_recall) << size.diameter_px;
        EXPECT_GE(counts.precision(), 0.995) << size.diameter_px;
        EXPECT_LE(counts.rms_px(), 0.11) << size.diameter_px;
        EXPECT_GE(counts.rms_px(), 0.02) << size.diameter_px;
    }
}

INSTANTIATE_TEST_SUITE_P(Polarity, DotSizes, testing::Bool(),
                         [](const auto& polarity) { return polarity.param ? "Bright" : "Dark"; });

TEST(DotScenes, ClutterIsNotMistakenForMarkers) {
    for (const bool bright : {false, true}) {
        test::MatchCounts counts;
        for (std::uint64_t k = 0; k < kScenes; ++k) {
            test::Scene scene = test::lattice_scene(10, 2.2, bright, 7 * k + 3);
            scene.clutter = {.lines = 10, .hairs = 25, .patches = 5, .shadows = 5, .silhouette = true};
            std::erase_if(scene.dots,
                          [&](const test::SceneDot& dot) { return dot.x_px > 0.85 * scene.width_px - 10.0; });
            counts += look_at(scene);
        }
        record(bright ? "clutter_bright" : "clutter_dark", counts);
        EXPECT_GE(counts.precision(), 0.99);
        EXPECT_GE(counts.recall(), 0.93);  // hairs and patches lie across some dots
        EXPECT_LE(counts.rms_px(), 0.25);  // and hide parts of others
    }
}

TEST(DotScenes, ClutterAloneIsAlmostNothing) {
    std::size_t seen = 0;
    for (std::uint64_t k = 0; k < 6; ++k) {
        test::Scene scene;
        scene.seed = 50 + k;
        scene.clutter = {.lines = 12, .hairs = 30, .patches = 5, .shadows = 5, .silhouette = k % 2 == 0};
        seen += look_at(scene).seen;
    }
    std::printf("    clutter without any marker: %zu sightings in 6 pictures\n", seen);
    EXPECT_LE(seen, 30U);
}

// A merged pair is dropped or taken apart. Reported in the middle it would be a marker that does not exist.
TEST(DotScenes, TouchingMarkersAreNeverOneInTheMiddle) {
    for (const bool bright : {false, true}) {
        for (const double diameter : {6.0, 10.0, 16.0}) {
            test::MatchCounts counts;
            for (std::uint64_t k = 0; k < kScenes; ++k)
                counts += look_at(test::touching_scene(diameter, bright, 7 * k + 4));
            record((std::string(bright ? "touching_bright_" : "touching_dark_") +
                    std::to_string(static_cast<int>(diameter)))
                       .c_str(),
                   counts);
            EXPECT_GE(counts.precision(), 0.99);
            EXPECT_LE(counts.rms_px(), 0.25);
        }
    }
}

TEST(DotScenes, GlintsInsideMarkersAreFilled) {
    test::MatchCounts counts;
    for (std::uint64_t k = 0; k < kScenes; ++k) {
        test::Scene scene = test::lattice_scene(14, 1.8, false, 7 * k + 5);
        for (std::size_t i = 0; i < scene.dots.size(); i += 3) scene.dots[i].glint = true;
        counts += look_at(scene);
    }
    record("glints", counts);
    EXPECT_GE(counts.recall(), 0.98);
    EXPECT_LE(counts.rms_px(), 0.11);
}

TEST(DotScenes, BlurAndNoiseCostGently) {
    struct Case {
        const char* name;
        double blur_px;
        double read_noise;
        double least_recall;
        double most_rms_px;
    };
    for (const Case c : {Case{"blur_0.3", 0.3, 1.5, 0.99, 0.09}, Case{"blur_1.5", 1.5, 1.5, 0.95, 0.15},
                         Case{"blur_2.0", 2.0, 1.5, 0.8, 0.21}, Case{"noise_4", 0.8, 4.0, 0.99, 0.11},
                         Case{"noise_8", 0.8, 8.0, 0.96, 0.15}}) {
        test::MatchCounts counts;
        for (std::uint64_t k = 0; k < kScenes; ++k) {
            test::Scene scene = test::lattice_scene(10, 2.0, false, 7 * k + 6);
            scene.light.blur_px = c.blur_px;
            scene.light.read_noise = c.read_noise;
            counts += look_at(scene);
        }
        record(c.name, counts);
        EXPECT_GE(counts.recall(), c.least_recall) << c.name;
        EXPECT_GE(counts.precision(), 0.99) << c.name;
        EXPECT_LE(counts.rms_px(), c.most_rms_px) << c.name;
    }
}

}  // namespace
