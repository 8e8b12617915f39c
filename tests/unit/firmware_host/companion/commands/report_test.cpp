// The verb: a page from a pack alone, with what training left beside it, and without it when it is of another
// pack.
#include <gtest/gtest.h>

#include <string>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/companion/train/training_record.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace rig::host {
namespace {

class ReportVerb : public testing::Test {
  protected:
    test::VerbOutcome report(std::vector<std::string> more = {}) {
        std::vector<std::string> arguments{"report", pack_path(), "--out", page_path()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return test::run_verb(add_report_verb, arguments);
    }
    void make_pack(SolverKind solver) {
        const test::TinyRig tiny = test::tiny_rig(24, 5, 200);
        TrainOptions options;
        options.solver = solver;
        options.takes = {tiny.take};
        options.rbf.centres = 30;
        const auto pack = train(tiny.rig, tiny.layout, options);
        ASSERT_TRUE(pack) << pack.error().message;
        ASSERT_TRUE(save_pack(pack_path(), pack->view(), {.name = "tiny"}));
        if (solver != SolverKind::kRbf) return;
        const auto opened = open_pack_file(pack_path());
        ASSERT_TRUE(opened);
        record = {uuid_text(opened->manifest()), *pack->report.rbf, *pack->report.coverage,
                  pack->shape_names};
    }
    void save_record(const std::string& name) {
        ASSERT_TRUE(write_whole_text(folder / name, training_record_text(record)));
    }
    bool page_has(std::string_view part) {
        const auto text = read_whole_text(page_path());
        EXPECT_TRUE(text);
        return text && text->find(part) != std::string::npos;
    }
    std::string pack_path() { return (folder / "tiny.pack").string(); }
    std::string page_path() { return (folder / "page.html").string(); }

    test::TempFolder folder;
    TrainingRecord record;
};

TEST_F(ReportVerb, OfAPackThatLearnedNothing) {
    make_pack(SolverKind::kBoxQp);
    const auto outcome = report();
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_NE(outcome.out.find("5 shapes, rank 5"), std::string::npos) << outcome.out;
    EXPECT_TRUE(page_has("Solve pack tiny"));
    EXPECT_TRUE(page_has("Nothing of this pack was chosen by cross-validation"));
}

TEST_F(ReportVerb, DrawsWhatTrainingLeftBesideThePack) {
    make_pack(SolverKind::kRbf);
    EXPECT_EQ(report().exit_code, kExitOk);
    EXPECT_FALSE(page_has("GCV path"));
    save_record("tiny.training.csv");
    const auto outcome = report();
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_TRUE(page_has("GCV path"));
    EXPECT_TRUE(page_has("Coverage"));
}

TEST_F(ReportVerb, KnowsCurvesOfAnotherPack) {
    make_pack(SolverKind::kRbf);
    record.pack_uuid[0] = record.pack_uuid[0] == '0' ? '1' : '0';
    save_record("tiny.training.csv");
    const auto found = report();
    EXPECT_EQ(found.exit_code, kExitOk);
    EXPECT_NE(found.err.find("of another pack"), std::string::npos) << found.err;
    EXPECT_FALSE(page_has("GCV path"));
    const auto named = report({"--training", (folder / "tiny.training.csv").string()});
    EXPECT_EQ(named.exit_code, kExitInput);
    EXPECT_NE(named.err.find("of another pack"), std::string::npos) << named.err;
    EXPECT_EQ(report({"--training", (folder / "none.csv").string()}).exit_code, kExitInput);
}

}  // namespace
}  // namespace rig::host
