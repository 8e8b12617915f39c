#include "core/filter/smoothing.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>

#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SeededRandom;

constexpr std::int64_t kFrameUs = 16667;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kShapes = 3;
using Weights = std::array<double, kShapes>;

constexpr std::array<float, kShapes> kLow{0.0F, -1.0F, 0.0F};
constexpr std::array<float, kShapes> kHigh{1.0F, 1.0F, 0.5F};

struct Bench {
    explicit Bench(const FilterChoice& choice) { configure_smoothing(choice, 60.0, kLow, kHigh, *config); }
    Weights run(const Weights& x, std::int64_t at_us) {
        Weights out{};
        smooth(*config, x, at_us, *state, out, report);
        return out;
    }
    std::unique_ptr<SmoothingConfig> config = std::make_unique<SmoothingConfig>();
    std::unique_ptr<SmoothingState> state = std::make_unique<SmoothingState>();
    SmoothingReport report;
};

Weights random_weights(SeededRandom& random) {
    return {random.uniform(0.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(0.0, 0.5)};
}

TEST(Smoothing, IsOneEuroUnlessSomethingElseIsChosen) {
    SeededRandom random(21);
    Bench bench(FilterChoice{});
    OneEuroConfig config;
    config.low = kLow;
    config.high = kHigh;
    OneEuroState state;
    OneEuroReport report;
    for (int frame = 0; frame < 300; ++frame) {
        const Weights x = random_weights(random);
        Weights plain{};
        filter_one_euro(config, x, frame * kFrameUs, state, plain, report);
        ASSERT_EQ(bench.run(x, frame * kFrameUs), plain);
        ASSERT_EQ(bench.report.delay_us, 0);
        ASSERT_EQ(bench.report.answered_us, frame * kFrameUs);
    }
}

TEST(Smoothing, NoneHandsOn) {
    Bench bench(same_filter({FilterKind::kNone}, 0));
    EXPECT_EQ(bench.run({0.3, -0.4, 0.9}, 0), (Weights{0.3, -0.4, 0.5}));
    EXPECT_EQ(bench.run({kNan, 0.1, 0.2}, kFrameUs), (Weights{0.3, 0.1, 0.2}));
    EXPECT_EQ(bench.report.inputs_refused, 1);
}

// Each shape through its own filter; those without a window come as late as the one that has one.
TEST(Smoothing, ShapesOfAllKindsAreOfOneMoment) {
    SeededRandom random(22);
    FilterChoice choice;
    choice.delay_frames = 2;
    choice.shapes[0] = {FilterKind::kNone};
    choice.shapes[1] = {FilterKind::kOneEuro};
    choice.shapes[2] = {FilterKind::kSavitzkyGolay, 7};
    Bench mixed(choice);
    Bench calm(FilterChoice{});
    Bench fitted(same_filter({FilterKind::kSavitzkyGolay, 7}, 2));
    std::array<Weights, 100> in{};
    std::array<Weights, 100> calmed{};
    for (std::size_t frame = 0; frame < in.size(); ++frame) {
        const auto at = static_cast<std::int64_t>(frame) * kFrameUs;
        in[frame] = random_weights(random);
        calmed[frame] = calm.run(in[frame], at);
        const Weights got = mixed.run(in[frame], at);
        const std::size_t answered = frame < 2 ? 0 : frame - 2;
        ASSERT_EQ(got[0], in[answered][0]);
        ASSERT_EQ(got[1], calmed[answered][1]);
        ASSERT_EQ(got[2], fitted.run(in[frame], at)[2]);
        ASSERT_EQ(mixed.report.answered_us, static_cast<std::int64_t>(answered) * kFrameUs);
        ASSERT_EQ(mixed.report.delay_frames, frame - answered);
        ASSERT_EQ(mixed.report.delay_us, at - mixed.report.answered_us);
    }
}

TEST(Smoothing, ResetForgetsAll) {
    for (const FilterKind kind : {FilterKind::kNone, FilterKind::kOneEuro, FilterKind::kSavitzkyGolay}) {
        Bench used(same_filter({kind, 5}, 0));
        for (int frame = 0; frame < 9; ++frame) used.run({1.0, 1.0, 0.5}, frame * kFrameUs);
        reset_smoothing(*used.state);
        Bench fresh(same_filter({kind, 5}, 0));
        for (const Weights& x : {Weights{kNan, 0.2, 0.1}, Weights{0.5, 0.3, kNan}, Weights{0.0, 0.9, 0.2}}) {
            EXPECT_EQ(used.run(x, 200 * kFrameUs), fresh.run(x, 200 * kFrameUs));
            EXPECT_EQ(used.report.inputs_refused, fresh.report.inputs_refused);
        }
    }
}

TEST(Smoothing, RefusesChoicesOutsideTheirRanges) {
    EXPECT_TRUE(is_valid(FilterChoice{}, kMaxShapes));
    EXPECT_FALSE(is_valid(FilterChoice{}, kMaxShapes + 1));
    EXPECT_TRUE(is_valid(same_filter({FilterKind::kSavitzkyGolay, 61}, 60), 4));
    EXPECT_FALSE(is_valid(same_filter({FilterKind::kSavitzkyGolay, 2}, 0), 4));
    EXPECT_FALSE(is_valid(same_filter({FilterKind::kSavitzkyGolay, 62}, 0), 4));
    EXPECT_FALSE(is_valid(same_filter({FilterKind::kSavitzkyGolay, 7}, 7), 4));
    EXPECT_FALSE(is_valid(same_filter({FilterKind::kNone}, 61), 4));
    EXPECT_FALSE(is_valid(same_filter({static_cast<FilterKind>(3)}, 0), 4));
    FilterChoice beyond;
    beyond.shapes[4] = {FilterKind::kSavitzkyGolay, 0};
    EXPECT_TRUE(is_valid(beyond, 4)) << "the pack has no fifth shape";
    EXPECT_FALSE(is_valid(beyond, 5));
}

}  // namespace
}  // namespace rig
