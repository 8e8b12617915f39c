#include "firmware_host/companion/links/head_csv.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

std::vector<std::string> lines_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
}

FaceState state_of(std::uint32_t sequence, std::int64_t capture_us, HeadStatus status) {
    FaceState state;
    state.sequence = sequence;
    state.head.status = status;
    state.head.capture_us = capture_us;
    if (status == HeadStatus::kKnown) {
        state.head.rotation_rad = {0.125F, -0.25F, 0.0F};
        state.head.translation_mm = {10.5F, -3.0F, 40.25F};
        state.head.rotation_sigma_rad = {0.001F, 0.001F, 0.002F};
        state.head.translation_sigma_mm = {0.25F, 0.25F, 0.5F};
        state.head.rms_px = 0.25F;
        state.head.points_used = 118;
    }
    return state;
}

TEST(HeadCsv, ARowAStateAndEmptyFieldsWhereNothingIsKnown) {
    const test::TempFolder folder;
    const auto path = folder / "take.head.csv";
    auto csv = HeadCsv::create(path);
    ASSERT_TRUE(csv.has_value()) << csv.error().message;
    ASSERT_TRUE(csv->add(state_of(0xFFFFFFFF, 5'000'000, HeadStatus::kTooFew)).has_value());
    ASSERT_TRUE(csv->add(state_of(0, 5'016'667, HeadStatus::kKnown)).has_value());
    ASSERT_TRUE(csv->add(state_of(1, 0, HeadStatus::kUnknown)).has_value());
    ASSERT_TRUE(csv->close().has_value());
    EXPECT_EQ(csv->row_count(), 3U);
    EXPECT_EQ(csv->known_count(), 1U);
    const std::vector<std::string> lines = lines_of(path);
    ASSERT_EQ(lines.size(), 4U);
    EXPECT_EQ(lines[1], "0,0.000000,too few markers,,,,,,,,,,,,,,");
    EXPECT_EQ(
        lines[2],
        "1,0.016667,known,0.125000,-0.250000,0.000000,10.500,-3.000,40.250,0.001000,0.001000,0.002000,0.250,"
        "0.250,0.500,0.250,118");
    EXPECT_EQ(lines[3], "2,,no face,,,,,,,,,,,,,,");
    for (const std::string& line : lines)
        EXPECT_EQ(std::ranges::count(line, ','), std::ranges::count(lines[0], ',')) << line;
}

TEST(HeadCsv, StandsBesideTheWeights) {
    EXPECT_EQ(head_csv_path("out/take.csv"), "out/take.head.csv");
    EXPECT_EQ(head_csv_path("take"), "take.head.csv");
    EXPECT_FALSE(HeadCsv::create("/dev/null/x.csv").has_value());
}

}  // namespace
}  // namespace rig::host
