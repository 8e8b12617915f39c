#include "core/pack/region_sections.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "core/base/float_kernels.hpp"
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

TEST(RegionSections, GiveBackWhatWasWritten) {
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        const SamplePack sample({.markers = 9, .shapes = 5, .solver = solver, .region_examples = 20});
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        const auto opened = open_pack(bytes.span(), sha256);
        ASSERT_TRUE(opened.has_value()) << pack_error_text(opened.error());
        ASSERT_EQ(opened->region_count, 2);
        for (std::size_t r = 0; r < 2; ++r) {
            const RegionModel& got = opened->regions[r];
            EXPECT_EQ(got.name, sample.view.regions[r].name);
            EXPECT_EQ(got.solver, sample.view.regions[r].solver);
            EXPECT_EQ(got.example_count, r == 0 ? 20 : 2);
            EXPECT_EQ(got.marker_count, sample.regions[r].markers.size());
            expect_equal(got.markers, sample.regions[r].markers);
            expect_equal(got.marker_blend, sample.regions[r].marker_blend);
            expect_equal(got.origin_mm, sample.regions[r].origin);
            expect_equal(got.examples_mm, sample.regions[r].examples);
            expect_equal(got.shapes, sample.regions[r].shapes);
            expect_equal(got.shape_blend, sample.regions[r].shape_blend);
        }
        // Rows of the first region's examples start where vector loads want them.
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(opened->regions[0].examples_mm.data()) % kPackAlignment,
                  0U);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(opened->regions[1].examples_mm.data()) % kPackAlignment,
                  0U);
    }
}

TEST(RegionSections, RefuseEveryTruncationAndBitFlip) {
    const SamplePack sample({.solver = SolverKind::kExamples});
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

struct BadRegion {
    const char* what;
    void (*change)(SamplePack&);
    PackError error;
};

TEST(RegionSections, RefuseEachBadRegionByItsOwnRule) {
    const BadRegion cases[] = {
        {"no markers", [](SamplePack& p) { p.view.regions[0].marker_count = 0; }, PackError::kRegionTable},
        {"more markers than there are", [](SamplePack& p) { p.view.regions[0].marker_count = 5; },
         PackError::kRegionTable},
        {"no examples", [](SamplePack& p) { p.view.regions[1].example_count = 0; }, PackError::kRegionTable},
        {"too many examples", [](SamplePack& p) { p.view.regions[1].example_count = kMaxRegionShapes + 1; },
         PackError::kRegionTable},
        {"unknown solver", [](SamplePack& p) { p.view.regions[1].solver = static_cast<RegionSolver>(2); },
         PackError::kRegionTable},
        {"none of the pack's kind",
         [](SamplePack& p) {
             p.view.solver =
                 p.view.solver == SolverKind::kExamples ? SolverKind::kKeyShapes : SolverKind::kExamples;
             p.view.regions[1] = p.view.regions[0];
         },
         PackError::kRegionTable},
        {"one marker fewer than listed", [](SamplePack& p) { p.view.regions[0].marker_count = 2; },
         PackError::kSectionLength},
        {"one example more than there is", [](SamplePack& p) { p.view.regions[0].example_count = 4; },
         PackError::kSectionLength},
        {"marker beyond the pack's", [](SamplePack& p) { p.regions[1].markers.back() = 4; },
         PackError::kRegionMarkers},
        {"marker 65535", [](SamplePack& p) { p.regions[1].markers.back() = 65535; },
         PackError::kRegionMarkers},
        {"markers fall", [](SamplePack& p) { p.regions[0].markers = {0, 2, 1}; }, PackError::kRegionMarkers},
        {"marker twice", [](SamplePack& p) { p.regions[0].markers = {0, 1, 1}; }, PackError::kRegionMarkers},
        {"blend zero", [](SamplePack& p) { p.regions[0].marker_blend[0] = 0.0F; },
         PackError::kRegionMarkerBlend},
        {"blend of a lone marker", [](SamplePack& p) { p.regions[0].marker_blend[0] = 0.9F; },
         PackError::kRegionMarkerBlend},
        {"blends over 1 together", [](SamplePack& p) { p.regions[0].marker_blend[2] = 0.3F; },
         PackError::kRegionMarkerBlend},
        {"blend above 1", [](SamplePack& p) { p.regions[0].marker_blend[0] = 1.1F; }, PackError::kMagnitude},
        {"blend nan", [](SamplePack& p) { p.regions[1].marker_blend[0] = kNan; }, PackError::kNotFinite},
        {"example nan", [](SamplePack& p) { p.regions[1].examples[0] = kNan; }, PackError::kNotFinite},
        {"example far", [](SamplePack& p) { p.regions[0].examples[1] = 2e4F; }, PackError::kMagnitude},
        {"padding", [](SamplePack& p) { p.regions[0].examples[5] = 1e-9F; }, PackError::kRegionExamples},
        {"origin far", [](SamplePack& p) { p.regions[1].origin[0] = -2e4F; }, PackError::kMagnitude},
        {"shape weight inf", [](SamplePack& p) { p.regions[1].shapes[0] = HUGE_VALF; },
         PackError::kNotFinite},
        {"shape weight huge", [](SamplePack& p) { p.regions[1].shapes[0] = 1e4F; }, PackError::kMagnitude},
        {"shape blend negative", [](SamplePack& p) { p.regions[1].shape_blend[0] = -0.5F; },
         PackError::kRegionShapeBlend},
        {"shape blends over 1", [](SamplePack& p) { p.regions[1].shape_blend[0] = 0.6F; },
         PackError::kRegionShapeBlend},
        {"name empty", [](SamplePack& p) { p.view.regions[0].name = ""; }, PackError::kNames},
        {"name twice", [](SamplePack& p) { p.view.regions[0].name = "lower"; }, PackError::kNameTwice},
    };
    for (const BadRegion& bad : cases) {
        for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
            SCOPED_TRACE(bad.what);
            SamplePack sample({.solver = solver});
            bad.change(sample);
            const PackError error = error_of(sample.view);
            EXPECT_EQ(error, bad.error) << pack_error_text(error);
        }
    }
}

TEST(RegionSections, RefuseOriginsThatTheirSolversDoNotHave) {
    SamplePack nnls({.solver = SolverKind::kKeyShapes});
    nnls.regions[0].origin[4] += 0.5F;  // no longer the centroid
    EXPECT_EQ(error_of(nnls.view), PackError::kRegionOrigin);
    SamplePack simplex({.solver = SolverKind::kExamples});
    simplex.regions[0].examples[16] += 0.5F;  // no longer about their mean
    EXPECT_EQ(error_of(simplex.view), PackError::kRegionExamples);
}

TEST(RegionSections, RefuseReservedBytesOfTheTable) {
    for (const std::size_t at : {1U, 6U, 7U, 9U}) {
        std::vector<std::byte> table(2 * kRegionRecordBytes, std::byte{0});
        store(MutableByteSpan(table), 2, std::uint16_t{3});
        store(MutableByteSpan(table), 4, std::uint16_t{2});
        store(MutableByteSpan(table), 10, std::uint16_t{3});
        store(MutableByteSpan(table), 12, std::uint16_t{2});
        SolvePack pack;
        PackCounts counts;
        counts.markers = 4;
        counts.regions = 2;
        PackCounts read = counts;
        ASSERT_TRUE(read_region_table(table, SolverKind::kKeyShapes, read, pack).has_value());
        EXPECT_EQ(read.region_example_floats, 2U * 3U * 3U * padded(2));
        table[at] = std::byte{1};
        const auto bad = read_region_table(table, SolverKind::kKeyShapes, counts, pack);
        ASSERT_FALSE(bad.has_value()) << at;
        EXPECT_EQ(bad.error(), PackError::kRegionTable);
    }
}

TEST(RegionSections, RefuseTensorsThatDoNotFit) {
    SamplePack sample({.solver = SolverKind::kKeyShapes});
    RegionModel& region = sample.view.regions[0];
    for (std::span<const float>* tensor : {&region.marker_blend, &region.origin_mm, &region.examples_mm,
                                           &region.shapes, &region.shape_blend}) {
        const std::span<const float> whole = *tensor;
        *tensor = whole.first(whole.size() - 1);
        EXPECT_EQ(error_of(sample.view), PackError::kSectionLength);
        *tensor = whole;
    }
    region.markers = region.markers.first(2);
    EXPECT_EQ(error_of(sample.view), PackError::kSectionLength);
}

}  // namespace
}  // namespace rig
