#include "core/pack/pack_error.hpp"

namespace rig {

std::string_view pack_error_text(PackError error) {
    switch (error) {
        case PackError::kTooShort:
            return "it is shorter than a pack header; it was cut off or is no pack";
        case PackError::kTooLong:
            return "it is longer than the largest pack a rig takes";
        case PackError::kMisaligned:
            return "its bytes do not start at a 64-byte boundary in memory";
        case PackError::kMagic:
            return "it does not start with RIGPACK1, so it is no solve pack";
        case PackError::kFormatVersion:
            return "its container format is not the one this program reads";
        case PackError::kHeaderReserved:
            return "reserved bytes of its header are not zero";
        case PackError::kTotalLength:
            return "its length is not the length its header states; it was cut off or added to";
        case PackError::kManifestLength:
            return "its manifest is empty, over 16 KiB or reaches past the end";
        case PackError::kManifestHash:
            return "the hash of its manifest does not match; the file is damaged";
        case PackError::kManifestStructure:
            return "its manifest is malformed";
        case PackError::kSolverVersion:
            return "it was made for another version of the solver; train it again";
        case PackError::kSectionCount:
            return "its section table is empty or too long";
        case PackError::kSectionUnknown:
            return "it holds a section of an unknown type";
        case PackError::kSectionDuplicate:
            return "it holds the same section twice";
        case PackError::kSectionMissing:
            return "a section that its solver needs is missing";
        case PackError::kSectionUnexpected:
            return "it holds a section that its solver does not have";
        case PackError::kSectionAlignment:
            return "a section does not start at a multiple of 64 bytes";
        case PackError::kSectionOutside:
            return "a section reaches past the end of the file";
        case PackError::kSectionOverlap:
            return "a section overlaps what is before it";
        case PackError::kSectionGap:
            return "there are unaccounted bytes between sections";
        case PackError::kTrailingBytes:
            return "there are unaccounted bytes after the last section";
        case PackError::kPadding:
            return "padding between sections is not zero";
        case PackError::kSectionHash:
            return "the hash of a section does not match; the file is damaged";
        case PackError::kPackName:
            return "its own name is empty, too long or not plain text";
        case PackError::kSolverKind:
            return "it names a solver that does not exist";
        case PackError::kMarkerCount:
            return "its number of markers is outside 4 to 128";
        case PackError::kShapeCount:
            return "its number of shapes is outside 1 to 256";
        case PackError::kRbfCounts:
            return "its numbers of RBF centres or dimensions are outside the limits";
        case PackError::kRegionCount:
            return "its number of regions is outside the limits or does not fit its solver";
        case PackError::kCameraCount:
            return "it has more cameras than a rig carries";
        case PackError::kMemory:
            return "the memory it states is less than its own length or more than a rig grants";
        case PackError::kSectionLength:
            return "the length of a section does not fit the counts of the manifest";
        case PackError::kRate:
            return "its frame rate is outside 1 to 1000 Hz";
        case PackError::kNoise:
            return "its marker noise is outside 0.0001 to 100 mm";
        case PackError::kRegularisation:
            return "its sparsity or ridge is negative, not finite or too large";
        case PackError::kNotFinite:
            return "a number in a section is not finite";
        case PackError::kMagnitude:
            return "a number in a section is larger than a face can have";
        case PackError::kWeightRange:
            return "a weight range has its low end above its high end";
        case PackError::kPriorSigma:
            return "an expected spread of a weight is not positive";
        case PackError::kTemporalGamma:
            return "a temporal pull is negative";
        case PackError::kNames:
            return "its names are not as many as the counts say, empty, too long or not plain text";
        case PackError::kNameTwice:
            return "two shapes or two markers have the same name";
        case PackError::kRbfWidths:
            return "an RBF width is not positive";
        case PackError::kRbfBasis:
            return "the rows of its RBF basis are not orthonormal";
        case PackError::kRbfKernel:
            return "its RBF kernel is unknown, or it has one without being an RBF";
        case PackError::kRbfHull:
            return "its RBF fallback distances are not 0 <= near < far, or it is no RBF";
        case PackError::kRegionTable:
            return "a region has an unknown solver or more markers or examples than there can be";
        case PackError::kRegionMarkers:
            return "the markers of a region are not rising indices of the pack's markers";
        case PackError::kRegionMarkerBlend:
            return "the blend weights of a marker are not positive or do not sum to 1 over its regions";
        case PackError::kRegionOrigin:
            return "the origin of a region is not the one its solver needs";
        case PackError::kRegionExamples:
            return "the padding of a region's examples is not zero or they are not about their origin";
        case PackError::kRegionShapeBlend:
            return "the blend weights of a shape are outside 0 to 1 or do not sum to 1 or 0 over the regions";
        case PackError::kMarkerSetTable:
            return "its marker sets are too many, too large, not level by level, or none is the whole face";
        case PackError::kMarkerSetMarkers:
            return "the markers of a marker set are not rising indices of the pack's markers";
        case PackError::kMarkerSetModes:
            return "the modes of a marker set are not orthonormal";
        case PackError::kMarkerSetVariance:
            return "a variance of a marker set is not positive, not falling, or its residual is negative";
        case PackError::kCameraIntrinsics:
            return "a camera's size, focal length, centre or distortion is implausible";
        case PackError::kCameraRotation:
            return "a camera's rotation is not a rotation or its position is implausible";
        case PackError::kReferenceMarks:
            return "its reference marks are too many, implausibly far, or of no camera it has";
        case PackError::kCount:
            break;
    }
    return "unknown pack error";
}

}  // namespace rig
