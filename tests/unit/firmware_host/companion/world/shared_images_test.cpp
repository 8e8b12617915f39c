#include "firmware_host/companion/world/shared_images.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(SharedImages, CannotBeResizedBehindTheDaemonsBack) {
    const auto memory = SharedImages::create(8192);
    ASSERT_TRUE(memory);
    EXPECT_EQ(memory->bytes().size(), 8192U);
    EXPECT_NE(::ftruncate(memory->descriptor(), 0), 0);
    EXPECT_NE(::ftruncate(memory->descriptor(), 16384), 0);
    memory->bytes()[8191] = 7;
    std::uint8_t read_back = 0;
    ASSERT_EQ(::pread(memory->descriptor(), &read_back, 1, 8191), 1);
    EXPECT_EQ(read_back, 7);
}

TEST(ListenAt, ReplacesADeadSocketAndNothingElse) {
    const rig::test::TempFolder folder;
    {
        const auto first = listen_at(folder / "s");
        ASSERT_TRUE(first) << first.error().message;
        const auto second = listen_at(folder / "s");
        ASSERT_FALSE(second);
        EXPECT_NE(second.error().message.find("another world"), std::string::npos);
    }
    EXPECT_TRUE(std::filesystem::exists(folder / "s")) << "left behind by a world that died";
    EXPECT_TRUE(listen_at(folder / "s"));
    std::ofstream(folder / "file") << "precious";
    EXPECT_FALSE(listen_at(folder / "file"));
    EXPECT_TRUE(std::filesystem::exists(folder / "file"));
    EXPECT_FALSE(listen_at(folder / std::string(200, 'x')));
    EXPECT_FALSE(listen_at(folder / "absent/s"));
    EXPECT_FALSE(listen_at(""));
}

}  // namespace
}  // namespace rig::host
