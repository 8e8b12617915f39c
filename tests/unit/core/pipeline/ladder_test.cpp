#include "core/pipeline/ladder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

namespace rig {
namespace {

// One letter a tick: u usable, p usable but partial, . nothing usable, x no pack.
class LadderRun {
  public:
    explicit LadderRun(double rate_hz, std::int64_t start_us = 0) : start_us_(start_us) {
        config_.rate_hz = rate_hz;
    }

    // The states after each tick, as letters: S H L P and V for LIVE.
    std::string ticks(std::string_view input) {
        std::string states;
        for (const char c : input) {
            LadderInput tick;
            tick.now_us = start_us_ + std::llround(static_cast<double>(count_++) * 1e6 / config_.rate_hz);
            tick.configured = c != 'x';
            tick.usable = c == 'u' || c == 'p';
            tick.partial = c == 'p';
            step_ladder(config_, tick, state_);
            states += "SLHPV"[static_cast<std::size_t>(state_.state)];
        }
        return states;
    }
    std::string repeated(char c, int count) { return ticks(std::string(static_cast<std::size_t>(count), c)); }
    LadderState& state() { return state_; }

  private:
    LadderConfig config_;
    LadderState state_;
    std::int64_t start_us_;
    std::int64_t count_ = 0;
};

struct Row {
    const char* what;
    const char* input;
    const char* states;
};

// reliability.md 2a, at 60 Hz: three frames = 50 ms.
constexpr Row kTable[] = {
    {"no pack is SAFE", "xxx", "SSS"},
    {"start-up: SAFE, HOLD, LIVE after 5 good frames", "xuuuuuu", "SHHHHVV"},
    {"a bad frame starts the count anew", "uuuu.uuuuuu", "HHHHHHHHHVV"},
    {"one or two missing frames are ridden out", "uuuuu.u..uu", "HHHHVVVVVVV"},
    {"HOLD at the third missing frame", "uuuuu....", "HHHHVVVHH"},
    {"HOLD: 1 usable frame starts the count, 5 end it", "uuuuu...uuuuuu", "HHHHVVVHHHHHVV"},
    {"PARTIAL at once, out of it after 5 whole frames", "uuuuupuuuuuu", "HHHHVPPPPPVV"},
    {"a partial frame starts that count anew", "uuuuupuuuupuuuuu", "HHHHVPPPPPPPPPPV"},
    {"a missing frame does as well", "uuuuupuuuu.uuuuu", "HHHHVPPPPPPPPPPV"},
    {"HOLD to PARTIAL when the frames are partial", "pppppp", "HHHHPP"},
    {"one whole frame after four partial ones is not LIVE", "ppppuuuuu", "HHHHPPPPV"},
    {"whole frames first, a partial fifth", "uuuupuuuuu", "HHHHPPPPPV"},
    {"PARTIAL falls to HOLD too", "ppppp...", "HHHHPPPH"},
    {"losing the pack is SAFE at once, and all is counted anew", "uuuuuxuuuuu", "HHHHVSHHHHV"},
};

TEST(Ladder, EveryTransitionOfTheTable) {
    for (const Row& row : kTable) EXPECT_EQ(LadderRun(60.0).ticks(row.input), row.states) << row.what;
}

struct Rate {
    double rate_hz;
    int hold_after;  // missing frames: max(3 frames, 40 ms)
    int lost_after;  // missing frames: 300 ms
};

class LadderTimes : public testing::TestWithParam<Rate> {};

TEST_P(LadderTimes, HoldAndLostComeInTime) {
    const Rate& rate = GetParam();
    LadderRun run(rate.rate_hz);
    EXPECT_EQ(run.repeated('u', 6).back(), 'V');
    std::string states = run.repeated('.', rate.lost_after + 3);
    const auto hold = static_cast<int>(states.find('H')) + 1;
    const auto lost = static_cast<int>(states.find('L')) + 1;
    EXPECT_EQ(hold, rate.hold_after);
    EXPECT_EQ(lost, rate.lost_after);
    EXPECT_EQ(states.find_first_not_of('L', static_cast<std::size_t>(lost) - 1), std::string::npos)
        << "LOST stays";
    EXPECT_EQ(run.ticks("uuuuu"), "HHHHV") << "LOST goes through HOLD";
}

TEST_P(LadderTimes, AFaceNeverSeenIsLostInTimeToo) {
    LadderRun run(GetParam().rate_hz);
    const std::string states = run.repeated('.', GetParam().lost_after + 3);
    EXPECT_EQ(static_cast<int>(states.find('L')), GetParam().lost_after);
}

TEST_P(LadderTimes, NoFlickerBetweenUsableAndNot) {
    // Every second frame usable: never 5 in a row, never silent for long. From HOLD it never climbs, from
    // LIVE it never falls.
    LadderRun up(GetParam().rate_hz);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(up.ticks("u."), "HH");
    LadderRun down(GetParam().rate_hz);
    down.repeated('u', 5);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(down.ticks(".u"), "VV");
}

INSTANTIATE_TEST_SUITE_P(Rates, LadderTimes,
                         testing::Values(Rate{60.0, 3, 18}, Rate{120.0, 5, 36}, Rate{30.0, 3, 9}));

TEST(Ladder, CountersDoNotWrap) {
    LadderRun run(60.0);
    const std::string states = run.repeated('u', 200'000);
    EXPECT_EQ(states.find_first_not_of('V', 4), std::string::npos);
    LadderRun partial(60.0);
    const std::string p = partial.repeated('p', 140'000);
    EXPECT_EQ(p.find_first_not_of('P', 4), std::string::npos);
    EXPECT_EQ(partial.ticks("uuuuu"), "PPPPV");
}

TEST(Ladder, ClocksNearTheEndsOfTheirRange) {
    for (const std::int64_t start : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-100'000},
                                     std::numeric_limits<std::int64_t>::max() - 2'000'000}) {
        LadderRun run(60.0, start);
        EXPECT_EQ(run.ticks("uuuuu...."), "HHHHVVVHH");
        EXPECT_EQ(run.repeated('.', 15).back(), 'L');
    }
}

// A clock that jumps back by an hour does not leave a stale LIVE for an hour.
TEST(Ladder, ClockThatGoesBackCountsFromThere) {
    LadderConfig config;
    LadderState state;
    std::int64_t now = 4'000'000'000;
    const auto tick = [&](bool usable) {
        now += 16'667;
        step_ladder(config, {now, true, usable, false}, state);
        return state.state;
    };
    for (int i = 0; i < 6; ++i) tick(true);
    now -= 3'600'000'000;
    for (int i = 0; i < 30; ++i) tick(false);
    EXPECT_EQ(state.state, TrackingState::kLost);
    now = std::numeric_limits<std::int64_t>::min();
    for (int i = 0; i < 6; ++i) tick(true);
    EXPECT_EQ(state.state, TrackingState::kLive);
    step_ladder(config, {std::numeric_limits<std::int64_t>::max(), true, false, false}, state);
    EXPECT_EQ(state.state, TrackingState::kLost);
}

}  // namespace
}  // namespace rig
