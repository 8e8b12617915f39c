#include "firmware_host/companion/links/session_text.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace rig;
using namespace rig::host;

bool has_line(const std::vector<std::string>& lines, std::string_view start) {
    return std::any_of(lines.begin(), lines.end(),
                       [&](const std::string& line) { return line.starts_with(start); });
}

TEST(SessionText, HelloTellsWhoAndWhat) {
    Hello hello;
    hello.serial = FixedText<32>("rig-7");
    hello.board = FixedText<24>("sim");
    hello.capabilities = kIsSimulated;
    hello.rate_mhz = 59940;
    EXPECT_TRUE(has_line(hello_lines(hello), "rig: rig-7"));
    EXPECT_TRUE(has_line(hello_lines(hello), "board: sim (simulated)"));
    EXPECT_TRUE(has_line(hello_lines(hello), "rate: 59.940 Hz"));
    EXPECT_TRUE(has_line(hello_lines(hello), "pack: none loaded"));
    hello.pack_loaded = true;
    hello.pack_unsigned = true;
    hello.pack_hash = {0xAB, 1};
    EXPECT_TRUE(has_line(hello_lines(hello), "pack: ab01000000000000 (unsigned), 0 shapes"));
}

TEST(SessionText, FaultsPresentAndPastHaveTheirSentences) {
    Health health;
    EXPECT_TRUE(fault_lines(health).empty());
    health.faults = fault_bit(Fault::kThermal);
    health.fault_counts[35] = 1;
    health.fault_counts[0] = 3;
    const auto lines = fault_lines(health);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_TRUE(lines[0].starts_with("F01 past (3 times): A camera is unplugged"));
    EXPECT_TRUE(lines[1].starts_with("F36 now (1 time): The processor is hot"));
}

TEST(SessionText, CamerasThatNeverDeliveredAreNotListed) {
    Health health;
    health.camera_good = {0, 7, 0, 0};
    const auto lines = health_lines(health);
    EXPECT_FALSE(has_line(lines, "camera 0"));
    EXPECT_TRUE(has_line(lines, "camera 1: good 7"));
    EXPECT_FALSE(has_line(lines, "temperature"));
    health.temperature_dc = 415;
    EXPECT_TRUE(has_line(health_lines(health), "temperature: 41.5 C"));
}

TEST(SessionText, WordsForEveryState) {
    EXPECT_EQ(state_word(TrackingState::kSafe), "SAFE");
    EXPECT_EQ(state_word(TrackingState::kLive), "LIVE");
    EXPECT_EQ(state_word(static_cast<TrackingState>(77)), "?");
    EXPECT_EQ(camera_word(CameraStatus::kExposure), "exposure");
    EXPECT_EQ(camera_word(static_cast<CameraStatus>(77)), "?");
}

TEST(SessionText, Events) {
    EventMessage event;
    event.kind = EventKind::kFaultRaised;
    event.fault = 1;
    event.camera = 2;
    event.count = 4;
    EXPECT_EQ(event_line(event),
              "fault raised F01, camera 2, 4 times: A camera is unplugged or closed; the others go on.");
    event = {};
    event.text = FixedText<120>("started");
    EXPECT_EQ(event_line(event), "started");
}

}  // namespace
