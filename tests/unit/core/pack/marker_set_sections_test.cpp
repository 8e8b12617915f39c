#include "core/pack/marker_set_sections.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "core/pack/open_pack.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/aligned_bytes.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/unit/core/pack/section_checks.hpp"

namespace rig {
namespace {

using host::write_pack;
using test::AlignedBytes;
using test::error_of;
using test::expect_equal;
using test::SamplePack;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(MarkerSetSections, GiveBackWhatWasWrittenWithAnySolver) {
    for (const SolverKind solver : {SolverKind::kBoxQp, SolverKind::kRbf, SolverKind::kExamples}) {
        const SamplePack sample({.markers = 9, .shapes = 5, .solver = solver, .marker_sets = true});
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        const auto opened = open_pack(bytes.span(), sha256);
        ASSERT_TRUE(opened.has_value()) << pack_error_text(opened.error());
        ASSERT_EQ(opened->marker_set_count, 3);
        for (std::size_t f = 0; f < 3; ++f) {
            const MarkerSetModel& got = opened->marker_sets[f];
            EXPECT_EQ(got.name, sample.view.marker_sets[f].name);
            EXPECT_EQ(got.level, f);
            EXPECT_EQ(got.mode_count, 4 - f);
            expect_equal(got.markers, sample.sets[f].markers);
            expect_equal(got.mean_mm, sample.sets[f].mean);
            expect_equal(got.modes, sample.sets[f].modes);
            expect_equal(got.variance_mm2, sample.sets[f].variance);
            expect_equal(got.residual_mm2, sample.sets[f].residual);
        }
    }
}

TEST(MarkerSetSections, ArePresentAllTogetherOrNotAtAll) {
    const SamplePack without({});
    const AlignedBytes bytes(write_pack(without.view, {}, sha256));
    const auto opened = open_pack(bytes.span(), sha256);
    ASSERT_TRUE(opened.has_value());
    EXPECT_EQ(opened->marker_set_count, 0) << "packs of before";
}

TEST(MarkerSetSections, RefuseEveryTruncationAndBitFlip) {
    const SamplePack sample({.marker_sets = true});
    AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    ASSERT_TRUE(open_pack(bytes.span(), sha256).has_value());
    for (std::size_t length = 0; length < bytes.span().size(); length += 7)
        ASSERT_FALSE(open_pack(bytes.span().first(length), sha256).has_value()) << length;
    for (std::size_t i = 0; i < bytes.span().size(); ++i) {
        bytes[i] ^= std::byte{1} << (i % 8);
        ASSERT_FALSE(open_pack(bytes.span(), sha256).has_value()) << i;
        bytes[i] ^= std::byte{1} << (i % 8);
    }
}

struct BadSet {
    const char* what;
    void (*change)(SamplePack&);
    PackError error;
};

TEST(MarkerSetSections, RefuseEachBadSetByItsOwnRule) {
    const BadSet cases[] = {
        {"first set is not the whole face", [](SamplePack& p) { p.view.marker_sets[0].marker_count = 3; },
         PackError::kMarkerSetTable},
        {"first set on level 1", [](SamplePack& p) { p.view.marker_sets[0].level = 1; },
         PackError::kMarkerSetTable},
        {"a second whole face", [](SamplePack& p) { p.view.marker_sets[1].level = 0; },
         PackError::kMarkerSetTable},
        {"levels fall",
         [](SamplePack& p) {
             p.view.marker_sets[1].level = 2;
             p.view.marker_sets[2].level = 1;
         },
         PackError::kMarkerSetTable},
        {"too deep", [](SamplePack& p) { p.view.marker_sets[2].level = 3; }, PackError::kMarkerSetTable},
        {"no markers", [](SamplePack& p) { p.view.marker_sets[2].marker_count = 0; },
         PackError::kMarkerSetTable},
        {"no modes", [](SamplePack& p) { p.view.marker_sets[1].mode_count = 0; }, PackError::kMarkerSetTable},
        {"more modes than coordinates", [](SamplePack& p) { p.view.marker_sets[2].mode_count = 7; },
         PackError::kMarkerSetTable},
        {"more modes than core holds",
         [](SamplePack& p) { p.view.marker_sets[0].mode_count = kMaxModes + 1; }, PackError::kMarkerSetTable},
        {"one mode more than there is", [](SamplePack& p) { p.view.marker_sets[1].mode_count = 4; },
         PackError::kSectionLength},
        {"marker beyond the pack's", [](SamplePack& p) { p.sets[1].markers.back() = 4; },
         PackError::kMarkerSetMarkers},
        {"markers fall", [](SamplePack& p) { p.sets[2].markers = {1, 0}; }, PackError::kMarkerSetMarkers},
        {"marker twice", [](SamplePack& p) { p.sets[2].markers = {1, 1}; }, PackError::kMarkerSetMarkers},
        {"mode too long", [](SamplePack& p) { p.sets[1].modes[0] = 0.7F; }, PackError::kMarkerSetModes},
        {"mode beyond 1", [](SamplePack& p) { p.sets[1].modes[0] = -1.5F; }, PackError::kMarkerSetModes},
        {"modes not square to each other", [](SamplePack& p) { p.sets[0].modes[12] = 0.1F; },
         PackError::kMarkerSetModes},
        {"mode nan", [](SamplePack& p) { p.sets[0].modes[3] = kNan; }, PackError::kNotFinite},
        {"variance zero", [](SamplePack& p) { p.sets[2].variance[1] = 0.0F; }, PackError::kMarkerSetVariance},
        {"variances rise", [](SamplePack& p) { p.sets[0].variance[2] = 9.0F; },
         PackError::kMarkerSetVariance},
        {"residual negative", [](SamplePack& p) { p.sets[0].residual[0] = -0.01F; },
         PackError::kMarkerSetVariance},
        {"mean far", [](SamplePack& p) { p.sets[0].mean[0] = 2e4F; }, PackError::kMagnitude},
        {"mean inf", [](SamplePack& p) { p.sets[1].mean[2] = HUGE_VALF; }, PackError::kNotFinite},
        {"name empty", [](SamplePack& p) { p.view.marker_sets[1].name = ""; }, PackError::kNames},
        {"name twice", [](SamplePack& p) { p.view.marker_sets[1].name = "face"; }, PackError::kNameTwice},
    };
    for (const BadSet& bad : cases) {
        SCOPED_TRACE(bad.what);
        SamplePack sample({.marker_sets = true});
        bad.change(sample);
        const PackError error = error_of(sample.view);
        EXPECT_EQ(error, bad.error) << pack_error_text(error);
    }
}

TEST(MarkerSetSections, RefuseReservedBytesAndOddLengthsOfTheTable) {
    std::vector<std::byte> table(kMarkerSetRecordBytes, std::byte{0});
    store(MutableByteSpan(table), 2, std::uint16_t{4});
    store(MutableByteSpan(table), 4, std::uint16_t{2});
    SolvePack pack;
    PackCounts counts;
    counts.markers = 4;
    PackCounts read = counts;
    ASSERT_TRUE(read_marker_set_table(table, read, pack).has_value());
    EXPECT_EQ(read.set_mode_floats, 24U);
    for (const std::size_t at : {1U, 6U, 7U}) {
        std::vector<std::byte> bad = table;
        bad[at] = std::byte{1};
        PackCounts unused = counts;
        EXPECT_FALSE(read_marker_set_table(bad, unused, pack).has_value()) << at;
    }
    for (const std::size_t length : {0U, 7U, 9U}) {
        std::vector<std::byte> odd(length, std::byte{0});
        PackCounts unused = counts;
        EXPECT_FALSE(read_marker_set_table(odd, unused, pack).has_value()) << length;
    }
}

}  // namespace
}  // namespace rig
