#include "firmware_host/companion/inspect/take_charts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/random.hpp"
#include "tests/support/text_checks.hpp"

namespace rig::host {
namespace {

using test::count_of;

void expect_whole(const std::string& svg) {
    EXPECT_TRUE(svg.starts_with("<svg "));
    EXPECT_TRUE(svg.ends_with("</svg>\n"));
    EXPECT_EQ(count_of(svg, "<text"), count_of(svg, "</text>"));
    for (const char* bad : {"\"nan", " nan", "inf\"", "http:", "https:"}) {
        const bool name_space = bad[0] == 'h' && bad[4] == ':';
        EXPECT_EQ(count_of(svg, bad), name_space ? count_of(svg, "http://www.w3.org/2000/svg") : 0U) << bad;
    }
}

TakeRecord plain_record(std::size_t ticks, double rate_hz) {
    TakeRecord record;
    record.rate_hz = rate_hz;
    record.cameras = {"a"};
    record.markers = {{"<brow>", FaceRegion::kForehead, {}},
                      {"a_marker_with_a_long_name", FaceRegion::kJaw, {}}};
    for (std::size_t i = 0; i < ticks; ++i) {
        TakeTick tick;
        tick.time_s = static_cast<double>(i) / rate_hz;
        tick.state = TrackingState::kLive;
        tick.cameras[0] = CameraStatus::kGood;
        tick.solved = true;
        tick.residual_rms_mm = 0.1;
        record.ticks.push_back(tick);
        record.sightings.insert(record.sightings.end(), {Sighting::kVisible, Sighting::kVisible});
    }
    return record;
}

TEST(TimeBins, GiveEveryTickOfAShortTakeItsOwnColumn) {
    for (const std::size_t ticks : {1U, 2U, 60U, 299U, 710U}) {
        for (const double rate_hz : {30.0, 60.0, 59.94, 120.0}) {
            const TakeRecord record = plain_record(ticks, rate_hz);
            const TimeBins bins = time_bins(record);
            ASSERT_EQ(bins.count, ticks);
            for (std::size_t t = 0; t < ticks; ++t) {
                ASSERT_EQ(bins.of_tick[t].first, t);
                ASSERT_EQ(bins.of_tick[t].last, t);
            }
        }
    }
}

TEST(TimeBins, LeaveNoHoleInLongOrJitteryTakesAndKeepRealGaps) {
    test::SeededRandom random(3);
    for (int trial = 0; trial < 20; ++trial) {
        TakeRecord record = plain_record(trial < 10 ? 400 : 36000, 60.0);
        for (TakeTick& tick : record.ticks) tick.time_s += random.uniform(0.0, 0.2 / 60.0);
        const TimeBins bins = time_bins(record);
        std::vector<bool> filled(bins.count, false);
        for (const TimeBins::Span& span : bins.of_tick) {
            ASSERT_LE(span.first, span.last);
            for (std::size_t b = span.first; b <= span.last; ++b) filled[b] = true;
        }
        ASSERT_TRUE(std::ranges::all_of(filled, std::identity{}));
    }
    TakeRecord record = plain_record(120, 60.0);
    for (std::size_t t = 60; t < 120; ++t) record.ticks[t].time_s += 1.0;
    const TimeBins bins = time_bins(record);
    EXPECT_EQ(bins.count, 180U);
    EXPECT_LE(bins.of_tick[59].last, 61U);
    EXPECT_EQ(bins.of_tick[60].first, 120U);
}

TEST(MarkerTimeline, IsOnePictureWithNamesAndRegions) {
    const std::string svg = marker_timeline(plain_record(50, 60.0));
    expect_whole(svg);
    EXPECT_EQ(count_of(svg, "data:image/png;base64,"), 1U);
    EXPECT_NE(svg.find("&lt;brow&gt;"), std::string::npos);
    EXPECT_NE(svg.find("a_marker_with\u2026"), std::string::npos);
    EXPECT_NE(svg.find(">forehead and brows<"), std::string::npos);
    EXPECT_NE(svg.find(">chin and jaw<"), std::string::npos);
    EXPECT_NE(svg.find(">time, s<"), std::string::npos);
}

TEST(MarkerTimeline, OneHiddenFrameInAThousandChangesThePicture) {
    TakeRecord record = plain_record(36000, 60.0);
    const std::string before = marker_timeline(record);
    record.sightings[2 * 18000] = Sighting::kInferred;
    EXPECT_NE(marker_timeline(record), before);
    EXPECT_LT(before.size(), 100'000U);
}

TEST(StateRibbons, ShowTheWorstOfAColumn) {
    TakeRecord record = plain_record(36000, 60.0);
    EXPECT_EQ(count_of(state_ribbons(record), "fill=\"#b3261e\""),
              2U);  // the legend: LOST, and a camera gone
    record.ticks[777].state = TrackingState::kLost;
    const std::string svg = state_ribbons(record);
    expect_whole(svg);
    EXPECT_EQ(count_of(svg, "fill=\"#b3261e\""), 3U);
    record.ticks[5].cameras[0] = CameraStatus::kMissing;
    EXPECT_GT(count_of(state_ribbons(record), "<rect"), count_of(svg, "<rect"));
}

TEST(FaultRibbons, NameEachFault) {
    TakeRecord record = plain_record(100, 60.0);
    record.ticks[10].faults = fault_bit(Fault::kMarkersLost);
    const std::string svg = fault_ribbons(record, figures_of(record).faults);
    expect_whole(svg);
    EXPECT_NE(svg.find(">F16<"), std::string::npos);
    EXPECT_NE(svg.find("No marker is seen"), std::string::npos);
}

TEST(TickCurve, KeepsPeaksAndBreaksWhereThereIsNothing) {
    TakeRecord record = plain_record(36000, 60.0);
    record.ticks[20000].residual_rms_mm = 9.0;
    const auto value = [](const TakeTick& tick) { return tick.residual_rms_mm; };
    const std::string peak = tick_curve(record, "residual, mm", value, {{"alarm 4 mm", 4.0}});
    expect_whole(peak);
    EXPECT_NE(peak.find(">10<"), std::string::npos);  // the axis reaches over the peak
    EXPECT_NE(peak.find("alarm 4 mm"), std::string::npos);
    EXPECT_LT(peak.size(), 40'000U);
    const auto runs = [](const std::string& svg) {
        const std::size_t start = svg.find("<path d=\"M");
        return count_of(svg.substr(start, svg.find("fill=", start) - start), "M");
    };
    EXPECT_EQ(runs(peak), 1U);
    for (std::size_t t = 15000; t < 16000; ++t) record.ticks[t].residual_rms_mm = std::nan("");
    EXPECT_EQ(runs(tick_curve(record, "residual, mm", value, {})), 2U);
}

TEST(TickCurve, MarksRepairsAndFreshIdentities) {
    TakeRecord record = plain_record(100, 60.0);
    const auto value = [](const TakeTick& tick) { return tick.residual_rms_mm; };
    EXPECT_EQ(tick_curve(record, "r", value, {}).find("names repaired"), std::string::npos);
    record.ticks[40].swaps_repaired = 2;
    record.ticks[50].bootstrapped = true;
    const std::string svg = tick_curve(record, "r", value, {});
    EXPECT_NE(svg.find("names repaired"), std::string::npos);
    EXPECT_EQ(count_of(svg, "v9\""), 2U);
}

TEST(SceneSvg, DrawsNamesGhostsAndGuesses) {
    const TakeRecord record = plain_record(1, 60.0);
    SceneView view;
    view.title = "camera <a>";
    view.width_px = 480;
    view.height_px = 640;
    view.picture = "no/such/picture.png";
    view.blobs = {{100, 100, 8, 0}, {200, 200, 8, -1}};
    view.guesses = {{300, 300, 1, false}, {320, 330, 0, true}};
    const std::string svg = scene_svg(view, record.markers);
    expect_whole(svg);
    EXPECT_NE(svg.find("camera &lt;a&gt;: 1 named, 1 not"), std::string::npos);
    EXPECT_NE(svg.find("&lt;brow&gt;"), std::string::npos);
    EXPECT_NE(svg.find("a_marker_with_a_long_name"), std::string::npos);
    EXPECT_EQ(count_of(svg, "<circle"), 1U);
    EXPECT_EQ(count_of(svg, "<rect"), 2U);  // the plate and the ghost
    EXPECT_EQ(svg.find("<image"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
