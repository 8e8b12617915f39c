#include "firmware_host/daemon/marker_trouble_text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>

namespace rig::test {
namespace {

constexpr std::array<std::string_view, 3> kNames{"LL_M", "MC_L", ""};

std::unique_ptr<FrameReport> no_trouble() {
    return std::make_unique<FrameReport>();
}

TEST(MarkerTroubleText, NamesThoseInTrouble) {
    const auto report = no_trouble();
    EXPECT_EQ(marker_trouble_text(*report, kNames).view(), "");
    report->marker_trouble[0] = MarkerTrouble::kFallen;
    EXPECT_EQ(marker_trouble_text(*report, kNames).view(), "marker LL_M has come off");
    report->marker_trouble[1] = MarkerTrouble::kSlid;
    report->marker_off_mm[1] = 2.06F;
    EXPECT_EQ(marker_trouble_text(*report, kNames).view(),
              "marker LL_M has come off; marker MC_L has slid by 2.1 mm");
}

TEST(MarkerTroubleText, ANumberStandsForAMissingName) {
    const auto report = no_trouble();
    report->marker_trouble[2] = MarkerTrouble::kFallen;
    report->marker_trouble[7] = MarkerTrouble::kFallen;
    EXPECT_EQ(marker_trouble_text(*report, kNames).view(), "marker 2 has come off; marker 7 has come off");
}

TEST(MarkerTroubleText, WhatDoesNotFitIsCounted) {
    const auto report = no_trouble();
    report->marker_trouble.fill(MarkerTrouble::kSlid);
    report->marker_off_mm.fill(1e30F);  // nothing is written past the line
    const FixedText<120> text = marker_trouble_text(*report, kNames);
    EXPECT_TRUE(text.view().starts_with("marker LL_M has slid by 1000000")) << text.view();
    EXPECT_TRUE(text.view().ends_with(" more")) << text.view();
    report->marker_off_mm.fill(1.25F);
    const FixedText<120> usual = marker_trouble_text(*report, kNames);
    EXPECT_EQ(
        usual.view(),
        "marker LL_M has slid by 1.2 mm; marker MC_L has slid by 1.2 mm; marker 2 has slid by 1.2 mm; and " +
            std::to_string(kMaxMarkers - 3) + " more");
    const std::array<std::string_view, 1> long_name{"a_name_of_forty_bytes_is_shown_shortened"};
    EXPECT_TRUE(marker_trouble_text(*report, long_name)
                    .view()
                    .starts_with("marker a_name_of_forty_bytes_is_shown has slid"));
}

}  // namespace
}  // namespace rig::test
