#include "firmware_host/companion/report/svg_chart.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "tests/support/random.hpp"
#include "tests/support/text_checks.hpp"

namespace rig::host {
namespace {

using test::count_of;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

TEST(LineChart, ShowsThresholdsEventsAndGaps) {
    LineChart chart{.x_name = "time, s", .y_name = "mm", .dots = false, .series = {{"a", {}}}};
    chart.series[0].points = {{0.0, 1.0}, {1.0, 2.0}, {2.0, kNan}, {3.0, 1.0}, {4.0, 2.0}};
    const auto runs = [](const std::string& svg) {
        const std::size_t start = svg.find("<path d=\"");
        return count_of(svg.substr(start, svg.find("fill=", start) - start), "M");
    };
    EXPECT_EQ(runs(line_chart(chart)), 1U);
    chart.gaps = true;
    EXPECT_EQ(runs(line_chart(chart)), 2U);
    chart.levels = {{"alarm <8>", 8.0}};
    chart.events = {{"happened", {0.5, 3.5, 99.0, kNan}}};
    chart.x_range = {{0.0, 20.0}};
    const std::string svg = line_chart(chart);
    expect_whole(svg);
    EXPECT_NE(svg.find("alarm &lt;8&gt;"), std::string::npos);
    EXPECT_NE(svg.find(">8<"), std::string::npos);   // the threshold is inside the axis
    EXPECT_NE(svg.find(">20<"), std::string::npos);  // and so is the whole range
    EXPECT_NE(svg.find(">happened<"), std::string::npos);
    EXPECT_EQ(count_of(svg, "v9"), 2U);  // what is outside is left out
}

TEST(LineChart, LargeNumbersStayPlain) {
    LineChart chart{.x_name = "x", .y_name = "y", .series = {{"a", {{0.0, 0.0}, {1.0, 60000.0}}}}};
    EXPECT_NE(line_chart(chart).find(">60000<"), std::string::npos);
}

TEST(ColumnChart, HasAColumnForEveryValueAboveZero) {
    const std::string svg = column_chart(
        {.x_name = "<px>", .y_name = "blobs", .low = 0.0, .high = 4.0, .values = {3.0, 0.0, kNan, 6.0}});
    expect_whole(svg);
    EXPECT_EQ(count_of(svg, "<rect"), 2U);
    EXPECT_NE(svg.find("3 to 4: 6"), std::string::npos);
    EXPECT_NE(svg.find("&lt;px&gt;"), std::string::npos);
    expect_whole(column_chart({}));
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
