#include "firmware_host/companion/inspect/take_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "firmware_host/companion/inspect/moment_watch.hpp"

namespace rig::host {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Ten frames of 100 Hz with two markers: the first hidden in frames 2 to 4, no face in 6 and 7, the second
// with a large residual in frame 9.
TakeRecord record_of_ten() {
    TakeRecord record;
    record.name = "ten";
    record.rate_hz = 100.0;
    record.counts_ghosts = true;
    record.markers = {{"brow", FaceRegion::kForehead, {0, 40, 0}}, {"chin", FaceRegion::kJaw, {0, -90, 0}}};
    for (int i = 0; i < 10; ++i) {
        TakeTick tick;
        tick.time_s = 0.01 * i;
        tick.solved = i != 6 && i != 7;
        tick.state = tick.solved ? TrackingState::kLive : TrackingState::kHold;
        if (!tick.solved) tick.faults = fault_bit(Fault::kMarkersLost);
        if (tick.solved) {
            tick.residual_rms_mm = i == 9 ? 2.0 : 0.1;
            tick.slip_deg = 0.5 * i;
            tick.slip_mm = 1.0;
            tick.ghosts = 1;
        }
        tick.bootstrapped = i == 0 || i == 8;
        tick.swaps_repaired = i == 5 ? 2 : 0;
        record.ticks.push_back(tick);
        const bool hidden = i >= 2 && i <= 4;
        record.sightings.push_back(!tick.solved ? Sighting::kLost
                                   : hidden     ? Sighting::kInferred
                                                : Sighting::kVisible);
        record.sightings.push_back(tick.solved ? Sighting::kVisible : Sighting::kLost);
        record.residuals_mm.push_back(tick.solved && !hidden ? 0.1F : kNan);
        record.residuals_mm.push_back(!tick.solved ? kNan : i == 9 ? 3.0F : 0.1F);
    }
    return record;
}

TEST(InspectFigures, CountWhatHappened) {
    const InspectFigures figures = figures_of(record_of_ten());
    EXPECT_EQ(figures.ticks, 10U);
    EXPECT_NEAR(figures.duration_s, 0.1, 1e-12);
    EXPECT_NEAR(figures.visible, (5 + 8) / 20.0, 1e-12);
    EXPECT_NEAR(figures.inferred, 3 / 20.0, 1e-12);
    EXPECT_NEAR(figures.lost, 4 / 20.0, 1e-12);
    EXPECT_EQ(figures.swaps_repaired, 2U);
    EXPECT_EQ(figures.repair_ticks, 1U);
    EXPECT_EQ(figures.ghosts, 8U);
    EXPECT_EQ(figures.rebootstraps, 1U);
    EXPECT_NEAR(figures.longest_loss_ms.value, 20.0, 1e-9);
    EXPECT_NEAR(figures.longest_loss_ms.at_s, 0.06, 1e-12);
    EXPECT_NEAR(figures.slip_max_deg->value, 4.5, 1e-12);
    EXPECT_NEAR(figures.slip_max_deg->at_s, 0.09, 1e-12);
    EXPECT_EQ(figures.slip_alarm_ticks, 1U);  // 4.5 degrees; 4.0 is below the alarm of 4.01
    EXPECT_NEAR(*figures.residual_median_mm, 0.1, 1e-12);
    EXPECT_NEAR(figures.residual_max_mm->value, 2.0, 1e-12);
    ASSERT_EQ(figures.faults.size(), 1U);
    EXPECT_EQ(figures.faults[0].number, 16);
    EXPECT_EQ(figures.faults[0].ticks, 2U);
    EXPECT_EQ(figures.faults[0].times, 1U);
    EXPECT_NEAR(figures.faults[0].first_s, 0.06, 1e-12);
}

TEST(InspectFigures, TellEachMarkersWorst) {
    const InspectFigures figures = figures_of(record_of_ten());
    ASSERT_EQ(figures.markers.size(), 2U);
    EXPECT_NEAR(figures.markers[0].longest_hidden_s.value, 0.03, 1e-12);
    EXPECT_NEAR(figures.markers[0].longest_hidden_s.at_s, 0.02, 1e-12);
    EXPECT_NEAR(figures.markers[1].longest_hidden_s.value, 0.02, 1e-12);
    EXPECT_NEAR(figures.markers[1].residual_max_mm->value, 3.0, 1e-6);
    EXPECT_NEAR(figures.markers[1].residual_max_mm->at_s, 0.09, 1e-12);
    EXPECT_NEAR(figures.markers[1].residual_rms_mm, std::sqrt((9.0 + 7 * 0.01) / 8), 1e-6);
}

TEST(InspectFigures, ATakeThatEndsLostIsLostUntilItsEnd) {
    TakeRecord record = record_of_ten();
    for (std::size_t i = 8; i < 10; ++i) record.ticks[i].solved = false;
    EXPECT_NEAR(figures_of(record).longest_loss_ms.value, 40.0, 1e-9);
    for (TakeTick& tick : record.ticks) tick.solved = false;
    const InspectFigures never = figures_of(record);
    EXPECT_FALSE(never.first_face_s);
    EXPECT_EQ(never.longest_loss_ms.value, 0.0);
}

TEST(InspectFigures, NothingOfNothing) {
    const InspectFigures figures = figures_of(TakeRecord{});
    EXPECT_EQ(figures.ticks, 0U);
    EXPECT_TRUE(figures.markers.empty());
    EXPECT_FALSE(figures.slip_max_deg);
    EXPECT_EQ(summary_facts(TakeRecord{}, figures).front(), "0 frames at 60 Hz, 0.0 s");
}

TEST(InspectFigures, EveryFactHasItsUnit) {
    const TakeRecord record = record_of_ten();
    std::string all;
    for (const std::string& fact : summary_facts(record, figures_of(record))) all += fact + "\n";
    for (const char* part : {"10 frames at 100 Hz, 0.1 s", "visible 65.00 %, inferred 15.00 %, lost 20.00 %",
                             "swaps repaired: 2 names in 1 frames", "ghosts rejected: 8 (0.80 a frame)",
                             "longest loss 20 ms (at 0.1 s)", "slip at most 4.50 deg", "and 1.00 mm",
                             "residual rms median 0.100 mm, most 2.000 mm"})
        EXPECT_NE(all.find(part), std::string::npos) << part << "\n" << all;
}

TEST(HistogramOfATake, CountsEveryFiniteNumberOnce) {
    Histogram histogram{0.0, 1.0, std::vector<std::uint64_t>(4, 0)};
    for (const double value : {-1.0, 0.0, 0.26, 0.5, 1.0, 7.0, std::nan(""), HUGE_VAL}) histogram.add(value);
    EXPECT_EQ(histogram.counts, (std::vector<std::uint64_t>{2, 1, 1, 2}));
    EXPECT_EQ(histogram.total(), 6U);
}

TEST(MomentWatch, KeepsTheWorstOfEachKindAndDrawsNothingElse) {
    const TakeRecord whole = record_of_ten();
    TakeRecord record = whole;
    record.ticks.clear();
    record.sightings.clear();
    MomentWatch watch;
    int drawn = 0;
    for (std::size_t i = 0; i < whole.ticks.size(); ++i) {
        record.ticks.push_back(whole.ticks[i]);
        // far apart, so that none is taken for another
        record.ticks.back().time_s = static_cast<double>(i);
        record.sightings.insert(record.sightings.end(), {whole.sighting(i, 0), whole.sighting(i, 1)});
        watch.look(record, [&] {
            ++drawn;
            return std::vector<SceneView>(1);
        });
    }
    const std::vector<Moment> moments = watch.taken();
    const auto reason_of = [&](std::size_t tick) {
        std::string all;
        for (const Moment& moment : moments) {
            if (moment.tick != tick) continue;
            for (const std::string& reason : moment.reasons) all += reason + ";";
        }
        return all;
    };
    EXPECT_NE(reason_of(0).find("first face"), std::string::npos);
    EXPECT_NE(reason_of(2).find("most markers hidden: 1 of 2"), std::string::npos);
    EXPECT_NE(reason_of(5).find("2 changed"), std::string::npos);
    EXPECT_NE(reason_of(7).find("longest loss: no face for 2000 ms"), std::string::npos);
    EXPECT_NE(reason_of(9).find("largest residual: 2.000 mm rms"), std::string::npos);
    EXPECT_LT(drawn, 10 + 1);
    for (std::size_t i = 1; i < moments.size(); ++i) EXPECT_LT(moments[i - 1].tick, moments[i].tick);
}

}  // namespace
}  // namespace rig::host
