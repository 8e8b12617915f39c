#include "firmware_host/companion/monitor/screen.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace rig;
using namespace rig::host;

MonitorModel live_model(std::size_t shapes) {
    MonitorModel model;
    model.link = "/dev/pts/5";
    model.phase = SessionPhase::kReady;
    model.hello = Hello{};
    model.state = FaceState{};
    model.state->state = TrackingState::kLive;
    model.state->held = false;
    model.state->shape_count = static_cast<std::uint16_t>(shapes);
    for (std::size_t i = 0; i < shapes; ++i) {
        model.shape_names.push_back("sh\xC3\xA4pe_" + std::to_string(i));
        model.state->weights[i] = static_cast<float>(i) / 100.0F;
        model.state->confidence[i] = 1.0F;
    }
    model.rate_hz = 60.0;
    model.latency_us = 8100;
    return model;
}

// Without the escapes that colour it: from ESC to the next m.
std::string without_colour(const std::string& line) {
    std::string plain;
    bool in_escape = false;
    for (const char c : line) {
        in_escape = in_escape || c == '\x1b';
        if (!in_escape) plain += c;
        in_escape = in_escape && c != 'm';
    }
    return plain;
}

TEST(Screen, NeverLargerThanTheTerminal) {
    for (const std::size_t shapes : {0, 1, 5, 52, 256}) {
        for (const std::size_t columns : {1, 5, 20, 40, 80, 200}) {
            for (const std::size_t rows : {1, 2, 5, 10, 24, 100}) {
                MonitorModel model = live_model(shapes);
                model.state->faults = ~FaultMap{0};
                model.last_event = "something";
                model.health = Health{};
                const auto lines = monitor_screen(model, {columns, rows}, true);
                ASSERT_LE(lines.size(), rows);
                for (const std::string& line : lines) {
                    ASSERT_LE(text_width(without_colour(line)), columns)
                        << shapes << ' ' << columns << 'x' << rows;
                }
            }
        }
    }
}

TEST(Screen, ShowsEveryShapeThatFits) {
    const auto lines = monitor_screen(live_model(52), {120, 40}, false);
    std::string all;
    for (const std::string& line : lines) all += line + "\n";
    for (std::size_t i = 0; i < 52; ++i) {
        EXPECT_NE(all.find("sh\xC3\xA4pe_" + std::to_string(i) + " "), std::string::npos) << i;
    }
    EXPECT_NE(all.find("LIVE"), std::string::npos);
    EXPECT_NE(all.find("latency 8.1 ms"), std::string::npos);
    EXPECT_EQ(all.find('\x1b'), std::string::npos) << "no colour when none is wanted";
}

TEST(Screen, BarsFollowTheWeights) {
    MonitorModel model = live_model(4);
    model.state->weights = {0.0F, 0.5F, 1.0F, -0.5F};
    const auto lines = monitor_screen(model, {40, 12}, false);
    const auto hashes = [&](std::size_t shape) {
        for (const std::string& line : lines) {
            if (line.find("sh\xC3\xA4pe_" + std::to_string(shape)) == 0)
                return std::count(line.begin(), line.end(), '#');
        }
        return std::ptrdiff_t{-1};
    };
    EXPECT_EQ(hashes(0), 0);
    EXPECT_GT(hashes(1), 5);
    EXPECT_NEAR(static_cast<double>(hashes(2)), 2.0 * static_cast<double>(hashes(1)), 1.0);
    EXPECT_EQ(hashes(3), 0);
    EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), [](const std::string& line) {
        return line.find('<') != std::string::npos && line.find("-0.500") != std::string::npos;
    }));
}

TEST(Screen, SaysWhatItWaitsFor) {
    MonitorModel model;
    model.phase = SessionPhase::kClosed;
    EXPECT_NE(monitor_line(model, 1.0).find("the link is lost"), std::string::npos);
    model.phase = SessionPhase::kRefused;
    model.refusal = "busy";
    EXPECT_EQ(monitor_line(model, 1.0), "1.0 s: refused: busy");
    model.phase = SessionPhase::kReady;
    EXPECT_NE(monitor_line(model, 1.0).find("waiting"), std::string::npos);
}

TEST(Screen, OneLineForPipes) {
    MonitorModel model = live_model(5);
    model.state->faults = fault_bit(Fault::kCameraGone) | fault_bit(Fault::kThermal);
    EXPECT_EQ(monitor_line(model, 2.0),
              "2.0 s: LIVE rate 60.0 Hz latency 8.1 ms missing 0 lost 0 damaged 0 faults F01+F36 strongest "
              "sh\xC3\xA4pe_4=0.040");
}

TEST(Screen, TheHeadIsShownOfRigsThatTellIt) {
    MonitorModel model = live_model(3);
    EXPECT_EQ(monitor_line(model, 1.0).find("head pose"), std::string::npos);
    model.hello->capabilities = kCanStreamHead;
    EXPECT_NE(monitor_line(model, 1.0).find("head pose: no face"), std::string::npos)
        << monitor_line(model, 1.0);
    model.state->head.status = HeadStatus::kKnown;
    model.state->head.rotation_rad = {0.0F, 0.5F, 0.0F};
    model.state->head.translation_mm = {12.0F, -3.5F, 40.0F};
    const std::string text = "head pose: turn 0.0 28.6 0.0 degrees  place 12.0 -3.5 40.0 mm";
    EXPECT_NE(monitor_line(model, 1.0).find(text), std::string::npos) << monitor_line(model, 1.0);
    const auto lines = monitor_screen(model, {100, 20}, false);
    EXPECT_TRUE(std::ranges::any_of(lines, [&](const std::string& line) { return line.starts_with(text); }));
}

TEST(Screen, FittedCountsCharactersNotBytes) {
    EXPECT_EQ(fitted("\xC3\xA4"
                     "bc",
                     2),
              "\xC3\xA4"
              "b");
    EXPECT_EQ(fitted("\xC3\xA4", 3), "\xC3\xA4  ");
    EXPECT_EQ(fitted("abc", 0), "");
}

}  // namespace
