// The container around a solve pack, byte by byte: a fixed header, a manifest, aligned tensor sections.
// Shared by the reader here and the writer on the host. Not the meaning of the tensors: solve_pack.hpp.
//
//   0   8  magic "RIGPACK1"
//   8   4  u32 format version, 1
//   12  4  u32 manifest length in bytes, 1..16384
//   16  8  u64 total length of the file in bytes
//   24  8  zero
//   32 32  SHA-256 of the manifest
//   64     manifest (FlatBuffers, manifest.fbs), then zeros to a multiple of 64
//          sections in the order of the manifest's table, each at the next multiple of 64 after the one
//          before, zeros between; the last one ends the file
// All integers and floats little-endian. Tensors are float32, row-major; lists of markers are u16. Names are
// UTF-8, each ended by '\n'. The region table is one record of 8 bytes a region: u8 solver, u8 0, u16
// markers, u16 examples, u16 0; the other region sections hold the regions' parts one after the other in its
// order. The marker set table likewise: u8 level, u8 0, u16 markers, u16 modes, u16 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

inline constexpr std::array<char, 8> kPackMagic{'R', 'I', 'G', 'P', 'A', 'C', 'K', '1'};
inline constexpr std::uint32_t kPackFormatVersion = 1;
inline constexpr std::uint16_t kSolverAbi = 4;  // grows when core reads a pack's numbers differently
// A pack of this number still means the same: 2 brought the RBF's kernel and its fallback; 3 marker sets,
// lenses that are rational or fisheye, and the time of a row; 4 the helmet's reference marks, which an older
// core would take for markers of the face; older packs have none of them.
inline constexpr std::uint16_t kOldestSolverAbi = 1;
inline constexpr std::size_t kPackHeaderBytes = 64;
inline constexpr std::size_t kPackAlignment = 64;  // a cache line, and more than any vector load needs
inline constexpr std::size_t kHashBytes = 32;

using Hash = std::array<std::byte, kHashBytes>;

// SHA-256 of `bytes`. core has no library of its own; programs pass libsodium's.
using HashFunction = void (*)(ByteSpan bytes, Hash& digest);

enum class SectionType : std::uint16_t {
    kNeutral = 1,
    kBasis = 2,
    kWeightLow = 3,
    kWeightHigh = 4,
    kPriorMean = 5,
    kPriorSigma = 6,
    kTemporalGamma = 7,
    kShapeNames = 8,
    kMarkerNames = 9,
    kRbfMean = 10,
    kRbfBasis = 11,
    kRbfCentres = 12,
    kRbfWidths = 13,
    kRbfWeights = 14,
    kRbfOffset = 15,
    kRegionNames = 16,
    kRegionTable = 17,
    kRegionMarkers = 18,
    kRegionMarkerBlend = 19,
    kRegionOrigin = 20,
    kRegionExamples = 21,
    kRegionShapes = 22,
    kRegionShapeBlend = 23,
    kMarkerSetNames = 24,
    kMarkerSetTable = 25,
    kMarkerSetMarkers = 26,
    kMarkerSetMean = 27,
    kMarkerSetModes = 28,
    kMarkerSetVariance = 29,
    kMarkerSetResidual = 30,
};
inline constexpr std::size_t kSectionTypeCount = 30;  // types are 1..kSectionTypeCount

// "basis", "rbf centres", ...; "unknown" outside the enumeration.
[[nodiscard]] std::string_view section_name(SectionType type);
[[nodiscard]] constexpr bool is_rbf_section(SectionType type) {
    return type >= SectionType::kRbfMean && type <= SectionType::kRbfOffset;
}
[[nodiscard]] constexpr bool is_region_section(SectionType type) {
    return type >= SectionType::kRegionNames && type <= SectionType::kRegionShapeBlend;
}
// All of them or none, with any solver.
[[nodiscard]] constexpr bool is_marker_set_section(SectionType type) {
    return type >= SectionType::kMarkerSetNames && type <= SectionType::kMarkerSetResidual;
}
inline constexpr std::size_t kRegionRecordBytes = 8;
inline constexpr std::size_t kMarkerSetRecordBytes = 8;

[[nodiscard]] constexpr std::uint64_t align_up(std::uint64_t offset) {
    return (offset + (kPackAlignment - 1)) / kPackAlignment * kPackAlignment;
}

// Numbers a tensor section of this type has under these counts; 0 for sections of text or of integers.
struct PackCounts {
    std::size_t markers = 0;
    std::size_t shapes = 0;
    std::size_t rbf_dimensions = 0;
    std::size_t rbf_centres = 0;
    std::size_t regions = 0;
    // Sums over the region table; read with it.
    std::size_t region_markers = 0;         // m_r
    std::size_t region_examples = 0;        // n_r
    std::size_t region_example_floats = 0;  // 3 m_r padded(n_r)
    // Of the marker set table; read with it.
    std::size_t marker_sets = 0;
    std::size_t set_markers = 0;      // sum of m_f
    std::size_t set_modes = 0;        // sum of k
    std::size_t set_mode_floats = 0;  // sum of k 3 m_f
};
[[nodiscard]] constexpr std::size_t section_floats(SectionType type, const PackCounts& n) {
    switch (type) {
        case SectionType::kNeutral:
        case SectionType::kRbfMean:
            return 3 * n.markers;
        case SectionType::kBasis:
            return 3 * n.markers * n.shapes;
        case SectionType::kWeightLow:
        case SectionType::kWeightHigh:
        case SectionType::kPriorMean:
        case SectionType::kPriorSigma:
        case SectionType::kTemporalGamma:
        case SectionType::kRbfOffset:
            return n.shapes;
        case SectionType::kRbfBasis:
            return n.rbf_dimensions * 3 * n.markers;
        case SectionType::kRbfCentres:
            return n.rbf_centres * n.rbf_dimensions;
        case SectionType::kRbfWidths:
            return n.rbf_centres;
        case SectionType::kRbfWeights:
            return n.rbf_centres * n.shapes;
        case SectionType::kRegionMarkerBlend:
            return n.region_markers;
        case SectionType::kRegionOrigin:
            return 3 * n.region_markers;
        case SectionType::kRegionExamples:
            return n.region_example_floats;
        case SectionType::kRegionShapes:
            return n.region_examples * n.shapes;
        case SectionType::kRegionShapeBlend:
            return n.regions * n.shapes;
        case SectionType::kMarkerSetMean:
            return 3 * n.set_markers;
        case SectionType::kMarkerSetModes:
            return n.set_mode_floats;
        case SectionType::kMarkerSetVariance:
            return n.set_modes;
        case SectionType::kMarkerSetResidual:
            return n.set_markers;
        case SectionType::kShapeNames:
        case SectionType::kMarkerNames:
        case SectionType::kRegionNames:
        case SectionType::kRegionTable:
        case SectionType::kRegionMarkers:
        case SectionType::kMarkerSetNames:
        case SectionType::kMarkerSetTable:
        case SectionType::kMarkerSetMarkers:
            break;
    }
    return 0;
}

}  // namespace rig
