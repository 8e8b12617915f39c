#include "core/pack/manifest.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "core/pack/manifest_generated.h"
#include "core/pack/open_pack.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/aligned_bytes.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"

namespace rig {
namespace {

namespace fb = pack_manifest;
using host::write_pack;
using test::AlignedBytes;
using test::SamplePack;

// A whole, well-hashed pack whose manifest a test changes as an attacker with a hash function would.
class ForgedPack {
  public:
    explicit ForgedPack(SolverKind solver = SolverKind::kBoxQp, const host::PackIdentity& identity = {})
        : sample_({.solver = solver}), bytes_(write_pack(sample_.view, identity, sha256)) {}

    template <class T>
    void set_header(std::size_t offset, T value) {
        store(MutableByteSpan(bytes_), offset, value);
    }
    template <class T>
    void set_field(flatbuffers::voffset_t field, T value) {
        auto* table = reinterpret_cast<flatbuffers::Table*>(const_cast<fb::Manifest*>(manifest()));
        ASSERT_TRUE(table->SetField<T>(field, value, T(value + 1)));
    }
    // Byte offsets inside the 56-byte struct: type 0, reserved 2 and 4, offset 8, length 16, hash 24.
    template <class T>
    void set_section(std::uint32_t index, std::size_t at, T value) {
        auto* entry = const_cast<fb::Section*>(manifest()->sections()->Get(index));
        std::memcpy(reinterpret_cast<std::byte*>(entry) + at, &value, sizeof(T));
    }
    void set_section_count(std::uint32_t count) {
        auto* first = reinterpret_cast<std::byte*>(const_cast<fb::Section*>(manifest()->sections()->Get(0)));
        std::memcpy(first - sizeof(count), &count, sizeof(count));
    }
    [[nodiscard]] const fb::Section& section(std::uint32_t index) const {
        return *manifest()->sections()->Get(index);
    }
    [[nodiscard]] std::uint32_t section_count() const { return manifest()->sections()->size(); }
    std::vector<std::byte>& bytes() { return bytes_; }

    PackError error() {
        const auto length = load<std::uint32_t>(bytes_, 12);
        if (length > 0 && length <= bytes_.size() - kPackHeaderBytes) {
            Hash digest{};
            sha256(ByteSpan(bytes_).subspan(kPackHeaderBytes, length), digest);
            set_header(32, digest);
        }
        return unhashed_error();
    }
    PackError unhashed_error() {
        const AlignedBytes aligned(bytes_);
        const auto opened = open_pack(aligned.span(), sha256);
        EXPECT_FALSE(opened.has_value());
        return opened ? PackError::kCount : opened.error();
    }

  private:
    [[nodiscard]] const fb::Manifest* manifest() const {
        return fb::GetManifest(bytes_.data() + kPackHeaderBytes);
    }
    SamplePack sample_;
    std::vector<std::byte> bytes_;
};

TEST(ReadManifest, SaysWhatTheWriterWasTold) {
    const SamplePack sample({.markers = 6, .shapes = 3, .solver = SolverKind::kRbf, .cameras = 2});
    const AlignedBytes bytes(write_pack(sample.view, {"ada", 7, 3, {"sim", "cm5"}}, sha256));
    const auto manifest = read_manifest(bytes.span(), sha256);
    ASSERT_TRUE(manifest.has_value()) << pack_error_text(manifest.error());
    EXPECT_EQ(manifest->name, "ada");
    EXPECT_EQ(manifest->pack_version, 7U);
    EXPECT_EQ(manifest->security_counter, 3U);
    ASSERT_EQ(manifest->boards.size(), 2U);
    EXPECT_EQ(manifest->boards[1], "cm5");
    EXPECT_EQ(manifest->counts.markers, 6U);
    EXPECT_EQ(manifest->counts.rbf_centres, 3U);
    EXPECT_EQ(manifest->sections.size(), 15U);  // all but those of regions
    EXPECT_EQ(manifest->total_bytes, bytes.span().size());
    EXPECT_GE(manifest->memory_bytes, manifest->total_bytes);
    EXPECT_EQ(manifest->cameras.size(), 2U);
}

TEST(ReadManifest, SameContentsSameUuidOtherContentsAnother) {
    const auto uuid = [](SamplePack& sample) {
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        return read_manifest(bytes.span(), sha256).value().uuid;
    };
    SamplePack a({});
    SamplePack b({});
    EXPECT_EQ(uuid(a), uuid(b));
    b.basis[0] += 0.5F;
    EXPECT_NE(uuid(a), uuid(b));
    EXPECT_EQ(uuid(a)[6] >> 4, 8);
}

TEST(ReadManifest, RefusesBadHeaders) {
    struct Case {
        const char* what;
        void (*change)(ForgedPack&);
        PackError error;
    };
    const Case cases[] = {
        {"magic", [](ForgedPack& p) { p.set_header(0, 'r'); }, PackError::kMagic},
        {"future format", [](ForgedPack& p) { p.set_header(8, 2U); }, PackError::kFormatVersion},
        {"no format", [](ForgedPack& p) { p.set_header(8, 0U); }, PackError::kFormatVersion},
        {"reserved", [](ForgedPack& p) { p.set_header(31, '\1'); }, PackError::kHeaderReserved},
        {"no manifest", [](ForgedPack& p) { p.set_header(12, 0U); }, PackError::kManifestLength},
        {"manifest of 16 KiB + 1",
         [](ForgedPack& p) {
             p.bytes().resize(40000);
             p.set_header(16, std::uint64_t{40000});
             p.set_header(12, 16385U);
         },
         PackError::kManifestLength},
        {"manifest past the end",
         [](ForgedPack& p) { p.set_header(12, static_cast<std::uint32_t>(p.bytes().size() - 63)); },
         PackError::kManifestLength},
        {"manifest 2^32 - 1", [](ForgedPack& p) { p.set_header(12, 0xffffffffU); },
         PackError::kManifestLength},
        {"total 2^32 too long",
         [](ForgedPack& p) { p.set_header(16, p.bytes().size() + (std::uint64_t{1} << 32)); },
         PackError::kTotalLength},
        {"one byte added", [](ForgedPack& p) { p.bytes().push_back(std::byte{0}); }, PackError::kTotalLength},
        {"one byte added and counted",
         [](ForgedPack& p) {
             p.bytes().push_back(std::byte{0});
             p.set_header(16, std::uint64_t{p.bytes().size()});
         },
         PackError::kTrailingBytes},
        {"longer than a rig takes", [](ForgedPack& p) { p.bytes().resize(kMaxPackBytes + 1); },
         PackError::kTooLong},
        {"empty manifest", [](ForgedPack& p) { p.set_header(12, 1U); }, PackError::kManifestStructure},
        {"other identifier", [](ForgedPack& p) { p.set_header(kPackHeaderBytes + 4, 'x'); },
         PackError::kManifestStructure},
        {"root outside", [](ForgedPack& p) { p.set_header(kPackHeaderBytes, 0x7fffffffU); },
         PackError::kManifestStructure},
    };
    for (const Case& bad : cases) {
        SCOPED_TRACE(bad.what);
        ForgedPack pack;
        bad.change(pack);
        const PackError error = pack.error();
        EXPECT_EQ(error, bad.error) << pack_error_text(error);
    }
    ForgedPack pack;
    pack.set_header(32, '\0');
    EXPECT_EQ(pack.unhashed_error(), PackError::kManifestHash);
}

TEST(ReadManifest, RefusesBadSectionTables) {
    struct Case {
        const char* what;
        void (*change)(ForgedPack&);
        PackError error;
    };
    const Case cases[] = {
        {"type 0", [](ForgedPack& p) { p.set_section(2, 0, std::uint16_t{0}); }, PackError::kSectionUnknown},
        {"type after the last",
         [](ForgedPack& p) { p.set_section(2, 0, static_cast<std::uint16_t>(kSectionTypeCount + 1)); },
         PackError::kSectionUnknown},
        {"reserved", [](ForgedPack& p) { p.set_section(2, 2, std::uint16_t{1}); },
         PackError::kSectionUnknown},
        {"reserved word", [](ForgedPack& p) { p.set_section(2, 4, 1U); }, PackError::kSectionUnknown},
        {"twice", [](ForgedPack& p) { p.set_section(2, 0, std::uint16_t{2}); }, PackError::kSectionDuplicate},
        {"off by 4", [](ForgedPack& p) { p.set_section(2, 8, p.section(2).offset() + 4); },
         PackError::kSectionAlignment},
        {"beyond the end", [](ForgedPack& p) { p.set_section(2, 8, align_up(p.bytes().size() + 64)); },
         PackError::kSectionOutside},
        {"offset 2^64 - 64", [](ForgedPack& p) { p.set_section(2, 8, ~std::uint64_t{63}); },
         PackError::kSectionOutside},
        {"offset 2^32 further",
         [](ForgedPack& p) { p.set_section(2, 8, p.section(2).offset() + (std::uint64_t{1} << 32)); },
         PackError::kSectionOutside},
        {"length 2^64 - 1", [](ForgedPack& p) { p.set_section(2, 16, ~std::uint64_t{0}); },
         PackError::kSectionOutside},
        {"length that wraps to the right end",
         [](ForgedPack& p) { p.set_section(2, 16, p.section(2).length() - p.section(2).offset()); },
         PackError::kSectionOutside},
        {"over the manifest", [](ForgedPack& p) { p.set_section(0, 8, std::uint64_t{64}); },
         PackError::kSectionOverlap},
        {"over the header", [](ForgedPack& p) { p.set_section(0, 8, std::uint64_t{0}); },
         PackError::kSectionOverlap},
        {"over the one before", [](ForgedPack& p) { p.set_section(2, 8, p.section(1).offset()); },
         PackError::kSectionOverlap},
        {"swapped order", [](ForgedPack& p) { p.set_section(1, 8, p.section(2).offset()); },
         PackError::kSectionGap},
        {"shorter than its place", [](ForgedPack& p) { p.set_section(1, 16, std::uint64_t{0}); },
         PackError::kSectionGap},
        {"last one shorter", [](ForgedPack& p) { p.set_section(8, 16, p.section(8).length() - 1); },
         PackError::kTrailingBytes},
        {"last one left out", [](ForgedPack& p) { p.set_section_count(8); }, PackError::kTrailingBytes},
        {"none", [](ForgedPack& p) { p.set_section_count(0); }, PackError::kSectionCount},
        {"2^31 sections", [](ForgedPack& p) { p.set_section_count(0x80000000U); },
         PackError::kManifestStructure},
        {"one more than there is room", [](ForgedPack& p) { p.set_section_count(200); },
         PackError::kManifestStructure},
        {"hash", [](ForgedPack& p) { p.set_section(3, 24, '\0'); }, PackError::kSectionHash},
        {"padding", [](ForgedPack& p) { p.bytes()[p.section(3).offset() - 1] = std::byte{1}; },
         PackError::kPadding},
        {"contents", [](ForgedPack& p) { p.bytes()[p.section(3).offset()] ^= std::byte{1}; },
         PackError::kSectionHash},
        {"a needed one gone",
         [](ForgedPack& p) {
             const auto end = p.section(7).offset() + p.section(7).length();
             p.set_section_count(8);
             p.bytes().resize(end);
             p.set_header(16, end);
         },
         PackError::kSectionMissing},
    };
    for (const Case& bad : cases) {
        SCOPED_TRACE(bad.what);
        ForgedPack pack;
        ASSERT_EQ(pack.section_count(), 9U);
        bad.change(pack);
        const PackError error = pack.error();
        EXPECT_EQ(error, bad.error) << pack_error_text(error);
    }
}

TEST(ReadManifest, RefusesMoreSectionsThanTypes) {
    // No solver has sections of every type: the table is as long as they come and says that it is longer.
    ForgedPack pack(SolverKind::kKeyShapes);
    ASSERT_LE(pack.section_count(), kSectionTypeCount);
    pack.set_section_count(kSectionTypeCount + 1);
    // The table now runs into whatever is before it in the buffer: refused by structure or by count, never
    // read.
    const PackError error = pack.error();
    EXPECT_TRUE(error == PackError::kSectionCount || error == PackError::kManifestStructure)
        << pack_error_text(error);
}

template <class T>
PackError error_with(flatbuffers::voffset_t field, T value, SolverKind solver = SolverKind::kBoxQp) {
    ForgedPack pack(solver);
    pack.set_field(field, value);
    return pack.error();
}

TEST(ReadManifest, RefusesCountsAndVersionsOutsideTheLimits) {
    using M = fb::Manifest;
    const auto u16 = [](std::size_t value) { return static_cast<std::uint16_t>(value); };
    EXPECT_EQ(error_with(M::VT_MARKER_COUNT, u16(0)), PackError::kMarkerCount);
    EXPECT_EQ(error_with(M::VT_MARKER_COUNT, u16(3)), PackError::kMarkerCount);
    EXPECT_EQ(error_with(M::VT_MARKER_COUNT, u16(kMaxMarkers + 1)), PackError::kMarkerCount);
    EXPECT_EQ(error_with(M::VT_MARKER_COUNT, u16(65535)), PackError::kMarkerCount);
    EXPECT_EQ(error_with(M::VT_MARKER_COUNT, u16(5)), PackError::kSectionLength);
    EXPECT_EQ(error_with(M::VT_SHAPE_COUNT, u16(0)), PackError::kShapeCount);
    EXPECT_EQ(error_with(M::VT_SHAPE_COUNT, u16(kMaxShapes + 1)), PackError::kShapeCount);
    EXPECT_EQ(error_with(M::VT_SHAPE_COUNT, u16(3)), PackError::kSectionLength);
    EXPECT_EQ(error_with(M::VT_SOLVER, std::uint8_t{6}), PackError::kSolverKind);
    EXPECT_EQ(error_with(M::VT_SOLVER, std::uint8_t{255}), PackError::kSolverKind);
    EXPECT_EQ(error_with(M::VT_RBF_CENTRE_COUNT, u16(1)), PackError::kRbfCounts);
    EXPECT_EQ(error_with(M::VT_RBF_CENTRE_COUNT, u16(0), SolverKind::kRbf), PackError::kRbfCounts);
    EXPECT_EQ(error_with(M::VT_RBF_CENTRE_COUNT, u16(kMaxRbfCentres + 1), SolverKind::kRbf),
              PackError::kRbfCounts);
    EXPECT_EQ(error_with(M::VT_RBF_DIMENSION_COUNT, u16(kMaxRbfDimensions + 1), SolverKind::kRbf),
              PackError::kRbfCounts);
    EXPECT_EQ(error_with(M::VT_RBF_DIMENSION_COUNT, u16(13), SolverKind::kRbf),
              PackError::kRbfCounts);  // > 3 m
    EXPECT_EQ(error_with(M::VT_RBF_DIMENSION_COUNT, u16(1), SolverKind::kRbf), PackError::kSectionLength);
    EXPECT_EQ(error_with(M::VT_REGION_COUNT, u16(1)), PackError::kRegionCount);
    EXPECT_EQ(error_with(M::VT_REGION_COUNT, u16(0), SolverKind::kKeyShapes), PackError::kRegionCount);
    EXPECT_EQ(error_with(M::VT_REGION_COUNT, u16(kMaxRegions + 1), SolverKind::kExamples),
              PackError::kRegionCount);
    EXPECT_EQ(error_with(M::VT_REGION_COUNT, u16(3), SolverKind::kExamples), PackError::kSectionLength);
    EXPECT_EQ(error_with(M::VT_MEMORY_BYTES, std::uint64_t{0}), PackError::kMemory);
    EXPECT_EQ(error_with(M::VT_MEMORY_BYTES, std::uint64_t{kMaxPackBytes + 1}), PackError::kMemory);
    EXPECT_EQ(error_with(M::VT_MEMORY_BYTES, ~std::uint64_t{0}), PackError::kMemory);
    EXPECT_EQ(error_with(M::VT_SOLVER_ABI_MIN, u16(kSolverAbi + 1)), PackError::kSolverVersion);
    EXPECT_EQ(error_with(M::VT_SOLVER_ABI_MAX, u16(kOldestSolverAbi - 1)), PackError::kSolverVersion);
}

TEST(ReadManifest, RefusesKernelsAndFallbacksThatMeanNothing) {
    using M = fb::Manifest;
    const auto u8 = [](std::size_t value) { return static_cast<std::uint8_t>(value); };
    EXPECT_EQ(error_with(M::VT_RBF_KERNEL, u8(1)), PackError::kRbfKernel) << "a box QP has no kernel";
    EXPECT_EQ(error_with(M::VT_RBF_KERNEL, u8(3), SolverKind::kRbf), PackError::kRbfKernel);
    EXPECT_EQ(error_with(M::VT_RBF_HULL_FAR_WIDTHS, 2.0F), PackError::kRbfHull);
    for (const float bad :
         {-1.0F, 1001.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        EXPECT_EQ(error_with(M::VT_RBF_HULL_FAR_WIDTHS, bad, SolverKind::kRbf), PackError::kRbfHull);
        EXPECT_EQ(error_with(M::VT_RBF_HULL_NEAR_WIDTHS, bad, SolverKind::kRbf), PackError::kRbfHull);
    }
    EXPECT_EQ(error_with(M::VT_RBF_HULL_NEAR_WIDTHS, 2.0F, SolverKind::kRbf), PackError::kRbfHull)
        << "near beyond far";
}

TEST(ReadManifest, AsksForTheNewSolverInterfaceOnlyWhereItMatters) {
    SamplePack sample({.solver = SolverKind::kRbf});
    const auto oldest = [&] {
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        const auto manifest = read_manifest(bytes.span(), sha256);
        return manifest ? manifest->solver_abi_min : std::uint16_t{0};
    };
    EXPECT_EQ(oldest(), kOldestSolverAbi);
    sample.view.rbf.kernel = RbfKernel::kMultiquadric;
    EXPECT_EQ(oldest(), 2);
    sample.view.rbf.kernel = RbfKernel::kGaussian;
    sample.view.rbf.hull_far_widths = 2.0F;
    EXPECT_EQ(oldest(), 2);
    const CameraModel plain = sample.view.cameras[0];
    sample.view.cameras[0].k5 = 0.1;
    EXPECT_EQ(oldest(), 3);
    sample.view.cameras[0] = plain;
    sample.view.cameras[0].row_time_us = 20.0;
    EXPECT_EQ(oldest(), 3);
    sample.view.cameras[0] = plain;
    sample.view.cameras[0].lens = LensModel::kFisheye;
    sample.view.cameras[0].p1 = sample.view.cameras[0].p2 = 0.0;
    EXPECT_EQ(oldest(), 3);
    SamplePack sets({.marker_sets = true});
    const AlignedBytes bytes(write_pack(sets.view, {}, sha256));
    EXPECT_EQ(read_manifest(bytes.span(), sha256)->solver_abi_min, 3);
    SamplePack marks({.reference_marks = 1});
    const AlignedBytes marked(write_pack(marks.view, {}, sha256));
    EXPECT_EQ(read_manifest(marked.span(), sha256)->solver_abi_min, 4);
    EXPECT_EQ(kSolverAbi, 4);
}

TEST(ReadManifest, ALensComesBackAndAnUnknownOneIsRefused) {
    SamplePack sample({.cameras = 2});
    CameraModel& camera = sample.view.cameras[1];
    camera.k4 = 0.25;
    camera.k5 = -0.5;
    camera.k6 = 0.125;
    camera.row_time_us = 18.5;
    AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    const auto manifest = read_manifest(bytes.span(), sha256);
    ASSERT_TRUE(manifest.has_value());
    EXPECT_EQ(manifest->cameras[0].k4, 0.0);
    EXPECT_EQ(manifest->cameras[1].k4, 0.25);
    EXPECT_EQ(manifest->cameras[1].k5, -0.5);
    EXPECT_EQ(manifest->cameras[1].k6, 0.125);
    EXPECT_EQ(manifest->cameras[1].row_time_us, 18.5);
    EXPECT_EQ(manifest->cameras[1].lens, LensModel::kRational);
    camera.lens = static_cast<LensModel>(2);
    const AlignedBytes unknown(write_pack(sample.view, {}, sha256));
    const auto refused = read_manifest(unknown.span(), sha256);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error(), PackError::kCameraIntrinsics);
}

TEST(ReadManifest, RefusesSectionsThatBelongToAnotherSolver) {
    ForgedPack rbf(SolverKind::kRbf);
    rbf.set_field(fb::Manifest::VT_SOLVER, static_cast<std::uint8_t>(SolverKind::kBoxQp));
    rbf.set_field(fb::Manifest::VT_RBF_CENTRE_COUNT, std::uint16_t{0});
    rbf.set_field(fb::Manifest::VT_RBF_DIMENSION_COUNT, std::uint16_t{0});
    EXPECT_EQ(rbf.error(), PackError::kSectionUnexpected);
    ForgedPack regional(SolverKind::kKeyShapes);
    regional.set_field(fb::Manifest::VT_SOLVER, static_cast<std::uint8_t>(SolverKind::kBoxQp));
    regional.set_field(fb::Manifest::VT_REGION_COUNT, std::uint16_t{0});
    EXPECT_EQ(regional.error(), PackError::kSectionUnexpected);
    ForgedPack box(SolverKind::kBoxQp);
    box.set_field(fb::Manifest::VT_SOLVER, static_cast<std::uint8_t>(SolverKind::kRbf));
    box.set_field(fb::Manifest::VT_RBF_CENTRE_COUNT, std::uint16_t{1});
    box.set_field(fb::Manifest::VT_RBF_DIMENSION_COUNT, std::uint16_t{1});
    EXPECT_EQ(box.error(), PackError::kSectionMissing);
}

TEST(ReadManifest, RefusesBadIdentity) {
    EXPECT_EQ(ForgedPack(SolverKind::kBoxQp, {.name = ""}).error(), PackError::kPackName);
    EXPECT_EQ(ForgedPack(SolverKind::kBoxQp, {.name = std::string(kMaxNameBytes + 1, 'n')}).error(),
              PackError::kPackName);
    EXPECT_EQ(ForgedPack(SolverKind::kBoxQp, {.name = "bell\a"}).error(), PackError::kPackName);
    host::PackIdentity boards;
    boards.boards.assign(kMaxPackBoards + 1, "b");
    EXPECT_EQ(ForgedPack(SolverKind::kBoxQp, boards).error(), PackError::kPackName);
}

TEST(ReadManifest, RefusesMoreCamerasThanARigCarries) {
    SamplePack sample({.cameras = kMaxCameras});
    std::vector<std::byte> bytes = write_pack(sample.view, {}, sha256);
    // The camera vector's count is raised in place; the vector lies before the section table, so it stays
    // inside.
    const auto* cameras = fb::GetManifest(bytes.data() + kPackHeaderBytes)->cameras();
    auto* count = reinterpret_cast<std::byte*>(const_cast<fb::Camera*>(cameras->Get(0))) - 4;
    store(MutableByteSpan(count, 4), 0, std::uint32_t{kMaxCameras + 1});
    Hash digest{};
    sha256(ByteSpan(bytes).subspan(kPackHeaderBytes, load<std::uint32_t>(bytes, 12)), digest);
    store(MutableByteSpan(bytes), 32, digest);
    const AlignedBytes aligned(bytes);
    const auto manifest = read_manifest(aligned.span(), sha256);
    ASSERT_FALSE(manifest.has_value());
    EXPECT_TRUE(manifest.error() == PackError::kCameraCount ||
                manifest.error() == PackError::kManifestStructure);
}

}  // namespace
}  // namespace rig
