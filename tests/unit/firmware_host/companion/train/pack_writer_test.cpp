#include "firmware_host/companion/train/pack_writer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "firmware_host/pack_file/opened_pack.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

using test::SamplePack;
using test::TempFolder;

TEST(WritePack, IsDeterministic) {
    const SamplePack a({.solver = SolverKind::kRbf});
    const SamplePack b({.solver = SolverKind::kRbf});
    EXPECT_EQ(write_pack(a.view, {}, sha256), write_pack(b.view, {}, sha256));
}

TEST(WritePack, KeepsTheManifestInOneRead) {
    PackIdentity identity;
    identity.name = std::string(kMaxNameBytes, 'n');
    identity.boards.assign(kMaxPackBoards, std::string(kMaxNameBytes, 'b'));
    const SamplePack sample(
        {.markers = kMaxMarkers, .shapes = kMaxShapes, .solver = SolverKind::kRbf, .cameras = kMaxCameras});
    const auto opened = open_pack_copy(write_pack(sample.view, identity, sha256), "largest");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    EXPECT_LE(opened->manifest().manifest_bytes, kMaxManifestBytes);
}

// An empty vector of cameras lies where the name before it ends, aligned or not.
TEST(WritePack, OpensWhateverTheLengthOfItsName) {
    for (const std::uint8_t cameras : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{2}}) {
        const SamplePack sample({.cameras = cameras});
        for (std::size_t length = 1; length <= kMaxNameBytes; ++length) {
            PackIdentity identity;
            identity.name = std::string(length, 'n');
            const auto opened = open_pack_copy(write_pack(sample.view, identity, sha256), "named");
            ASSERT_TRUE(opened.has_value())
                << length << " bytes, " << int{cameras} << " cameras: " << opened.error().message;
        }
    }
}

TEST(SavePack, WritesNothingThatCouldNotBeOpened) {
    const TempFolder folder;
    SamplePack sample({});
    sample.sigma[0] = 0.0F;
    const auto saved = save_pack(folder / "bad.pack", sample.view, {});
    ASSERT_FALSE(saved.has_value());
    EXPECT_NE(saved.error().message.find("was not written"), std::string::npos) << saved.error().message;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(SavePack, LeavesTheOldFileWhenItCannotWrite) {
    const TempFolder folder;
    const SamplePack sample({});
    const auto saved = save_pack(folder / "no_such_folder/face.pack", sample.view, {});
    ASSERT_FALSE(saved.has_value());
    EXPECT_NE(saved.error().message.find("cannot be written"), std::string::npos) << saved.error().message;
}

TEST(SavePack, ReplacesAnOlderPack) {
    const TempFolder folder;
    SamplePack sample({});
    ASSERT_TRUE(save_pack(folder / "face.pack", sample.view, {.name = "first"}).has_value());
    ASSERT_TRUE(save_pack(folder / "face.pack", sample.view, {.name = "second"}).has_value());
    const auto opened = open_pack_file(folder / "face.pack");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    EXPECT_EQ(opened->manifest().name, "second");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

}  // namespace
}  // namespace rig::host
