#include "firmware_host/companion/rig_folder/take_file.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/rig_folder/small_rig.hpp"

namespace rig::host {
namespace {

const std::vector<std::string> kShapes{"jawOpen", "browUp"};

TEST(Take, LoadsWhatItSaves) {
    const rig::test::TempFolder folder;
    Take take{.shape_names = kShapes, .rate_hz = 60.0, .frame_count = 100, .weights = {}};
    for (std::size_t i = 0; i < 200; ++i) take.weights.push_back(static_cast<float>(i % 11) / 16.0F);
    ASSERT_TRUE(save_take(folder / "t.csv", take));
    const auto back = load_take(folder / "t.csv", rig::test::small_rig());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->rate_hz, 60.0);
    EXPECT_EQ(back->frame_count, 100U);
    EXPECT_EQ(back->weights, take.weights);
}

TEST(Take, ColumnsComeInAnyOrderAndMissingShapesAreZero) {
    const auto take = parse_take("frame,time_s,browUp\n7,0.1,0.5\n8,0.2,1\n", "t.csv", kShapes);
    ASSERT_TRUE(take) << take.error().message;
    EXPECT_EQ(take->weights, (std::vector<float>{0, 0.5F, 0, 1}));
    EXPECT_DOUBLE_EQ(take->rate_hz, 10.0);
    const auto swapped = parse_take("frame,time_s,browUp,jawOpen\n0,0,0.5,0.25\n", "t.csv", kShapes);
    ASSERT_TRUE(swapped);
    EXPECT_EQ(swapped->weights, (std::vector<float>{0.25F, 0.5F}));
}

std::string frames_at(double rate_hz, int count) {
    std::string text = "frame,time_s,jawOpen\n";
    for (int i = 0; i < count; ++i) text += std::to_string(i) + "," + std::to_string(i / rate_hz) + ",0\n";
    return text;
}

TEST(Take, BroadcastRatesAreNotRoundedToWholeOnes) {
    const auto broadcast = parse_take(frames_at(60000.0 / 1001.0, 600), "t.csv", kShapes);
    ASSERT_TRUE(broadcast) << broadcast.error().message;
    EXPECT_NEAR(broadcast->rate_hz, 59.94006, 1e-4);
    const auto whole = parse_take(frames_at(30.0, 600), "t.csv", kShapes);
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->rate_hz, 30.0);
}

struct BadTake {
    std::string label;
    std::string text;
    std::string fault;
};

class MalformedTake : public testing::TestWithParam<BadTake> {};

TEST_P(MalformedTake, NamesFileAndFault) {
    const auto take = parse_take(GetParam().text, "bad.csv", kShapes);
    ASSERT_FALSE(take);
    EXPECT_NE(take.error().message.find("bad.csv"), std::string::npos) << take.error().message;
    EXPECT_NE(take.error().message.find(GetParam().fault), std::string::npos) << take.error().message;
}

const std::string kHead = "frame,time_s,jawOpen,browUp\n";

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedTake,
    testing::Values(BadTake{"empty", "", "empty"}, BadTake{"no_frames", kHead, "no frames"},
                    BadTake{"no_time", "frame,jawOpen\n0,1\n", "frame,time_s"},
                    BadTake{"no_weights", "frame,time_s\n0,0\n", "no column of weights"},
                    BadTake{"unknown_shape", "frame,time_s,earWiggle\n0,0,1\n", "no shape 'earWiggle'"},
                    BadTake{"twice", "frame,time_s,jawOpen,jawOpen\n0,0,1,1\n", "twice"},
                    BadTake{"cut_line", kHead + "0,0,1,1\n1,0.016667,1", "bad.csv:3"},
                    BadTake{"nan", kHead + "0,0,nan,1\n", "bad.csv:2"},
                    BadTake{"percent", kHead + "0,0,1000,1\n", "not a weight"},
                    BadTake{"frame_gap", kHead + "0,0,1,1\n2,0.016667,1,1\n", "bad.csv:3: column 'frame'"},
                    BadTake{"time_still", kHead + "0,0,1,1\n1,0,1,1\n", "does not rise"},
                    BadTake{"time_back", kHead + "0,1,1,1\n1,0,1,1\n", "does not rise"},
                    BadTake{"time_uneven", kHead + "0,0,1,1\n1,0.1,1,1\n2,0.9,1,1\n3,1,1,1\n", "even rate"}),
    [](const auto& row) { return row.param.label; });

}  // namespace
}  // namespace rig::host
