#include "firmware_host/companion/files/whole_file.hpp"

#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(WholeFile, RoundTripAndReplacement) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(write_whole_text(folder / "a", std::string(200000, 'x')));
    EXPECT_EQ(read_whole_text(folder / "a").value().size(), 200000U);
    ASSERT_TRUE(write_whole_text(folder / "a", "short"));
    EXPECT_EQ(read_whole_text(folder / "a").value(), "short");
    ASSERT_TRUE(write_whole_text(folder / "a", ""));
    EXPECT_EQ(read_whole_text(folder / "a").value(), "");
}

TEST(WholeFile, FoldersAndMissingFilesAreNamed) {
    const rig::test::TempFolder folder;
    const auto is_folder = read_whole_file(folder.path());
    ASSERT_FALSE(is_folder);
    EXPECT_NE(is_folder.error().message.find("is a folder"), std::string::npos);
    const auto missing = read_whole_text(folder / "missing.txt");
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.find("missing.txt"), std::string::npos);
}

TEST(OutputFolder, IsMadeButNeverOverwrittenUnasked) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(make_output_folder(folder / "new/deep", false));
    EXPECT_TRUE(make_output_folder(folder / "new/deep", false));  // still empty
    ASSERT_TRUE(write_whole_text(folder / "new/deep/file", "x"));
    EXPECT_FALSE(make_output_folder(folder / "new/deep", false));
    EXPECT_TRUE(make_output_folder(folder / "new/deep", true));
    EXPECT_TRUE(std::filesystem::exists(folder / "new/deep/file"));
    EXPECT_FALSE(make_output_folder(folder / "new/deep/file", true));
}

TEST(Printable, CutsAndMasks) {
    EXPECT_EQ(printable("a\x01\nb"), "a??b");
    EXPECT_EQ(printable(std::string(100, 'x')).size(), 43U);
}

}  // namespace
}  // namespace rig::host
