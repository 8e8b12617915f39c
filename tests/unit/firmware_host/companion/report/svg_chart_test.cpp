#include "firmware_host/companion/report/svg_chart.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "tests/support/random.hpp"

namespace rig::host {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t count_of(std::string_view text, std::string_view part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1))
        ++count;
    return count;
}

// Every element that is opened is closed, and no number is missing.
void expect_whole(const std::string& svg) {
    EXPECT_TRUE(svg.starts_with("<svg "));
    EXPECT_TRUE(svg.ends_with("</svg>\n"));
    EXPECT_EQ(count_of(svg, "<text"), count_of(svg, "</text>"));
    EXPECT_EQ(count_of(svg, "\"nan"), 0U);
    EXPECT_EQ(count_of(svg, " nan"), 0U);
    EXPECT_EQ(count_of(svg, "inf"), 0U);
}

TEST(AxisTicks, AreRoundAndInside) {
    EXPECT_EQ(axis_ticks(0.0, 10.0, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
    EXPECT_EQ(axis_ticks(0.01, 100.0, true).size(), 5U);
    EXPECT_TRUE(axis_ticks(1.0, 1.0, false).empty());
    EXPECT_TRUE(axis_ticks(kNan, 1.0, false).empty());
    EXPECT_TRUE(axis_ticks(-1.0, 1.0, true).empty());
    test::SeededRandom random(5);
    for (int trial = 0; trial < 1000; ++trial) {
        const double low = random.uniform(-1e3, 1e3);
        const double high = low + std::pow(10.0, random.uniform(-4.0, 5.0));
        const std::vector<double> ticks = axis_ticks(low, high, false);
        ASSERT_GE(ticks.size(), 3U) << low << " " << high;
        ASSERT_LE(ticks.size(), 8U) << low << " " << high;
        const double air = 1e-6 * (high - low);
        ASSERT_GE(ticks.front(), low - air);
        ASSERT_LE(ticks.back(), high + air);
    }
}

TEST(LineChart, DrawsEveryPointThatIsANumber) {
    LineChart chart;
    chart.x_name = "lambda <mm>";
    chart.y_name = "GCV";
    chart.log_x = true;
    chart.series = {{"a", {{0.001, 1.0}, {0.1, 0.5}, {0.0, 0.7}, {10.0, kNan}, {100.0, 0.9}}}};
    chart.marked_x = 0.1;
    const std::string svg = line_chart(chart);
    expect_whole(svg);
    EXPECT_EQ(count_of(svg, "<circle"), 3U);
    EXPECT_EQ(count_of(svg, "stroke-dasharray"), 1U);
    EXPECT_NE(svg.find("lambda &lt;mm&gt;"), std::string::npos);
}

TEST(LineChart, SurvivesEmptyAndFlatCurves) {
    expect_whole(line_chart({}));
    for (const bool log : {false, true}) {
        LineChart chart;
        chart.log_x = chart.log_y = log;
        chart.series = {{"flat", {{3.0, 7.0}}}, {"empty", {}}, {"bad", {{kNan, 1.0}, {1.0, kInfinity}}}};
        const std::string svg = line_chart(chart);
        expect_whole(svg);
        EXPECT_EQ(count_of(svg, "<circle"), 1U);
        EXPECT_EQ(count_of(svg, ">flat<"), 1U);  // a legend, since there are several
    }
}

TEST(BarChart, ScalesToTheLargestAndEscapes) {
    const std::string svg = bar_chart(
        {{"</text><script>", 2.0, 4.0, true}, {"b", 1.0, {}, false}, {"zero", 0.0, {}, false}}, "mm");
    expect_whole(svg);
    EXPECT_EQ(svg.find("<script"), std::string::npos);
    EXPECT_EQ(count_of(svg, "<rect"), 3U);
    EXPECT_NE(svg.find("width=\"210.0\""), std::string::npos);  // 2 of 4 over 420 px
    EXPECT_NE(svg.find("(!)"), std::string::npos);
    EXPECT_EQ(count_of(bar_chart({}, "mm"), "<rect"), 0U);
}

TEST(FaceMap, LooksAtTheFaceFromTheFront) {
    const std::string svg = face_map({{"left", 50.0, 0.0, 1.0}, {"chin", 0.0, -90.0, 0.5}}, "mm");
    expect_whole(svg);
    const auto at = [&](std::string_view name, std::string_view attribute) {
        const std::size_t title = svg.find("<title>" + std::string(name));
        const std::size_t start = svg.rfind("<circle", title);
        const std::size_t value = svg.find(attribute, start) + attribute.size();
        return std::stod(svg.substr(value));
    };
    EXPECT_GT(at("left", "cx=\""), at("chin", "cx=\""));
    EXPECT_LT(at("left", "cy=\""), at("chin", "cy=\""));
    EXPECT_GT(at("left", " r=\""), at("chin", " r=\""));
    expect_whole(face_map({}, "mm"));
    expect_whole(face_map({{"one", 1.0, 1.0, 0.0}}, "mm"));
}

}  // namespace
}  // namespace rig::host
