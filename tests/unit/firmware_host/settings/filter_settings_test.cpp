#include "firmware_host/settings/filter_table.hpp"

#include <gtest/gtest.h>

#include <array>

namespace rig {
namespace {

constexpr std::array<std::string_view, 4> kNames{"browDown_L", "eyeBlink_L", "jawOpen", "mouthSmile_L"};

// The fault, or "".
std::string read(std::string_view text, FilterSettings& into) {
    const toml::parse_result parsed = toml::parse(text);
    EXPECT_TRUE(parsed.succeeded());
    return read_filter_settings(parsed.table(), into);
}

std::string fault_of(std::string_view text) {
    FilterSettings settings;
    if (const std::string fault = read(text, settings); !fault.empty()) return fault;
    const auto choice = filter_choice(settings, kNames);
    return choice ? "" : choice.error();
}

TEST(FilterSettings, NothingSaidIsOneEuro) {
    EXPECT_EQ(filter_choice({}, kNames).value(), FilterChoice{});
}

TEST(FilterSettings, WindowAndDelay) {
    FilterSettings settings;
    ASSERT_EQ(read("filter = 'savitzky-golay'\nwindow = 21\ndelay = 4\n", settings), "");
    const FilterChoice choice = filter_choice(settings, kNames).value();
    EXPECT_EQ(choice.delay_frames, 4);
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_EQ(choice.shapes[i], (ShapeFilter{FilterKind::kSavitzkyGolay, 21}));
    settings.delay_frames.reset();
    EXPECT_EQ(filter_choice(settings, kNames)->delay_frames, 10) << "the middle";
}

TEST(FilterSettings, ExceptionsByRegionAndName) {
    FilterSettings settings;
    ASSERT_EQ(read("filter = 'savitzky-golay'\n[shapes]\nlids = 'one-euro'\njawOpen = 'savitzky-golay:9'\n"
                   "browDown_L = 'none'\n",
                   settings),
              "");
    const FilterChoice choice = filter_choice(settings, kNames).value();
    EXPECT_EQ(choice.shapes[0].kind, FilterKind::kNone);
    EXPECT_EQ(choice.shapes[1].kind, FilterKind::kOneEuro);
    EXPECT_EQ(choice.shapes[2], (ShapeFilter{FilterKind::kSavitzkyGolay, 9}));
    EXPECT_EQ(choice.shapes[3], (ShapeFilter{FilterKind::kSavitzkyGolay, 15}));
    EXPECT_EQ(choice.delay_frames, 4) << "the middle of the narrowest window";
}

TEST(FilterSettings, RefusesWithASentence) {
    EXPECT_NE(fault_of("filter = 'median'"), "");
    EXPECT_NE(fault_of("colour = 3"), "");
    EXPECT_NE(fault_of("filter = 'savitzky-golay'\nwindow = 62"), "");
    EXPECT_NE(fault_of("filter = 'savitzky-golay'\nwindow = 2"), "");
    EXPECT_NE(fault_of("filter = 'savitzky-golay'\nwindow = 7\ndelay = 7"), "");
    EXPECT_NE(fault_of("window = 'wide'"), "");
    EXPECT_NE(fault_of("window = 9"), "") << "one-euro has no window";
    EXPECT_NE(fault_of("[shapes]\nears = 'none'"), "");
    EXPECT_NE(fault_of("[shapes]\njaw = 3"), "");
    for (const char* bad :
         {"median", "one-euro:5", "savitzky-golay:", "savitzky-golay:2", "savitzky-golay:9x"})
        EXPECT_NE(fault_of("[shapes]\njaw = '" + std::string(bad) + "'"), "") << bad;
    EXPECT_EQ(fault_of("[shapes]\njaw = 'savitzky-golay:5'"), "");
}

TEST(FilterSettings, WhatIsSaidLaterReplaces) {
    FilterSettings board;
    board.kind = FilterKind::kSavitzkyGolay;
    board.window_frames = 31;
    board.shapes = {{"lids", "none"}};
    FilterSettings line;
    line.delay_frames = 2;
    EXPECT_EQ(filter_choice(merged(board, line), kNames)->delay_frames, 2);
    EXPECT_EQ(filter_choice(merged(board, line), kNames)->shapes[1].kind, FilterKind::kNone);
    EXPECT_FALSE(smooths_nothing(board));
    FilterSettings other;
    other.kind = FilterKind::kNone;
    EXPECT_TRUE(smooths_nothing(merged(board, other)));
    other.shapes = {{"jaw", "one-euro"}};
    EXPECT_FALSE(smooths_nothing(other));
    other.shapes.clear();
    other.kind = FilterKind::kOneEuro;
    EXPECT_EQ(filter_choice(merged(board, other), kNames).value(), FilterChoice{});
}

}  // namespace
}  // namespace rig
