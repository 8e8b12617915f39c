#include "firmware_host/companion/report/pack_page.hpp"

#include <gtest/gtest.h>

#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/text_checks.hpp"

namespace rig::host {
namespace {

using test::has;

std::string page_of(const TrainedPack& pack, const Take* take, bool with_training) {
    const SolvePack view = pack.view();
    const auto analysis = analyse_pack(view, take);
    EXPECT_TRUE(analysis);
    std::optional<TrainingRecord> record;
    if (with_training && pack.report.rbf)
        record = TrainingRecord{"0", *pack.report.rbf, *pack.report.coverage, pack.shape_names};
    return pack_page({.name = "a <face> & \"b\"", .pack = view, .analysis = *analysis, .training = record});
}

TEST(PackPage, NamesAreData) {
    test::TinyRig tiny = test::tiny_rig(24, 5, 200);
    tiny.rig.shapes[2].name = "<img src=x>";
    tiny.layout.markers[3].name = "<b>&";
    const auto pack = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(pack);
    const std::string html = page_of(*pack, nullptr, true);
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
    const std::string html = page_of(*pack, nullptr, true);
    for (const char* part : {"box-constrained QP", "Observability", "Conditioning", "Error by facial region",
                             "Rank and invisible shapes", "1 shapes move the markers by less than 0.5 mm"})
        EXPECT_TRUE(has(html, part)) << part;
    EXPECT_TRUE(has(html, "Nothing of this pack was chosen by cross-validation"));
    EXPECT_FALSE(has(html, "GCV path"));
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
    const std::string html = page_of(*pack, &tiny.take, true);
    for (const char* part : {"Cross-validation", " references in ", "Trained on 200 frames", "GCV path",
                             "Coverage", "Measured: 200 frames", "error rms"})
        EXPECT_TRUE(has(html, part)) << part;
    EXPECT_EQ(html, page_of(*pack, &tiny.take, true));
    const std::string without = page_of(*pack, nullptr, false);
    EXPECT_TRUE(has(without, "The curves of the training are not in a pack"));
    EXPECT_FALSE(has(without, "GCV path"));
    EXPECT_FALSE(has(without, "Coverage"));
}

}  // namespace
}  // namespace rig::host
