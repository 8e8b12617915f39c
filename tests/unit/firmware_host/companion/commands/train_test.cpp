// What training says before it replaces a pack.
#include <gtest/gtest.h>

#include <string>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace rig::host {
namespace {

TEST(TrainVerb, MarksOfTheHelmetAreNotLostInSilence) {
    const test::TempFolder folder;
    const auto at = [&](const char* name) { return (folder / name).string(); };
    ASSERT_EQ(test::run_verb(add_sample_verb, {"sample", at("head")}).exit_code, kExitOk);
    ASSERT_EQ(test::run_verb(add_world_verb, {"world", "--calibration", at("cameras.json"), "--cameras", "2"})
                  .exit_code,
              kExitOk);
    const auto trained = [&] {
        const auto outcome =
            test::run_verb(add_train_verb, {"train", "--rig", at("head"), "--layout", "60", "--cameras",
                                            at("cameras.json"), "--out", at("face.pack")});
        EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
        return outcome.err;
    };
    const test::SamplePack before({.cameras = 2, .reference_marks = 3});
    ASSERT_TRUE(save_pack(at("face.pack"), before.view, {}).has_value());
    EXPECT_NE(trained().find("held 3 reference marks of the helmet"), std::string::npos);
    EXPECT_EQ(trained().find("reference marks"), std::string::npos) << "there are none left to lose";
}

}  // namespace
}  // namespace rig::host
