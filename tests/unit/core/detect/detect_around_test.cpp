// Windows about predictions against the whole image: the same sightings, and the whole image where windows
// do not serve.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/detect/detector.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"
#include "tests/support/random.hpp"

namespace {

using namespace rig;

class DetectAroundTest : public testing::Test {
  protected:
    void configure(MarkerPolarity polarity) {
        DetectorConfig config;
        config.polarity = polarity;
        ASSERT_TRUE(detector->configure(config));
    }
    void show(const test::Scene& scene) {
        picture = test::render(scene);
        detector->detect(picture.view(), whole, report);
    }
    void look(const std::vector<ExpectedMarker>& expected) {
        detector->detect_around(picture.view(), expected, around, report);
    }
    std::unique_ptr<Detector> detector = std::make_unique<Detector>();
    test::Picture picture;
    Observations whole;
    Observations around;
    DetectorReport report;
};

std::vector<ExpectedMarker> expect(const test::Scene& scene, float off_px, float reach_px,
                                   std::uint64_t seed) {
    test::SeededRandom random(seed);
    std::vector<ExpectedMarker> expected;
    for (const test::SceneDot& dot : scene.dots) {
        const double turn = random.uniform(0.0, 6.283);
        expected.push_back({static_cast<float>(dot.x_px + static_cast<double>(off_px) * std::cos(turn)),
                            static_cast<float>(dot.y_px + static_cast<double>(off_px) * std::sin(turn)),
                            reach_px});
    }
    return expected;
}

std::vector<test::TrueDot> truth_of(const test::Scene& scene) {
    std::vector<test::TrueDot> dots;
    for (const test::SceneDot& dot : scene.dots) dots.push_back({dot.x_px, dot.y_px});
    return dots;
}

TEST_F(DetectAroundTest, FindsWhatTheWholeImageShows) {
    for (const bool bright : {false, true}) {
        for (std::uint64_t seed = 1; seed <= 6; ++seed) {
            configure(bright ? MarkerPolarity::kBright : MarkerPolarity::kDark);
            test::Scene scene = test::lattice_scene(10.0, 2.2, bright, seed);
            scene.clutter = {.lines = 4, .hairs = 4, .patches = 2, .shadows = 2, .silhouette = true};
            show(scene);
            detector->detect(picture.view(), whole, report);
            const auto counts = test::match(truth_of(scene), test::seen_dots(whole));
            look(expect(scene, 4.0F, 8.0F, seed));
            const auto near = test::match(truth_of(scene), test::seen_dots(around));
            EXPECT_FALSE(report.whole_image);
            EXPECT_GE(near.expected_found + 1, counts.expected_found) << "seed " << seed;
            EXPECT_GE(near.precision(), 0.99) << "seed " << seed;
            EXPECT_LE(near.rms_px(), counts.rms_px() + 0.01) << "seed " << seed;
        }
    }
}

TEST_F(DetectAroundTest, CentresAreTheSameToTheBitOnCleanSkin) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 1.5, false, 3);
    show(scene);
    detector->detect(picture.view(), whole, report);  // at the scale of its markers
    look(expect(scene, 3.0F, 8.0F, 4));
    ASSERT_FALSE(report.whole_image);
    std::size_t same = 0;
    for (const Observation& a : around) {
        for (const Observation& b : whole) same += a.x_px == b.x_px && a.y_px == b.y_px ? 1U : 0U;
    }
    EXPECT_EQ(same, around.size());
    EXPECT_EQ(around.size(), whole.size());
}

// A lamp goes out: contrasts are small in the same frame in which the light is.
TEST_F(DetectAroundTest, TheFrameInWhichTheLightFallsIsJudgedByItsOwnLight) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 2.2, false, 3);
    for (int frame = 0; frame < 3; ++frame) show(scene);
    for (std::uint8_t& value : picture.pixels) value = static_cast<std::uint8_t>(value / 8 + 1);
    look(expect(scene, 2.0F, 8.0F, 3));
    EXPECT_FALSE(report.whole_image);
    const double at_once = test::match(truth_of(scene), test::seen_dots(around)).recall();
    look(expect(scene, 2.0F, 8.0F, 3));  // now the light was known before
    const double known = test::match(truth_of(scene), test::seen_dots(around)).recall();
    EXPECT_GE(known, 0.8);
    EXPECT_GE(at_once, known - 0.01);
    // What falls back to the whole image has measured its light once.
    const double luma = report.mean_luma;
    look({{100.0F, 100.0F, 8.0F, true}, {200.0F, 100.0F, 8.0F, true}});
    EXPECT_TRUE(report.whole_image);
    EXPECT_EQ(report.mean_luma, luma);
}

TEST_F(DetectAroundTest, OverlappingWindowsReportAMarkerOnce) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 1.5, false, 5);
    show(scene);
    std::vector<ExpectedMarker> expected = expect(scene, 1.0F, 24.0F, 6);
    expected.insert(expected.end(), expected.begin(), expected.begin() + 20);
    look(expected);
    ASSERT_FALSE(report.whole_image);
    EXPECT_LE(around.size(), scene.dots.size());
}

TEST_F(DetectAroundTest, LooksAtTheWholeImageWhenItKnowsTooLittleOrMissesTooMuch) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 1.5, false, 7);
    picture = test::render(scene);
    look(expect(scene, 0.0F, 8.0F, 1));
    EXPECT_TRUE(report.whole_image) << "no size is known yet";
    look(expect(scene, 0.0F, 8.0F, 1));
    EXPECT_FALSE(report.whole_image);
    look({});
    EXPECT_TRUE(report.whole_image) << "nothing is expected";
    look(expect(scene, 15.0F, 4.0F, 1));
    EXPECT_TRUE(report.whole_image) << "nothing is where it is expected";
    EXPECT_GE(around.size(), scene.dots.size() - 2);
    detector->forget_size();
    look(expect(scene, 0.0F, 8.0F, 1));
    EXPECT_TRUE(report.whole_image) << "the size was forgotten";
}

TEST_F(DetectAroundTest, MarkersThatNeedNotBeThereAreNotMissed) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 1.5, false, 8);
    show(scene);
    std::vector<ExpectedMarker> expected = expect(scene, 1.0F, 6.0F, 2);
    const std::size_t there = expected.size();
    for (std::size_t i = 0; i < 2 * there; ++i) expected.push_back({5.0F, 5.0F, 2.0F, false});
    look(expected);
    EXPECT_FALSE(report.whole_image);
}

// Dots far apart, so that sizes are known, and what each test adds.
test::Scene sparse_scene() {
    test::Scene scene;
    scene.width_px = 640;
    scene.height_px = 560;
    scene.light = {.skin = 140.0, .gradient = 0.0, .vignetting = 0.0, .texture = 0.0};
    for (int i = 0; i < 24; ++i) scene.dots.push_back({60.0 + 100.0 * (i % 6), 60.0 + 80.0 * (i / 6)});
    return scene;
}

TEST_F(DetectAroundTest, TouchingMarkersAreCutWhicheverWindowComesFirst) {
    configure(MarkerPolarity::kDark);
    test::Scene scene = sparse_scene();
    for (const double x : {200.0, 217.0, 227.5}) scene.dots.push_back({x, 500.0});
    show(scene);
    detector->detect(picture.view(), whole, report);
    std::vector<ExpectedMarker> expected = expect(scene, 0.0F, 14.0F, 1);
    for (int order = 0; order < 2; ++order) {
        look(expected);
        EXPECT_FALSE(report.whole_image);
        EXPECT_EQ(around.size(), whole.size()) << "order " << order;
        std::reverse(expected.begin(), expected.end());
    }
}

TEST_F(DetectAroundTest, AnEmptyWindowBesideAMarkerDoesNotSpoilIt) {
    configure(MarkerPolarity::kDark);
    for (const double dx : {-29.0, -28.0, -27.0, -25.0, 25.0, 28.0, 29.0}) {
        test::Scene scene = sparse_scene();
        scene.dots.push_back({300.0 + dx, 500.0, 12.0, 12.0});
        show(scene);
        detector->detect(picture.view(), whole, report);
        std::vector<ExpectedMarker> expected = expect(scene, 0.0F, 6.0F, 1);
        expected.insert(expected.begin(), {300.0F, 500.0F, 24.0F, false});
        look(expected);
        ASSERT_FALSE(report.whole_image);
        const auto counts = test::match(truth_of(scene), test::seen_dots(around));
        EXPECT_EQ(counts.expected_found, scene.dots.size()) << dx;
        EXPECT_LT(counts.largest_error_px, 0.3) << dx;
    }
}

TEST_F(DetectAroundTest, AWindowFullOfCrumbsIsLeftToTheWholeImage) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = sparse_scene();
    show(scene);
    for (std::size_t y = 480; y < 540; y += 2) {
        for (std::size_t x = 280; x < 340; x += 2) picture.pixels[y * 640 + x] = 0;
    }
    std::vector<ExpectedMarker> expected = expect(scene, 0.0F, 6.0F, 1);
    expected.push_back({310.0F, 510.0F, 24.0F, false});
    look(expected);
    EXPECT_TRUE(report.whole_image);
    EXPECT_GE(around.size(), scene.dots.size());
}

TEST_F(DetectAroundTest, PredictionsMayBeAnything) {
    configure(MarkerPolarity::kDark);
    const test::Scene scene = test::lattice_scene(10.0, 1.5, false, 9);
    show(scene);
    std::vector<ExpectedMarker> expected = expect(scene, 1.0F, 6.0F, 2);
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (const float bad : {kNan, kInfinity, -kInfinity, 1e9F, -1e9F, -50.0F, 9000.0F}) {
        expected.push_back({bad, 10.0F, 6.0F, false});
        expected.push_back({10.0F, bad, 6.0F, false});
        expected.push_back({10.0F, 10.0F, bad, false});
    }
    look(expected);
    EXPECT_FALSE(report.whole_image);
    EXPECT_GE(around.size(), scene.dots.size() - 2);
    picture.width_px = 0;
    look(expected);
    EXPECT_TRUE(report.unprocessable);
    EXPECT_EQ(around.size(), 0U);
}

}  // namespace
