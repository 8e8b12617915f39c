// The verb as a script meets it: files, the table, exit codes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/sample/sample.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace {

using namespace rig;
using test::VerbOutcome;
namespace fs = std::filesystem;

class KeyShapesVerb : public testing::Test {
  protected:
    void SetUp() override { ASSERT_TRUE(host::save_sample(rig())); }

    fs::path rig() const { return folder.path() / "sample"; }
    fs::path keys() const { return folder.path() / "keys"; }

    VerbOutcome run(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{
            "keyshapes", "--rig",        rig().string(), "--take", (rig() / "take.csv").string(),
            "--out",     keys().string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return test::run_verb(host::add_keyshapes_verb, std::move(arguments));
    }

    std::size_t lines_of(const char* name) const {
        std::ifstream file(keys() / name);
        std::size_t count = 0;
        for (std::string line; std::getline(file, line);) ++count;
        return count;
    }

    test::TempFolder folder;
};

TEST_F(KeyShapesVerb, WritesShapesTableAndPicture) {
    const VerbOutcome outcome = run({"--method", "spread", "--count", "6", "--most", "8", "--axes", "xy"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("6 key shapes of 1200 frames"), std::string::npos) << outcome.out;
    EXPECT_EQ(lines_of("key_shapes.csv"), 1U + 6U);
    EXPECT_EQ(lines_of("error.csv"), 1U + 3U * 3U + 1U);  // 4, 6 and 8 of three methods, and the hull
    ASSERT_TRUE(fs::exists(keys() / "error.png"));
    EXPECT_GT(fs::file_size(keys() / "error.png"), 4000U);
}

TEST_F(KeyShapesVerb, SaysWhichMethodsAndRegionsThereAre) {
    const VerbOutcome method = run({"--method", "guess"});
    EXPECT_EQ(method.exit_code, host::kExitUsage);
    EXPECT_NE(method.err.find("spread, clusters2, clusters3 or hull"), std::string::npos) << method.err;
    const VerbOutcome region = run({"--region", "ear"});
    EXPECT_EQ(region.exit_code, host::kExitUsage);
    EXPECT_NE(region.err.find("eyes mouth"), std::string::npos) << region.err;
    EXPECT_FALSE(fs::exists(keys()));
}

}  // namespace
