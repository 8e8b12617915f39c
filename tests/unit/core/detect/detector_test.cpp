#include "core/detect/detector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"
#include "tests/support/random.hpp"

namespace {

using namespace rig;

class DetectorTest : public testing::Test {
  protected:
    void detect(const test::Picture& picture) { detector->detect(picture.view(), observations, report); }
    std::unique_ptr<Detector> detector = std::make_unique<Detector>();
    Observations observations;
    DetectorReport report;
};

test::Picture grey(int width, int height, std::uint8_t value) {
    return {
        width, height,
        std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value)};
}

TEST_F(DetectorTest, ConfigurationsOutOfRangeAreRefusedByName) {
    const auto error_of = [&](auto change) {
        DetectorConfig config;
        change(config);
        const auto result = detector->configure(config);
        return result ? -1 : static_cast<int>(result.error());
    };
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(error_of([](DetectorConfig&) {}), -1);
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.blob.max_diameter_px = kMaxDotDiameterPx + 1.0; }),
              static_cast<int>(DetectorError::kDiameters));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.blob.min_diameter_px = 40.0; }),
              static_cast<int>(DetectorError::kDiameters));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.blob.min_diameter_px = kNan; }),
              static_cast<int>(DetectorError::kDiameters));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.blob.min_contrast = 0.0; }),
              static_cast<int>(DetectorError::kContrast));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.relative_contrast = 1.0; }),
              static_cast<int>(DetectorError::kContrast));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.blob.max_open = 0.0; }),
              static_cast<int>(DetectorError::kShape));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.population.size_ratio = kNan; }),
              static_cast<int>(DetectorError::kShape));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.min_score = 1.5; }),
              static_cast<int>(DetectorError::kScore));
    EXPECT_EQ(error_of([](DetectorConfig& c) { c.luma_step = -1.0; }),
              static_cast<int>(DetectorError::kExposure));
}

TEST_F(DetectorTest, NoImageAndTooLargeAnImageAreReported) {
    detector->detect({}, observations, report);
    EXPECT_TRUE(report.unprocessable);
    std::uint8_t pixel = 0;
    detector->detect({.pixels = &pixel, .width_px = 5000, .height_px = 1, .stride_bytes = 5000}, observations,
                     report);
    EXPECT_TRUE(report.unprocessable);
    EXPECT_TRUE(observations.empty());
}

TEST_F(DetectorTest, EvenImagesHoldNothing) {
    for (const std::uint8_t value :
         {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{128}, std::uint8_t{254}, std::uint8_t{255}}) {
        detector->reset();
        detect(grey(640, 480, value));
        EXPECT_TRUE(observations.empty());
        EXPECT_EQ(report.mean_luma, value);
    }
}

TEST_F(DetectorTest, LightAtTheMarkersIsMeasuredForExposureControl) {
    for (const bool bright : {false, true}) {
        test::Scene scene = test::lattice_scene(12, 1.2, bright, 4);
        scene.light = {.skin = bright ? 50.0 : 150.0,
                       .gradient = 0.0,
                       .vignetting = 0.0,
                       .texture = 0.0,
                       .read_noise = 0.5,
                       .shot_noise = 0.0};
        for (test::SceneDot& dot : scene.dots) dot.paint = bright ? 3.0 : 0.2;
        const test::Picture picture = test::render(scene);
        detector->reset();
        detect(picture);
        EXPECT_NEAR(report.brightest_level, 150.0, 6.0) << bright;
        EXPECT_NEAR(report.faintest_contrast, bright ? 97.0 : 117.0, 8.0) << bright;
    }
    detect(grey(64, 64, 100));
    EXPECT_EQ(report.brightest_level, 0.0);
    EXPECT_EQ(report.faintest_contrast, 0.0);
}

TEST_F(DetectorTest, FaintMarkersOfADimImageAreFound) {
    for (const bool bright : {false, true}) {
        test::Scene scene = test::lattice_scene(12, 1.2, bright, 4);
        scene.light = {.skin = bright ? 4.0 : 12.0,
                       .gradient = 0.0,
                       .vignetting = 0.0,
                       .texture = 0.0,
                       .read_noise = 1.0,
                       .shot_noise = 0.0};
        for (test::SceneDot& dot : scene.dots) dot.paint = bright ? 2.8 : 0.35;  // 7 or 8 grey levels
        detector->reset();
        detect(test::render(scene));
        EXPECT_GE(observations.size(), scene.dots.size() * 98 / 100) << bright;
        EXPECT_LE(observations.size(), scene.dots.size()) << bright;
    }
}

TEST_F(DetectorTest, ExposureFlagsFollowTheCatalogue) {
    const auto flagged = [&](ExposureFlag flag) {
        return (report.exposure & static_cast<std::uint8_t>(flag)) != 0;
    };
    detect(grey(64, 64, 100));
    EXPECT_EQ(report.exposure, 0);
    EXPECT_EQ(report.faults, 0U);
    detect(grey(64, 64, 200));
    EXPECT_TRUE(flagged(ExposureFlag::kStep));
    EXPECT_EQ(report.faults, fault_bit(Fault::kExposure));
    int frames = 0;
    for (; frames < 20 && report.exposure != 0; ++frames) detect(grey(64, 64, 200));
    EXPECT_GE(frames, 1);
    EXPECT_LE(frames, 10);  // a lasting change becomes normal
    detect(grey(64, 64, 1));
    EXPECT_TRUE(flagged(ExposureFlag::kDark));
    detect(grey(64, 64, 255));
    EXPECT_TRUE(flagged(ExposureFlag::kFlooded));
}

TEST_F(DetectorTest, AutomaticPolarityIsDecidedInTheFirstImageAndCanChange) {
    const auto dark = test::render(test::lattice_scene(10, 2, false, 1));
    const auto bright = test::render(test::lattice_scene(10, 2, true, 2));
    detect(dark);
    EXPECT_EQ(report.polarity, MarkerPolarity::kDark);
    EXPECT_GT(observations.size(), 150U);
    detect(bright);
    EXPECT_EQ(report.polarity, MarkerPolarity::kBright);
    EXPECT_GT(observations.size(), 150U);
    detector->reset();
    detect(dark);
    EXPECT_EQ(report.polarity, MarkerPolarity::kDark);
}

TEST_F(DetectorTest, ASettledPolarityLooksAtOneSideAndComesBackWhenThatSideIsEmpty) {
    const auto dark = test::render(test::lattice_scene(10, 2, false, 1));
    const auto bright = test::render(test::lattice_scene(10, 2, true, 2));
    detect(dark);
    const std::uint32_t both = report.runs;
    for (int i = 0; i < 10; ++i) detect(dark);
    EXPECT_LT(report.runs, both);
    for (int i = 0; i < 3; ++i) detect(bright);
    EXPECT_EQ(report.polarity, MarkerPolarity::kBright);
    EXPECT_GT(observations.size(), 150U);
}

TEST_F(DetectorTest, TheSameImageGivesTheSameBytesWhateverWasSeenBefore) {
    const auto picture = test::render(test::lattice_scene(8, 2, false, 3));
    detect(picture);
    const Observations first = observations;
    const auto other = test::render(test::lattice_scene(14, 2, true, 4));
    detect(other);
    detector->reset();
    detect(picture);
    ASSERT_EQ(first.size(), observations.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        EXPECT_EQ(first[i].x_px, observations[i].x_px);
        EXPECT_EQ(first[i].y_px, observations[i].y_px);
        EXPECT_EQ(first[i].score, observations[i].score);
    }
}

TEST_F(DetectorTest, MoreMarkersThanRoomKeepsTheBestAndSaysSo) {
    test::Scene scene = test::lattice_scene(8, 1.2, false, 5);
    scene.dots.clear();
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 21; ++x) {
            scene.dots.push_back(
                {.x_px = 20.0 + 21 * x, .y_px = 20.0 + 21 * y, .long_px = 8, .short_px = 8, .paint = 0.2});
        }
    }
    detect(test::render(scene));
    EXPECT_EQ(observations.size(), kMaxObservations);
    EXPECT_TRUE(report.observations_full);
    EXPECT_GE(report.left_out, 336U - kMaxObservations - 10U);
    EXPECT_NE(report.faults & fault_bit(Fault::kBlobCapacity), 0U);
}

TEST_F(DetectorTest, NoiseThatFillsEveryTableIsReported) {
    test::Picture picture = grey(1920, 1200, 0);
    test::SeededRandom random(8);
    for (std::uint8_t& value : picture.pixels) value = static_cast<std::uint8_t>(random.bits());
    detect(picture);
    EXPECT_TRUE(report.runs_full);
    EXPECT_NE(report.faults & fault_bit(Fault::kBlobCapacity), 0U);
    EXPECT_LE(observations.size(), kMaxObservations);
}

}  // namespace
