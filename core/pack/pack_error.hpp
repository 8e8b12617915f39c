// Why bytes are not a usable solve pack. One enumerator per rule, so that a refusal says which rule.
#pragma once

#include <cstdint>
#include <string_view>

namespace rig {

enum class PackError : std::uint8_t {
    // container
    kTooShort,
    kTooLong,
    kMisaligned,
    kMagic,
    kFormatVersion,
    kHeaderReserved,
    kTotalLength,
    kManifestLength,
    kManifestHash,
    kManifestStructure,
    kSolverVersion,
    // section table
    kSectionCount,
    kSectionUnknown,
    kSectionDuplicate,
    kSectionMissing,
    kSectionUnexpected,
    kSectionAlignment,
    kSectionOutside,
    kSectionOverlap,
    kSectionGap,
    kTrailingBytes,
    kPadding,
    kSectionHash,
    // meaning
    kPackName,
    kSolverKind,
    kMarkerCount,
    kShapeCount,
    kRbfCounts,
    kRegionCount,
    kCameraCount,
    kMemory,
    kSectionLength,
    kRate,
    kNoise,
    kRegularisation,
    kNotFinite,
    kMagnitude,
    kWeightRange,
    kPriorSigma,
    kTemporalGamma,
    kNames,
    kNameTwice,
    kRbfWidths,
    kRbfBasis,
    kRbfKernel,
    kRbfHull,
    kRegionTable,
    kRegionMarkers,
    kRegionMarkerBlend,
    kRegionOrigin,
    kRegionExamples,
    kRegionShapeBlend,
    kMarkerSetTable,
    kMarkerSetMarkers,
    kMarkerSetModes,
    kMarkerSetVariance,
    kCameraIntrinsics,
    kCameraRotation,
    kReferenceMarks,
    kCount  // how many there are; never returned
};

// One plain sentence without a full stop, e.g. "the section hash does not match its bytes".
[[nodiscard]] std::string_view pack_error_text(PackError error);

}  // namespace rig
