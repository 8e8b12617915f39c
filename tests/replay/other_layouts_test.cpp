#include <gtest/gtest.h>

#include "tests/replay/stream_bounds.hpp"

namespace rig::test {
namespace {

class OtherLayouts : public testing::TestWithParam<StreamCase> {};

TEST_P(OtherLayouts, SolvesWithinItsBounds) {
    expect_within_bounds(GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Recorded, OtherLayouts,
    testing::Values(
        StreamCase{"alex_rom_3", 50, "truth", {0.005, 0.008}, {0.009, 0.014}},
        StreamCase{"alex_rom_3", 50, "combined", {0.016, 0.024}, {0.048, 0.072}},
        // Longer than 1 mm with 102 markers are also columns that the temporal prior slows down: lids.
        StreamCase{"alex_rom_3", 102, "truth", {0.014, 0.022}, {0.0033, 0.0055}},
        StreamCase{"alex_rom_3", 102, "combined", {0.0210, 0.0320}, {0.034, 0.051}}));

}  // namespace
}  // namespace rig::test
