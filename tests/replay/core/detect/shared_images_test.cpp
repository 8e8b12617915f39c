// The rendered faces of the shared data: five with ink, one with retro-reflective dots, made by a renderer
// that shares no code with this project. Issue 2 asks for recall and precision of 0.98 and 0.12 px; bounds
// here are as tight as the last run allows, on both sides, so that drift in either direction is looked at.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/detect/detector.hpp"
#include "tests/support/dot_scene/match.hpp"
#include "tests/support/image_truth/image_truth.hpp"
#include "tests/support/shared_data.hpp"

namespace {

using namespace rig;

// How an image is come to: as the first, after others like it, or with predictions.
enum class Way { kFirst, kSettled, kAround };

void look(Detector& detector, Way way, const ImageView& image, Observations& observations,
          DetectorReport& report) {
    detector.reset();
    detector.detect(image, observations, report);
    if (way == Way::kFirst) return;
    for (int frame = 0; frame < 10; ++frame) detector.detect(image, observations, report);
    if (way == Way::kSettled) return;
    std::vector<ExpectedMarker> expected;
    for (const Observation& seen : observations)
        expected.push_back({seen.x_px + 2.0F, seen.y_px - 2.0F, 6.0F});
    detector.detect_around(image, expected, observations, report);
    EXPECT_FALSE(report.whole_image);
}

class SharedImages : public testing::TestWithParam<Way> {};

TEST_P(SharedImages, MarkersOfRealFacesAreFound) {
    RIG_SHARED_DATA_OR_SKIP(path, "images");
    const auto images = test::read_true_images(path);
    ASSERT_TRUE(images) << images.error().message;
    ASSERT_EQ(images->size(), 6U);
    test::MatchCounts all;
    test::MatchCounts frontal;
    const auto detector = std::make_unique<Detector>();
    for (const test::TrueImage& image : *images) {
        Observations observations;
        DetectorReport report;
        look(*detector, GetParam(), image.image.view(), observations, report);
        const auto seen = test::seen_dots(observations);
        const test::MatchCounts counts = test::match(image.dots, seen);
        std::vector<test::TrueDot> facing;
        for (const test::TrueDot& dot : image.dots) {
            if (dot.expected) facing.push_back(dot);
        }
        frontal += test::match(facing, seen);
        std::printf("    %s %s: recall %.3f (of all visible %zu/%zu), precision %.3f, rms %.3f px\n",
                    image.name.c_str(), report.polarity == MarkerPolarity::kDark ? "dark" : "bright",
                    counts.recall(), counts.right, image.dots.size(), counts.precision(), counts.rms_px());
        EXPECT_EQ(report.polarity,
                  image.name == "f03101_c" ? MarkerPolarity::kBright : MarkerPolarity::kDark);
        EXPECT_EQ(report.faults, 0U);
        all += counts;
    }
    std::printf("    all: recall %.4f, precision %.4f, rms %.4f px; facing the camera rms %.4f px\n",
                all.recall(), all.precision(), all.rms_px(), frontal.rms_px());
    EXPECT_GE(all.recall(), 0.99);
    EXPECT_GE(all.precision(), 0.99);
    EXPECT_LE(all.rms_px(), 0.12);
    EXPECT_GE(all.rms_px(), 0.05);  // the noise of the images does not allow better
    EXPECT_LE(frontal.rms_px(), 0.085);
    EXPECT_GE(frontal.rms_px(), 0.04);
}

std::string name_of(const testing::TestParamInfo<Way>& way) {
    if (way.param == Way::kFirst) return "First";
    return way.param == Way::kSettled ? "Settled" : "Around";
}

INSTANTIATE_TEST_SUITE_P(Ways, SharedImages, testing::Values(Way::kFirst, Way::kSettled, Way::kAround),
                         name_of);

}  // namespace
