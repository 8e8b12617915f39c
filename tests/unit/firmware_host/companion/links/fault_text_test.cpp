#include "firmware_host/companion/links/fault_text.hpp"

#include <gtest/gtest.h>

#include <set>

#include "core/wire/text.hpp"

namespace {

using namespace rig::host;

TEST(FaultText, EveryFaultHasItsOwnPlainSentence) {
    std::set<std::string_view> seen;
    for (int number = 1; number <= kLastFault; ++number) {
        const std::string_view text = fault_text(number);
        EXPECT_TRUE(seen.insert(text).second) << number;
        EXPECT_TRUE(text.ends_with('.')) << text;
        EXPECT_GT(text.size(), 20U) << number;
        EXPECT_LT(text.size(), 100U) << text;
        EXPECT_TRUE(rig::is_printable_utf8(text));
    }
    EXPECT_EQ(kLastFault, static_cast<int>(rig::Fault::kNoSlot));
}

TEST(FaultText, SaysWhatTheCatalogueSays) {
    EXPECT_NE(fault_text(1).find("unplugged"), std::string_view::npos);
    EXPECT_NE(fault_text(static_cast<int>(rig::Fault::kThermal)).find("hot"), std::string_view::npos);
    EXPECT_NE(fault_text(static_cast<int>(rig::Fault::kNoSlot)).find("pack"), std::string_view::npos);
}

TEST(FaultText, NumbersOfANewerBoardAreNotAccessedBeyondTheTable) {
    for (const int number : {-1, 0, 56, 64, 1000}) {
        EXPECT_NE(fault_text(number).find("newer"), std::string_view::npos);
    }
}

TEST(FaultText, MapsAreReadBitByBit) {
    EXPECT_TRUE(faults_of(0).empty());
    EXPECT_EQ(faults_of(rig::fault_bit(rig::Fault::kCameraGone) | rig::fault_bit(rig::Fault::kNoSlot)),
              (std::vector<int>{1, 55}));
    EXPECT_EQ(faults_of(rig::FaultMap{1} << 63), std::vector<int>{64});
    EXPECT_EQ(fault_code(7), "F07");
    EXPECT_EQ(fault_code(55), "F55");
}

}  // namespace
