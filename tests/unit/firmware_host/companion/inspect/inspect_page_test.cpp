#include "firmware_host/companion/inspect/inspect_page.hpp"
#include "tests/support/text_checks.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rig::host {
namespace {

using test::has;

// Ten minutes of 102 markers at 60 Hz where everything happens: bursts of hidden markers, noise, losses.
TakeRecord long_record() {
    TakeRecord record;
    record.name = "long <take>";
    record.source = "a test";
    record.cameras = {"a", "b"};
    record.counts_ghosts = true;
    for (int k = 0; k < 102; ++k) {
        record.markers.push_back({"m<" + std::to_string(k) + ">",
                                  static_cast<FaceRegion>(k % 6),
                                  {static_cast<double>(k % 10), static_cast<double>(-k), 0.0}});
    }
    for (int t = 0; t < 36000; ++t) {
        TakeTick tick;
        tick.time_s = t / 60.0;
        tick.solved = t % 5000 > 40;
        tick.state = tick.solved ? TrackingState::kLive : TrackingState::kHold;
        tick.faults = tick.solved ? 0 : fault_bit(Fault::kMarkersLost);
        tick.swaps_repaired = t % 997 == 0 ? 2 : 0;
        tick.residual_rms_mm = tick.solved ? 0.1 + 0.05 * std::sin(0.37 * t) : std::nan("");
        tick.slip_deg = tick.solved ? 1.0 + std::sin(0.001 * t) : std::nan("");
        tick.slip_mm = tick.slip_deg;
        record.ticks.push_back(tick);
        for (int k = 0; k < 102; ++k) {
            const bool hidden = (t / 7 * 31 + k * 17) % 19 == 0;
            record.sightings.push_back(!tick.solved ? Sighting::kLost
                                       : hidden     ? Sighting::kInferred
                                                    : Sighting::kVisible);
            record.residuals_mm.push_back(tick.solved && !hidden ? 0.1F : std::nanf(""));
        }
    }
    return record;
}

TEST(InspectPage, OfTenMinutesIsSmallAndNeedsNothingFromElsewhere) {
    const std::string html = inspect_page(long_record());
    EXPECT_LT(html.size(), std::size_t{3} << 20);
    EXPECT_FALSE(has(html, "<script"));
    EXPECT_FALSE(has(html, "https:"));
    EXPECT_FALSE(has(html, "url("));
    EXPECT_FALSE(has(html, "m<1>"));
    EXPECT_TRUE(has(html, "<title>Take long &lt;take&gt;</title>"));
    for (const char* part :
         {"36000 frames at 60 Hz, 600.0 s", "Markers over time", "Tracking state", "Faults", "F16",
          "Residual", "Slip of the helmet", "alarm 4.0 deg", "alarm 8.0 mm", "Markers hidden longest",
          "Markers with the largest residual", "names repaired or refused", "data:image/png;base64,"})
        EXPECT_TRUE(has(html, part)) << part;
    EXPECT_EQ(html, inspect_page(long_record()));
}

TEST(InspectPage, SaysWhatATakeDoesNotTell) {
    TakeRecord record;
    record.name = "states only";
    record.remarks = {"Something about <this>."};
    record.ticks.resize(3);
    for (std::size_t t = 0; t < 3; ++t) record.ticks[t].time_s = static_cast<double>(t) / 60.0;
    const std::string html = inspect_page(record);
    EXPECT_TRUE(has(html, "Nothing is known of the markers"));
    EXPECT_TRUE(has(html, "None was raised"));
    EXPECT_TRUE(has(html, "no face was ever found"));
    EXPECT_TRUE(has(html, "about &lt;this&gt;"));
    EXPECT_FALSE(has(html, "Slip of the helmet"));
    EXPECT_FALSE(has(html, "Distributions"));
    EXPECT_FALSE(has(html, "nan"));
}

TEST(InspectPage, ShowsCamerasThatMovedWhereMarksTellIt) {
    TakeRecord record = long_record();
    EXPECT_FALSE(has(inspect_page(record), "Cameras on the helmet"));
    record.ticks[500].camera_shift_px = 3.5;
    const std::string html = inspect_page(record);
    EXPECT_TRUE(has(html, "Cameras on the helmet"));
    EXPECT_TRUE(has(html, "alarm 0.5 px"));
}

TEST(InspectPage, OfNoFrames) {
    const std::string html = inspect_page(TakeRecord{});
    EXPECT_TRUE(has(html, "0 frames"));
    EXPECT_TRUE(has(html, "The take holds no frame"));
    EXPECT_FALSE(has(html, "<svg"));
}

}  // namespace
}  // namespace rig::host
