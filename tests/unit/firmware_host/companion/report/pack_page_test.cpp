#include "firmware_host/companion/report/pack_page.hpp"

#include <gtest/gtest.h>

#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

std::string page_of(const TrainedPack& pack, const Take* take, std::vector<TrainingCurve> curves) {
    const SolvePack view = pack.view();
    const auto analysis = analyse_pack(view, take);
    EXPECT_TRUE(analysis);
    return pack_page({.name = "a <face> & \"b\"",
                      .pack = view,
                      .analysis = *analysis,
                      .rbf = pack.report.rbf,
                      .coverage = pack.report.coverage,
                      .curves = std::move(curves)});
}

bool has(const std::string& html, std::string_view part) {
    return html.find(part) != std::string::npos;
}

TEST(PackPage, NamesAreData) {
    test::TinyRig tiny = test::tiny_rig(24, 5, 200);
    tiny.rig.shapes[2].name = "<img src=x>";
    tiny.layout.markers[3].name = "<b>&";
    const auto pack = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(pack);
    const std::string html = page_of(*pack, nullptr, {});
    EXPECT_FALSE(has(html, "<img"));
    EXPECT_FALSE(has(html, "<b>"));
    EXPECT_TRUE(has(html, "&lt;img src=x&gt;"));
    EXPECT_TRUE(has(html, "<title>Solve pack a &lt;face&gt; &amp; &quot;b&quot;</title>"));
}

TEST(PackPage, SaysWhatThePackAloneTells) {
    test::TinyRig tiny = test::tiny_rig(24, 5, 200);
    for (Float3& delta : tiny.rig.shapes[1].delta_mm) delta = {0.001F, 0.0F, 0.0F};
    const auto pack = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(pack);
    const std::string html = page_of(*pack, nullptr, {});
    for (const char* part : {"box-constrained QP", "Observability", "Conditioning", "Error by facial region",
                             "Rank and invisible shapes", "1 shapes move the markers by less than 0.5 mm"})
        EXPECT_TRUE(has(html, part)) << part;
    EXPECT_FALSE(has(html, "RBF regression"));
    EXPECT_FALSE(has(html, "Measured:"));
    EXPECT_FALSE(has(html, "error rms"));
    EXPECT_TRUE(has(html, "<tr class=\"flagged\"><td>bulge_1</td>"));
}

TEST(PackPage, HoldsTheTrainingWhereThereWasOne) {
    const test::TinyRig tiny = test::tiny_rig(24, 5, 200);
    TrainOptions options;
    options.solver = SolverKind::kRbf;
    options.takes = {tiny.take};
    options.rbf.centres = 30;
    const auto pack = train(tiny.rig, tiny.layout, options);
    ASSERT_TRUE(pack) << pack.error().message;
    TrainingCurve curve;
    curve.title = "GCV against lambda";
    curve.chart.log_x = true;
    curve.chart.series = {{"gcv", {{1e-4, 2.0}, {1e-2, 1.0}, {1.0, 3.0}}}};
    curve.chart.marked_x = 1e-2;
    const std::string html = page_of(*pack, &tiny.take, {curve});
    for (const char* part : {"RBF regression", " references in ", "Trained on 200 frames",
                             "Coverage:", "Measured: 200 frames", "GCV against lambda", "error rms"})
        EXPECT_TRUE(has(html, part)) << part;
    EXPECT_EQ(html, page_of(*pack, &tiny.take, {curve}));
}

}  // namespace
}  // namespace rig::host
