// Exposure control in a closed loop with the detector: a drawn head behind a camera whose controls act two
// frames later, under light that changes. And alone, under readings of every kind.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "core/detect/detector.hpp"
#include "core/expose/exposure_control.hpp"
#include "tests/support/dot_scene/disc_scene.hpp"
#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

constexpr double kNominal_us = 2000.0;
constexpr int kLatency_frames = 2;
constexpr double kRate_hz = 60.0;

// Shot noise and read noise follow the gain as in a sensor: exposure buys signal, gain only numbers.
class SimulatedCamera {
  public:
    SimulatedCamera(test::LightField light, std::uint64_t seed) : light_(std::move(light)), random_(seed) {
        pending_.fill({kNominal_us, 0.0});
    }

    void set(const ExposureProposal& proposal) {
        pending_[kLatency_frames] = {static_cast<double>(proposal.exposure_us),
                                     static_cast<double>(proposal.gain_db)};
    }

    test::Picture take(double lamp) {
        const double gain = std::pow(10.0, pending_[0].gain_db / 20.0);
        const double scale = lamp * pending_[0].exposure_us / kNominal_us * gain;
        test::LightField field = light_;
        for (double& value : field.values) value = 2.0 + value * scale;
        test::Picture picture = test::digitise(field, 0.55 * gain, gain / 39.0, random_);
        for (std::size_t i = 0; i + 1 < pending_.size(); ++i) pending_[i] = pending_[i + 1];
        return picture;
    }

  private:
    struct Setting {
        double exposure_us = 0.0;
        double gain_db = 0.0;
    };
    test::LightField light_;
    SeededRandom random_;
    std::array<Setting, kLatency_frames + 1> pending_{};
};

class Loop {
  public:
    Loop(bool bright, std::uint64_t seed, const ExposureConfig& config) : camera_(head(bright, seed), seed) {
        DetectorConfig settings;
        settings.polarity = bright ? MarkerPolarity::kBright : MarkerPolarity::kDark;
        EXPECT_TRUE(detector_->configure(settings));
        EXPECT_TRUE(control_.configure(config));
    }

    void frame(double lamp) {
        const test::Picture picture = camera_.take(lamp);
        Observations observations;
        detector_->detect(picture.view(), observations, report);
        markers = observations.size();
        proposal =
            control_.step({report.brightest_level, report.faintest_contrast,
                           static_cast<std::uint16_t>(markers), report.mean_luma, report.saturated_fraction});
        if (proposal.changed) camera_.set(proposal);
    }

    DetectorReport report;
    ExposureProposal proposal;
    std::size_t markers = 0;

  private:
    static test::LightField head(bool bright, std::uint64_t seed) {
        test::DiscSceneConfig config;
        config.width_px = 320;
        config.height_px = 288;
        config.bright = bright;
        config.seed = seed;
        config.head_radius_mm = 60.0;
        config.focal_px = 450.0;
        return test::light_of(config).light;
    }

    std::unique_ptr<Detector> detector_ = std::make_unique<Detector>();
    ExposureControl control_;
    SimulatedCamera camera_;
};

bool has(const ExposureProposal& p, ExposureTrouble trouble) {
    return (p.trouble & static_cast<std::uint8_t>(trouble)) != 0;
}

TEST(ExposureLoop, LightStepsAreTakenBackWithinASecond) {
    for (const bool bright : {false, true}) {
        for (std::uint64_t seed = 1; seed <= 3; ++seed) {
            Loop loop(bright, seed, {});
            for (int i = 0; i < 60; ++i) loop.frame(1.0);
            const std::size_t usual = loop.markers;
            ASSERT_GT(usual, 25U);
            double lamp = 1.0;
            for (const double step : {4.0, 0.25, 0.25, 4.0}) {
                lamp *= step;
                int last_change = 0;
                for (int i = 0; i < 120; ++i) {
                    loop.frame(lamp);
                    if (loop.proposal.changed) last_change = i;
                }
                std::printf(
                    "    %-6s lamp x %.2f: last change after %.2f s, level %.0f, contrast %.0f, %d us, %.1f "
                    "dB\n",
                    bright ? "bright" : "dark", lamp, last_change / kRate_hz, loop.report.brightest_level,
                    loop.report.faintest_contrast, loop.proposal.exposure_us,
                    static_cast<double>(loop.proposal.gain_db));
                EXPECT_LE(last_change, 60) << "seed " << seed << ", lamp " << lamp;
                EXPECT_NEAR(loop.report.brightest_level, 165.0, 45.0);
                EXPECT_GE(loop.report.faintest_contrast, 20.0);
                EXPECT_LT(loop.report.saturated_fraction, 0.001);
                EXPECT_EQ(loop.proposal.faults, 0U);
                EXPECT_GE(loop.markers * 100, usual * 95);
            }
        }
    }
}

TEST(ExposureLoop, SteadyLightIsLeftAlone) {
    for (const bool bright : {false, true}) {
        for (const double lamp : {0.3, 0.55, 1.0, 1.7, 3.1}) {
            Loop loop(bright, 7, {});
            for (int i = 0; i < 90; ++i) loop.frame(lamp);
            int changes = 0;
            for (int i = 0; i < 120; ++i) {
                loop.frame(lamp);
                changes += loop.proposal.changed ? 1 : 0;
            }
            EXPECT_EQ(changes, 0) << lamp;
        }
    }
}

TEST(ExposureLoop, LightOutOfReachIsSaidAndForgottenWhenItReturns) {
    for (const bool bright : {false, true}) {
        Loop loop(bright, 9, {.shortest_us = 200.0, .most_gain_db = 12.0});
        for (int i = 0; i < 60; ++i) loop.frame(1.0);
        for (int i = 0; i < 90; ++i) loop.frame(0.01);
        EXPECT_TRUE(has(loop.proposal, ExposureTrouble::kTooDark));
        EXPECT_EQ(loop.proposal.faults, fault_bit(Fault::kExposure));
        for (int i = 0; i < 120; ++i) loop.frame(1.0);
        EXPECT_EQ(loop.proposal.faults, 0U);
        for (int i = 0; i < 90; ++i) loop.frame(100.0);
        EXPECT_TRUE(has(loop.proposal, ExposureTrouble::kTooBright));
        for (int i = 0; i < 120; ++i) loop.frame(1.0);
        EXPECT_EQ(loop.proposal.faults, 0U);
        EXPECT_GE(loop.report.faintest_contrast, 20.0);
    }
}

// A linear camera of any latency up to three frames, any light within reach: settles inside the band and
// stays there.
TEST(ExposureControlProperties, AnyLatencyAndAnyLightWithinReachSettle) {
    SeededRandom random(11);
    for (int round = 0; round < 400; ++round) {
        ExposureConfig config;
        config.blur_limit_us = random.uniform(500.0, 20000.0);
        config.start_exposure_us = random.uniform(20.0, std::min(config.blur_limit_us, config.longest_us));
        config.mains_hz = random.chance(0.3) ? 50.0 : 0.0;
        ExposureControl control;
        ASSERT_TRUE(control.configure(config));
        const double most =
            std::min(config.blur_limit_us, config.longest_us) * std::pow(10.0, config.most_gain_db / 20.0);
        // Grey levels per microsecond such that the target is within the range.
        const double sensitivity = 163.0 / std::exp(random.uniform(std::log(30.0), std::log(0.8 * most)));
        const auto latency = static_cast<std::size_t>(random.below(4));
        std::vector<double> sent(latency + 1, config.start_exposure_us);
        int last_change = 0;
        double level = 0.0;
        for (int frame = 0; frame < 200; ++frame) {
            level = std::min(255.0, 2.0 + sensitivity * sent[sent.size() - 1 - latency]);
            const ExposureProposal p = control.step(
                {level + random.uniform(-2.0, 2.0) < 0 ? 0.0 : level, 0.5 * level, 40, 0.4 * level, 0.0});
            sent.push_back(p.exposure_us * std::pow(10.0, static_cast<double>(p.gain_db) / 20.0));
            if (p.changed) last_change = frame;
        }
        EXPECT_LT(last_change, 120) << round;
        EXPECT_GE(level, 2.0 + 163.0 / 1.27) << round;
        EXPECT_LE(level, 2.0 + 163.0 * 1.27) << round;
    }
}

TEST(ExposureControlProperties, AnyReadingsGiveFiniteProposalsInRange) {
    SeededRandom random(12);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const auto wild = [&](double most) {
        switch (random.below(8)) {
            case 0:
                return kNan;
            case 1:
                return kInfinity;
            case 2:
                return -kInfinity;
            case 3:
                return -1e300;
            case 4:
                return 1e300;
            case 5:
                return 0.0;
            default:
                return random.uniform(0.0, most);
        }
    };
    for (int round = 0; round < 200; ++round) {
        ExposureConfig config;
        config.mains_hz = random.chance(0.5) ? 60.0 : 0.0;
        ExposureControl control;
        ASSERT_TRUE(control.configure(config));
        for (int frame = 0; frame < 300; ++frame) {
            const ExposureProposal p =
                control.step({wild(255.0), wild(255.0), static_cast<std::uint16_t>(random.below(100)),
                              wild(255.0), wild(1.0)});
            ASSERT_GE(p.exposure_us, 20);
            ASSERT_LE(p.exposure_us, 4000);
            ASSERT_GE(p.gain_db, 0.0F);
            ASSERT_LE(p.gain_db, 24.0F);
        }
    }
}

}  // namespace
