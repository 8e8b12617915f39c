#include <gtest/gtest.h>

#include "tests/replay/stream_bounds.hpp"

namespace rig::test {
namespace {

class Speech : public testing::TestWithParam<StreamCase> {};

TEST_P(Speech, SolvesWithinItsBounds) {
    expect_within_bounds(GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Recorded, Speech,
    testing::Values(StreamCase{"facegood_3_15", 60, "truth", {0.0030, 0.0050}, {0.0039, 0.0065}},
                    StreamCase{"facegood_3_15", 60, "noise03", {0.0270, 0.0410}, {0.1150, 0.1750}},
                    StreamCase{"facegood_3_15", 60, "slip", {0.0032, 0.0055}, {0.0100, 0.0170}},
                    StreamCase{"facegood_3_15", 60, "drop20", {0.0110, 0.0170}, {0.0420, 0.0630}},
                    StreamCase{"facegood_3_15", 60, "combined", {0.0100, 0.0150}, {0.0380, 0.0570}},
                    StreamCase{"facegood_3_15", 60, "unlabelled", {0.0095, 0.0145}, {0.0350, 0.0520}},
                    StreamCase{"facegood_3_15", 50, "combined", {0.0103, 0.0155}, {0.0420, 0.0630}},
                    StreamCase{"facegood_3_15", 102, "combined", {0.0143, 0.0215}, {0.0300, 0.0450}}));

}  // namespace
}  // namespace rig::test
