// What holds for every image: shifts, inversion, agreement with plain arithmetic, and that no bytes do harm.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/detect/detector.hpp"
#include "tests/property/core/detect/plain_measure.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"
#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

struct Seen {
    Observations observations;
    DetectorReport report;
};

Seen detect(const test::Picture& picture, MarkerPolarity polarity = MarkerPolarity::kAuto) {
    const auto detector = std::make_unique<Detector>();
    DetectorConfig config;
    config.polarity = polarity;
    EXPECT_TRUE(detector->configure(config));
    Seen seen;
    detector->detect(picture.view(), seen.observations, seen.report);
    return seen;
}

// Nearest observation, or none within `reach`.
const Observation* near(const Observations& all, double x, double y, double reach) {
    const Observation* best = nullptr;
    for (const Observation& o : all) {
        const double distance = std::hypot(static_cast<double>(o.x_px) - x, static_cast<double>(o.y_px) - y);
        if (distance > reach) continue;
        best = &o;
        reach = distance;
    }
    return best;
}

// The block grid of the background moves with the image for shifts by whole blocks: then every bit is the
// same.
TEST(DetectProperties, ShiftsByWholeBlocksMoveEveryMarkerExactly) {
    for (const bool bright : {false, true}) {
        const auto picture = test::render(test::lattice_scene(10, 2.2, bright, 21));
        const Seen before = detect(picture);
        const Seen after = detect(test::shifted(picture, 8, -4));
        int compared = 0;
        for (const Observation& o : before.observations) {
            const auto x = static_cast<double>(o.x_px);
            const auto y = static_cast<double>(o.y_px);
            if (x < 60 || y < 60 || x > picture.width_px - 60 || y > picture.height_px - 60) continue;
            const Observation* same = near(after.observations, x + 8, y - 4, 0.01);
            ASSERT_NE(same, nullptr) << x << " " << y;
            EXPECT_NEAR(static_cast<double>(same->x_px), x + 8,
                        1e-4);  // a float's rounding at another position
            EXPECT_NEAR(static_cast<double>(same->y_px), y - 4, 1e-4);
            EXPECT_EQ(same->contrast, o.contrast);
            ++compared;
        }
        EXPECT_GT(compared, 60);
    }
}

// Other whole-pixel shifts change which candidates are cut where, and so little else.
TEST(DetectProperties, ShiftsByAnyWholePixelsMoveEveryMarkerAlmostExactly) {
    const auto picture = test::render(test::lattice_scene(8, 2.0, false, 22));
    const Seen before = detect(picture);
    for (int dx = 0; dx < 4; ++dx) {
        const Seen after = detect(test::shifted(picture, dx, 3 - dx));
        std::size_t compared = 0;
        std::size_t moved = 0;
        for (const Observation& o : before.observations) {
            const auto x = static_cast<double>(o.x_px);
            const auto y = static_cast<double>(o.y_px);
            if (x < 40 || y < 40 || x > picture.width_px - 40 || y > picture.height_px - 40) continue;
            const Observation* same = near(after.observations, x + dx, y + 3 - dx, 1.0);
            ASSERT_NE(same, nullptr) << x << " " << y;
            ++compared;
            moved += std::hypot(static_cast<double>(same->x_px) - x - dx,
                                static_cast<double>(same->y_px) - y - 3 + dx) > 0.02
                         ? 1
                         : 0;
        }
        EXPECT_GT(compared, 80U);
        EXPECT_LE(moved * 20, compared);
    }
}

// Inverting the picture and the polarity keeps the markers; light, which is no longer light, moves them
// little.
TEST(DetectProperties, InversionKeepsTheMarkers) {
    for (const bool bright : {false, true}) {
        test::Scene scene = test::lattice_scene(12, 1.8, bright, 23);
        if (bright) {
            scene.light.skin = 90.0;
            for (test::SceneDot& dot : scene.dots) dot.paint = 2.2;
        }
        const auto picture = test::render(scene);
        const Seen as_is = detect(picture, bright ? MarkerPolarity::kBright : MarkerPolarity::kDark);
        const Seen turned =
            detect(test::inverted(picture), bright ? MarkerPolarity::kDark : MarkerPolarity::kBright);
        std::size_t kept = 0;
        for (const Observation& o : as_is.observations) {
            kept += near(turned.observations, static_cast<double>(o.x_px), static_cast<double>(o.y_px),
                         0.3) != nullptr
                        ? 1
                        : 0;
        }
        EXPECT_GE(as_is.observations.size(), 100U);
        EXPECT_GE(kept * 100, as_is.observations.size() * 95);
    }
}

TEST(DetectProperties, CentresAgreeWithThePlainMeasurement) {
    double square = 0.0;
    std::size_t count = 0;
    for (std::uint64_t seed = 30; seed < 36; ++seed) {
        const double diameter = 6.0 + 2.0 * static_cast<double>(seed - 30);
        const test::Scene scene = test::lattice_scene(diameter, 1.5, false, seed);
        const auto picture = test::render(scene);
        const Seen seen = detect(picture);
        for (const test::SceneDot& dot : scene.dots) {
            const Observation* o = near(seen.observations, dot.x_px, dot.y_px, 1.0);
            if (o == nullptr) continue;
            const auto plain = test::plain_centre(picture, static_cast<double>(o->x_px),
                                                  static_cast<double>(o->y_px), dot.long_px);
            if (!plain.ok) continue;
            const double difference = std::hypot(plain.x_px - static_cast<double>(o->x_px),
                                                 plain.y_px - static_cast<double>(o->y_px));
            EXPECT_LT(difference, 0.35) << diameter << " at " << dot.x_px << " " << dot.y_px;
            square += difference * difference;
            ++count;
        }
    }
    ASSERT_GT(count, 350U);
    const double rms = std::sqrt(square / static_cast<double>(count));
    EXPECT_LT(rms, 0.05);   // ring and region differ in shape, not in kind
    EXPECT_GT(rms, 0.001);  // two programs, not one
}

TEST(DetectProperties, NoBytesOfAnySizeDoHarm) {
    SeededRandom random(24);
    const auto detector = std::make_unique<Detector>();
    Observations observations;
    DetectorReport report;
    std::vector<std::uint8_t> bytes;
    for (int round = 0; round < 300; ++round) {
        const int width = 1 + static_cast<int>(random.below(random.chance(0.05) ? kMaxImageWidth : 160));
        const int height = 1 + static_cast<int>(random.below(random.chance(0.05) ? kMaxImageHeight : 120));
        const int stride = width + static_cast<int>(random.below(9));
        bytes.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height - 1) +
                         static_cast<std::size_t>(width),
                     0);
        const std::uint64_t kind = random.below(4);
        std::uint8_t level = static_cast<std::uint8_t>(random.bits());
        for (std::uint8_t& byte : bytes) {
            if (kind == 0) byte = static_cast<std::uint8_t>(random.bits());
            if (kind == 1) byte = random.chance(0.1) ? 255 : 0;
            if (kind == 2)
                byte = level = static_cast<std::uint8_t>(level + (random.chance(0.02) ? random.bits() : 0));
            if (kind == 3) byte = static_cast<std::uint8_t>(100 + random.below(6));
        }
        detector->detect(
            {.pixels = bytes.data(), .width_px = width, .height_px = height, .stride_bytes = stride},
            observations, report);
        ASSERT_FALSE(report.unprocessable);
        for (const Observation& o : observations) {
            ASSERT_TRUE(o.x_px >= 0.0F && o.x_px <= static_cast<float>(width - 1));
            ASSERT_TRUE(o.y_px >= 0.0F && o.y_px <= static_cast<float>(height - 1));
            ASSERT_TRUE(o.diameter_px > 0.0F && o.diameter_px <= static_cast<float>(kMaxDotDiameterPx));
            ASSERT_TRUE(o.contrast >= 0.0F && o.contrast <= 1.0F);
            ASSERT_TRUE(o.score >= 0.0F && o.score <= 1.0F);
        }
    }
}

}  // namespace
