#include "firmware_host/companion/files/npy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

ByteSpan bytes_of(const std::string& text) {
    return std::as_bytes(std::span{text.data(), text.size()});
}

// A file with this header dictionary, padded as NumPy pads, and these data bytes.
std::string npy_file(const std::string& dictionary, const std::string& data, char major = 1) {
    std::string text = dictionary;
    while ((10 + text.size() + 1) % 64 != 0) text += ' ';
    text += '\n';
    std::string file = "\x93NUMPY";
    file += major;
    file += '\0';
    file += static_cast<char>(text.size() & 0xFF);
    file += static_cast<char>(text.size() >> 8);
    return file + text + data;
}

std::string header(const std::string& descr, const std::string& shape, const std::string& order = "False") {
    return "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }";
}

template <class T>
class NpyOf : public testing::Test {};
using Types = testing::Types<float, double, std::int32_t, std::uint8_t, std::int16_t>;
TYPED_TEST_SUITE(NpyOf, Types);

TYPED_TEST(NpyOf, ReadsWhatItWrites) {
    const rig::test::TempFolder folder;
    const NpyArray<TypeParam> array{.shape = {2, 3}, .values = {1, 2, 3, 4, 5, 127}};
    ASSERT_TRUE(write_npy(folder / "a.npy", array));
    const auto back = read_npy<TypeParam>(folder / "a.npy");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->shape, array.shape);
    EXPECT_EQ(back->values, array.values);
}

TEST(Npy, DataStartsAtAMultipleOf64) {
    const rig::test::TempFolder folder;
    for (const std::size_t size : {0U, 1U, 9U, 1000U, 123456U}) {
        const NpyArray<std::uint8_t> array{.shape = {size}, .values = std::vector<std::uint8_t>(size)};
        ASSERT_TRUE(write_npy(folder / "a.npy", array));
        EXPECT_EQ((std::filesystem::file_size(folder / "a.npy") - size) % 64, 0U);
    }
}

TEST(Npy, EmptyAndScalarShapes) {
    const auto empty = parse_npy<float>(bytes_of(npy_file(header("<f4", "(0, 3)"), "")), "e.npy");
    ASSERT_TRUE(empty) << empty.error().message;
    EXPECT_TRUE(empty->values.empty());
    const auto scalar = parse_npy<std::uint8_t>(bytes_of(npy_file(header("|u1", "()"), "\x07")), "s.npy");
    ASSERT_TRUE(scalar) << scalar.error().message;
    EXPECT_EQ(scalar->values, std::vector<std::uint8_t>{7});
}

TEST(Npy, DoublesAreReadAsFloats) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(write_npy(folder / "d.npy", NpyArray<double>{.shape = {2}, .values = {0.5, -3.25}}));
    const auto floats = read_npy<float>(folder / "d.npy");
    ASSERT_TRUE(floats) << floats.error().message;
    EXPECT_EQ(floats->values, (std::vector<float>{0.5F, -3.25F}));
}

TEST(Npy, NanPasses) {
    const rig::test::TempFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    ASSERT_TRUE(write_npy(folder / "n.npy", NpyArray<float>{.shape = {1}, .values = {nan}}));
    const auto back = read_npy<float>(folder / "n.npy");
    ASSERT_TRUE(back);
    EXPECT_TRUE(std::isnan(back->values[0]));
}

struct BadFile {
    std::string name;
    std::string content;
    std::string fault;  // must be in the message
};

class MalformedNpy : public testing::TestWithParam<BadFile> {};

TEST_P(MalformedNpy, IsRefusedByNameAndFault) {
    const auto result = parse_npy<float>(bytes_of(GetParam().content), GetParam().name);
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find(GetParam().name), std::string::npos) << result.error().message;
    EXPECT_NE(result.error().message.find(GetParam().fault), std::string::npos) << result.error().message;
}

const std::string kFour(4, '\0');
const std::string kGood = npy_file(header("<f4", "(1,)"), kFour);

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedNpy,
    testing::Values(
        BadFile{"empty.npy", "", "empty"}, BadFile{"text.npy", "hello, this is text", "not a .npy"},
        BadFile{"short_magic.npy", "\x93NUM", "not a .npy"},
        BadFile{"version2.npy", npy_file(header("<f4", "(1,)"), kFour, 2), "version 2"},
        BadFile{"cut_header.npy", kGood.substr(0, 40), "within its header"},
        BadFile{"cut_preamble.npy", kGood.substr(0, 9), "not a .npy"},
        BadFile{"cut_data.npy", kGood.substr(0, kGood.size() - 1), "cut short"},
        BadFile{"trailing.npy", kGood + "x", "too long"},
        BadFile{"fortran.npy", npy_file(header("<f4", "(1,)", "True"), kFour), "Fortran"},
        BadFile{"big_endian.npy", npy_file(header(">f4", "(1,)"), kFour), "'>f4'"},
        BadFile{"integers.npy", npy_file(header("<i4", "(1,)"), kFour), "'<i4'"},
        BadFile{"structured.npy",
                npy_file("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,), }", kFour),
                "malformed"},
        BadFile{"huge.npy", npy_file(header("<f4", "(70000, 70000)"), kFour), "2^31"},
        BadFile{"overflow.npy", npy_file(header("<f4", "(4294967296, 4294967296)"), kFour), "2^31"},
        BadFile{"overflow0.npy", npy_file(header("<f4", "(99999999999999999999,)"), kFour), "malformed"},
        BadFile{"negative.npy", npy_file(header("<f4", "(-1,)"), kFour), "malformed"},
        BadFile{"deep.npy", npy_file(header("<f4", "(1,1,1,1,1,1,1,1,1)"), kFour), "malformed"},
        BadFile{"no_shape.npy", npy_file("{'descr': '<f4', 'fortran_order': False}", kFour), "malformed"},
        BadFile{"twice.npy",
                npy_file("{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (1,)}", kFour),
                "malformed"},
        BadFile{"unclosed.npy", npy_file("{'descr': '<f4", kFour), "malformed"}),
    [](const auto& row) { return row.param.name.substr(0, row.param.name.find('.')); });

TEST(Npy, MissingFileIsNamed) {
    const auto result = read_npy<float>("no/such/file.npy");
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find("no/such/file.npy"), std::string::npos);
}

TEST(Npy, EveryTruncationIsRefused) {
    for (std::size_t size = 0; size < kGood.size(); ++size) {
        EXPECT_FALSE(parse_npy<float>(bytes_of(kGood.substr(0, size)), "cut.npy")) << size;
    }
    EXPECT_TRUE(parse_npy<float>(bytes_of(kGood), "whole.npy"));
}

}  // namespace
}  // namespace rig::host
