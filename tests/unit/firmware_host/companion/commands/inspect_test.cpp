// The verb from end to end: the built-in performance is rendered, a pack is trained for its helmet, the
// pictures are inspected, and the page says what is in them; and what the verb refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace rig::host {
namespace {

class InspectVerb : public testing::Test {
  protected:
    test::VerbOutcome inspect(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "inspect");
        return test::run_verb(add_inspect_verb, std::move(arguments));
    }
    std::string path(const std::string& name) { return (folder / name).string(); }
    std::string page() {
        const auto text = read_whole_text(folder / "page.html");
        EXPECT_TRUE(text);
        return text ? *text : std::string();
    }
    // The neutral face of a small rig, `frames` times.
    void make_stream(std::size_t frames) {
        const test::TinyRig tiny = test::tiny_rig(24, 5, 60);
        const auto pack = train(tiny.rig, tiny.layout, {});
        ASSERT_TRUE(pack) << pack.error().message;
        ASSERT_TRUE(save_pack(folder / "tiny.pack", pack->view(), {.name = "tiny"}));
        const std::vector<float> neutral = marker_model(tiny.rig, tiny.layout).neutral_mm;
        NpyArray<float> stream{{frames, 24, 3}, {}};
        for (std::size_t f = 0; f < frames; ++f)
            stream.values.insert(stream.values.end(), neutral.begin(), neutral.end());
        ASSERT_TRUE(write_npy(folder / "m.npy", stream));
    }
    test::TempFolder folder;
};

TEST_F(InspectVerb, RenderedPicturesFromEndToEnd) {
    const auto ran = [](void (*add)(CLI::App&, int&), std::vector<std::string> arguments) {
        const test::VerbOutcome outcome = test::run_verb(add, std::move(arguments));
        ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    };
    ran(add_sample_verb, {"sample", path("head")});
    ran(add_world_verb, {"world", "--calibration", path("cameras.json"), "--cameras", "2"});
    ran(add_train_verb, {"train", "--rig", path("head"), "--layout", "60", "--cameras", path("cameras.json"),
                         "--out", path("face.pack")});
    ran(add_world_verb, {"world", "--rig", path("head"), "--take", path("head/take.csv"), "--frames", "24",
                         "--images", path("pictures")});
    std::filesystem::remove(folder / "pictures/f00010_a.pgm");
    const auto outcome = inspect({path("pictures"), "--pack", path("face.pack"), "--out", path("page.html")});
    ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_NE(outcome.out.find("24 frames at 60 Hz, 0.4 s"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("longest loss 0 ms"), std::string::npos) << outcome.out;
    const std::string html = page();
    for (const char* part : {"Take pictures", "most markers hidden", "data:image/jpeg;base64,", "camera a:",
                             "diameter of a blob, px", "contrast of a blob", "residual of a marker, mm"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    EXPECT_EQ(html.find("<script"), std::string::npos);
    EXPECT_LT(html.size(), std::size_t{2} << 20);
}

TEST_F(InspectVerb, AStreamIsInspectedWithItsPackAlone) {
    make_stream(30);
    const auto outcome =
        inspect({path("m.npy"), "--pack", path("tiny.pack"), "--rate", "30", "--out", path("page.html")});
    ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_NE(outcome.out.find("30 frames at 30 Hz, 1.0 s; markers visible 100.00 %"), std::string::npos)
        << outcome.out;
    const auto without = inspect({path("m.npy"), "--out", path("page.html")});
    EXPECT_EQ(without.exit_code, kExitUsage);
    EXPECT_NE(without.err.find("--pack"), std::string::npos) << without.err;
    const auto nowhere =
        inspect({path("m.npy"), "--pack", path("tiny.pack"), "--out", path("no/such/page.html")});
    EXPECT_EQ(nowhere.exit_code, kExitOutput);
    EXPECT_NE(nowhere.err.find("no/such/page.html"), std::string::npos) << nowhere.err;
}

TEST_F(InspectVerb, RefusesByNameWithARemedy) {
    make_stream(2);
    std::ofstream(folder / "w.csv") << "frame,time_s,smile\n0,0,1\n";
    const auto table = inspect({path("w.csv"), "--pack", path("tiny.pack"), "--out", path("page.html")});
    EXPECT_EQ(table.exit_code, kExitInput);
    EXPECT_NE(table.err.find("w.csv"), std::string::npos) << table.err;
    EXPECT_EQ(inspect({path("none"), "--pack", path("tiny.pack"), "--out", path("page.html")}).exit_code,
              kExitInput);
    EXPECT_EQ(inspect({path("m.npy"), "--pack", path("none.pack"), "--out", path("page.html")}).exit_code,
              kExitInput);
    EXPECT_EQ(inspect({path("m.npy")}).exit_code, kExitUsage);
    std::filesystem::create_directory(folder / "empty");
    const auto empty = inspect({path("empty"), "--pack", path("tiny.pack"), "--out", path("page.html")});
    EXPECT_EQ(empty.exit_code, kExitInput);
    EXPECT_NE(empty.err.find("no .png"), std::string::npos) << empty.err;
    EXPECT_EQ(
        inspect({path("empty"), "--pack", path("tiny.pack"), "--unlabelled", "--out", path("page.html")})
            .exit_code,
        kExitUsage);
    EXPECT_FALSE(std::filesystem::exists(folder / "page.html"));
}

}  // namespace
}  // namespace rig::host
