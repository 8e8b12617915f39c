#include "core/expose/exposure_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace {

using namespace rig;

bool has(const ExposureProposal& p, ExposureTrouble trouble) {
    return (p.trouble & static_cast<std::uint8_t>(trouble)) != 0;
}

ExposureControl control(const ExposureConfig& config) {
    ExposureControl result;
    EXPECT_TRUE(result.configure(config).has_value());
    return result;
}

LightReading markers_at(double level, double contrast = 100.0) {
    return {.brightest_level = level,
            .faintest_contrast = contrast,
            .marker_count = 40,
            .mean_luma = 0.4 * level,
            .saturated_fraction = 0.0};
}

// Steps until the proposal has not changed for twenty frames; `level_of` says what the camera then shows.
template <class LevelOf>
ExposureProposal settle(ExposureControl& control, LevelOf level_of) {
    ExposureProposal now = control.step(markers_at(0.0));
    int quiet = 0;
    for (int frame = 0; frame < 400 && quiet < 20; ++frame) {
        now = control.step(markers_at(level_of(now)));
        quiet = now.changed ? 0 : quiet + 1;
    }
    EXPECT_EQ(quiet, 20);
    return now;
}

double light_of(const ExposureProposal& p) {
    return p.exposure_us * std::pow(10.0, static_cast<double>(p.gain_db) / 20.0);
}

TEST(ExposureControl, TheFirstProposalIsWhatItStartsWith) {
    ExposureControl c = control({.start_exposure_us = 4000.0, .start_gain_db = 6.0});
    const ExposureProposal first = c.step({});
    EXPECT_TRUE(first.changed);
    EXPECT_EQ(first.exposure_us, 4000);
    EXPECT_NEAR(static_cast<double>(first.gain_db), 6.0, 1e-6);
}

TEST(ExposureControl, LightWithinTheBandIsLeftAlone) {
    for (const double level : {135.0, 165.0, 200.0}) {
        ExposureControl c = control({});
        static_cast<void>(c.step(markers_at(level)));
        for (int frame = 0; frame < 100; ++frame) EXPECT_FALSE(c.step(markers_at(level)).changed) << level;
    }
}

TEST(ExposureControl, WaitsForItsOwnChangeBeforeTheNext) {
    const ExposureConfig config{.settle_frames = 3, .window_frames = 3};
    ExposureControl c = control(config);
    static_cast<void>(c.step(markers_at(20.0)));
    int since = 0;
    for (int frame = 0; frame < 40; ++frame) {
        ++since;
        const bool changed = c.step(markers_at(20.0)).changed;
        if (changed) {
            EXPECT_GE(since, 6);
            since = 0;
        }
    }
}

TEST(ExposureControl, StepsAreBounded) {
    ExposureControl c = control({.largest_step = 1.5});
    ExposureProposal before = c.step(markers_at(3.0));
    for (int frame = 0; frame < 80; ++frame) {
        const ExposureProposal now = c.step(markers_at(frame < 40 ? 3.0 : 255.0));
        EXPECT_LE(light_of(now), light_of(before) * 1.5 * 1.001);
        EXPECT_GE(light_of(now) * 1.5 * 1.001, light_of(before));
        before = now;
    }
}

TEST(ExposureControl, ExposureComesBeforeGain) {
    // 0.02 grey levels per microsecond: the target needs 8150 us, the limit allows 4000.
    ExposureControl c = control({.blur_limit_us = 4000.0});
    const ExposureProposal p =
        settle(c, [](const ExposureProposal& now) { return std::min(255.0, 2.0 + 0.02 * light_of(now)); });
    EXPECT_EQ(p.exposure_us, 4000);
    EXPECT_NEAR(light_of(p), 8150.0, 8150.0 * 0.25);
    ExposureControl bright = control({});
    const ExposureProposal q = settle(
        bright, [](const ExposureProposal& now) { return std::min(255.0, 2.0 + 0.2 * light_of(now)); });
    EXPECT_EQ(q.gain_db, 0.0F);
    EXPECT_LT(q.exposure_us, 1100);
}

TEST(ExposureControl, WholeFlashesOfTheLampsWhereTheyFit) {
    ExposureConfig config{.longest_us = 33000.0, .blur_limit_us = 33000.0, .mains_hz = 50.0};
    ExposureControl c = control(config);
    const ExposureProposal p =
        settle(c, [](const ExposureProposal& now) { return std::min(255.0, 2.0 + 0.006 * light_of(now)); });
    EXPECT_EQ(p.exposure_us % 10000, 0);
    EXPECT_GE(p.exposure_us, 10000);
    EXPECT_FALSE(has(p, ExposureTrouble::kFlicker));
    config.blur_limit_us = 4000.0;
    ExposureControl fast = control(config);
    EXPECT_TRUE(has(fast.step({}), ExposureTrouble::kFlicker));
    config = {
        .longest_us = 20000.0, .blur_limit_us = 20000.0, .mains_hz = 60.0, .start_exposure_us = 16000.0};
    ExposureControl sixty = control(config);
    const ExposureProposal q = settle(
        sixty, [](const ExposureProposal& now) { return std::min(255.0, 2.0 + 0.01 * light_of(now)); });
    EXPECT_NEAR(q.exposure_us % 8333, 0, 1);
}

TEST(ExposureControl, SaysWhenTheLightIsOutOfReach) {
    ExposureControl dark = control({});
    const ExposureProposal p = settle(dark, [](const ExposureProposal&) { return 10.0; });
    EXPECT_TRUE(has(p, ExposureTrouble::kTooDark));
    EXPECT_EQ(p.faults, fault_bit(Fault::kExposure));
    EXPECT_EQ(p.exposure_us, 4000);
    EXPECT_NEAR(static_cast<double>(p.gain_db), 24.0, 1e-4);
    ExposureControl bright = control({});
    const ExposureProposal q = settle(bright, [](const ExposureProposal&) { return 255.0; });
    EXPECT_TRUE(has(q, ExposureTrouble::kTooBright));
    EXPECT_EQ(q.faults, fault_bit(Fault::kExposure));
    EXPECT_EQ(q.exposure_us, 20);
    EXPECT_EQ(q.gain_db, 0.0F);
}

TEST(ExposureControl, SaysWhenMarkersAreFaintInGoodLight) {
    ExposureControl c = control({});
    ExposureProposal p;
    for (int frame = 0; frame < 20; ++frame) p = c.step(markers_at(165.0, 9.0));
    EXPECT_TRUE(has(p, ExposureTrouble::kFaint));
    EXPECT_EQ(p.faults, 0U);
}

TEST(ExposureControl, WithoutMarkersThePictureLeads) {
    ExposureControl c = control({});
    ExposureProposal p = c.step({});
    for (int frame = 0; frame < 60; ++frame) p = c.step({.mean_luma = 3.0});
    EXPECT_TRUE(has(p, ExposureTrouble::kBlind));
    EXPECT_TRUE(has(p, ExposureTrouble::kTooDark));
    ExposureControl flooded = control({});
    p = flooded.step({});
    for (int frame = 0; frame < 60; ++frame)
        p = flooded.step({.mean_luma = 250.0, .saturated_fraction = 0.9});
    EXPECT_TRUE(has(p, ExposureTrouble::kTooBright));
}

TEST(ExposureControl, AFlashIsNoLight) {
    ExposureControl c = control({});
    static_cast<void>(c.step(markers_at(165.0)));
    for (int frame = 0; frame < 60; ++frame) {
        LightReading reading = markers_at(165.0);
        if (frame % 20 == 10) reading = {.mean_luma = 40.0};  // a frame in which nothing was found
        if (frame == 15 || frame == 37) reading = markers_at(250.0);
        EXPECT_FALSE(c.step(reading).changed) << frame;
    }
}

TEST(ExposureControl, StaysInARangeThatMainsAndWholeMicrosecondsMiss) {
    for (const double shortest_us : {20.7, 9000.0}) {
        ExposureConfig config;
        config.shortest_us = config.start_exposure_us = shortest_us;
        config.longest_us = config.blur_limit_us = 16000.0;
        config.mains_hz = 60.0;
        ExposureControl c = control(config);
        for (int frame = 0; frame < 40; ++frame) {
            EXPECT_GE(c.step(markers_at(frame < 20 ? 252.0 : 100.0)).exposure_us, shortest_us) << frame;
        }
    }
}

TEST(ExposureControl, RefusesWhatMakesNoSense) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    ExposureControl c;
    EXPECT_EQ(c.configure({.shortest_us = 0.0}).error(), ExposureError::kRange);
    EXPECT_EQ(c.configure({.longest_us = 10.0}).error(), ExposureError::kRange);
    EXPECT_EQ(c.configure({.most_gain_db = nan}).error(), ExposureError::kRange);
    EXPECT_EQ(c.configure({.start_exposure_us = 9000.0}).error(), ExposureError::kRange);
    EXPECT_EQ(c.configure({.target_level = 10.0}).error(), ExposureError::kTarget);
    EXPECT_EQ(c.configure({.band = 1.0}).error(), ExposureError::kTarget);
    EXPECT_EQ(c.configure({.largest_step = 1.1}).error(), ExposureError::kTarget);
    EXPECT_EQ(c.configure({.mains_hz = nan}).error(), ExposureError::kTiming);
    EXPECT_EQ(c.configure({.window_frames = 0}).error(), ExposureError::kTiming);
}

}  // namespace
