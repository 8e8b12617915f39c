#include "firmware_host/companion/links/weights_csv.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/temp_folder.hpp"

namespace {

using namespace rig;
using host::WeightsCsv;

FaceState state_of(std::uint32_t sequence, std::int64_t capture_us, float weight) {
    FaceState state;
    state.sequence = sequence;
    state.capture_us = capture_us;
    state.shape_count = 2;
    state.weights = {weight, -weight};
    return state;
}

std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(WeightsCsv, RowsCountFromTheFirstState) {
    const test::TempFolder folder;
    auto csv = WeightsCsv::create(folder / "w.csv", {"jawOpen", "a,b\" "});
    ASSERT_TRUE(csv.has_value());
    EXPECT_TRUE(csv->add(state_of(0xFFFFFFFFU, 5'000'000, 0.5F)).value());
    EXPECT_TRUE(csv->add(state_of(1, 5'033'333, 0.25F)).value()) << "over the wrap, one lost";
    FaceState other = state_of(2, 5'050'000, 0.25F);
    other.shape_count = 3;
    EXPECT_FALSE(csv->add(other).value());
    EXPECT_EQ(csv->row_count(), 2U);
    ASSERT_TRUE(csv->close().has_value());
    EXPECT_EQ(text_of(folder / "w.csv"),
              "frame,time_s,jawOpen,a_b__\n0,0.000000,0.50000,-0.50000\n2,0.033333,0.25000,-0.25000\n");
}

TEST(WeightsCsv, AFolderThatIsNotThereIsNamed) {
    const test::TempFolder folder;
    const auto csv = WeightsCsv::create(folder / "no" / "w.csv", {"a"});
    ASSERT_FALSE(csv.has_value());
    EXPECT_NE(csv.error().message.find("w.csv"), std::string::npos);
}

TEST(WeightsCsv, AFullDiskIsReported) {
    auto csv = WeightsCsv::create("/dev/full", {"a"});
    EXPECT_FALSE(csv.has_value());
}

}  // namespace
