#include "firmware_host/pack_file/opened_pack.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig {
namespace {

using test::SamplePack;
using test::TempFolder;

void write_file(const std::filesystem::path& path, ByteSpan bytes) {
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void expect_refused(const std::filesystem::path& path, std::string_view fault) {
    const auto opened = open_pack_file(path);
    ASSERT_FALSE(opened.has_value());
    EXPECT_TRUE(opened.error().message.starts_with(path.string() + ": ")) << opened.error().message;
    EXPECT_NE(opened.error().message.find(fault), std::string::npos) << opened.error().message;
}

TEST(OpenPackFile, MapsWhatWasSaved) {
    const TempFolder folder;
    const SamplePack sample({.markers = 9, .shapes = 4, .solver = SolverKind::kRbf});
    ASSERT_TRUE(host::save_pack(folder / "face.pack", sample.view, {.name = "ada"}).has_value());
    auto opened = open_pack_file(folder / "face.pack");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    EXPECT_EQ(opened->manifest().name, "ada");
    EXPECT_EQ(opened->bytes().size(), std::filesystem::file_size(folder / "face.pack"));
    // Views stay good when the owner moves and when the file is replaced by its name.
    const OpenedPack moved = std::move(*opened);
    std::filesystem::remove(folder / "face.pack");
    ASSERT_EQ(moved.pack().basis_mm.size(), sample.basis.size());
    EXPECT_EQ(
        std::memcmp(moved.pack().basis_mm.data(), sample.basis.data(), sample.basis.size() * sizeof(float)),
        0);
    EXPECT_EQ(moved.pack().shape_names[3], "shape_3");
    EXPECT_FALSE(std::filesystem::exists(folder / "face.pack.part"));
}

TEST(OpenPackFile, NamesFileAndFault) {
    const TempFolder folder;
    const SamplePack sample({});
    std::vector<std::byte> bytes = host::write_pack(sample.view, {}, sha256);
    expect_refused(folder / "absent.pack", "No such file");
    expect_refused(folder.path(), "not a regular file");
    ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
    expect_refused(folder / "fifo", "not a regular file");
    write_file(folder / "empty.pack", {});
    expect_refused(folder / "empty.pack", "shorter than a pack header");
    write_file(folder / "cut.pack", ByteSpan(bytes).first(bytes.size() - 1));
    expect_refused(folder / "cut.pack", "cut off");
    bytes[bytes.size() - 1] ^= std::byte{1};
    write_file(folder / "flipped.pack", bytes);
    expect_refused(folder / "flipped.pack", "hash of a section");
    std::ofstream(folder / "huge.pack").put('x');
    std::filesystem::resize_file(folder / "huge.pack", kMaxPackBytes + 1);  // sparse
    expect_refused(folder / "huge.pack", "longer than the largest pack");
}

TEST(OpenPackCopy, TakesBytesAtAnyAddress) {
    const SamplePack sample({});
    std::vector<std::byte> bytes = host::write_pack(sample.view, {}, sha256);
    bytes.insert(bytes.begin(), std::byte{0});
    const auto opened = open_pack_copy(ByteSpan(bytes).subspan(1), "memory");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    const auto refused = open_pack_copy(bytes, "memory");
    ASSERT_FALSE(refused.has_value());
    EXPECT_TRUE(refused.error().message.starts_with("memory: ")) << refused.error().message;
    EXPECT_FALSE(open_pack_copy({}, "nothing").has_value());
}

}  // namespace
}  // namespace rig
