#include "core/pack/manifest.hpp"

#include <cstring>

#include "core/pack/manifest_generated.h"

namespace rig {

namespace {

namespace fb = pack_manifest;

struct Header {
    std::uint32_t manifest_bytes = 0;
    std::uint64_t total_bytes = 0;
    Hash manifest_hash{};
};

Result<Header, PackError> read_header(ByteSpan bytes) {
    if (bytes.size() < kPackHeaderBytes) return failure(PackError::kTooShort);
    if (bytes.size() > kMaxPackBytes) return failure(PackError::kTooLong);
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kPackAlignment != 0)
        return failure(PackError::kMisaligned);
    if (std::memcmp(bytes.data(), kPackMagic.data(), kPackMagic.size()) != 0)
        return failure(PackError::kMagic);
    if (load<std::uint32_t>(bytes, 8) != kPackFormatVersion) return failure(PackError::kFormatVersion);
    if (load<std::uint64_t>(bytes, 24) != 0) return failure(PackError::kHeaderReserved);
    Header header;
    header.manifest_bytes = load<std::uint32_t>(bytes, 12);
    header.total_bytes = load<std::uint64_t>(bytes, 16);
    header.manifest_hash = load<Hash>(bytes, 32);
    if (header.total_bytes != bytes.size()) return failure(PackError::kTotalLength);
    if (header.manifest_bytes == 0 || header.manifest_bytes > kMaxManifestBytes ||
        header.manifest_bytes > bytes.size() - kPackHeaderBytes) {
        return failure(PackError::kManifestLength);
    }
    return header;
}

CameraModel camera_from(const fb::Camera& stored) {
    CameraModel camera;
    // An absurd size must not become a negative int: it is cut to a value that the checks refuse.
    const auto size_px = [](std::uint32_t px) { return static_cast<int>(px > 0xffffff ? 0xffffffU : px); };
    camera.width_px = size_px(stored.width_px());
    camera.height_px = size_px(stored.height_px());
    camera.fx_px = stored.fx_px();
    camera.fy_px = stored.fy_px();
    camera.cx_px = stored.cx_px();
    camera.cy_px = stored.cy_px();
    camera.k1 = stored.k1();
    camera.k2 = stored.k2();
    camera.p1 = stored.p1();
    camera.p2 = stored.p2();
    camera.k3 = stored.k3();
    for (std::uint16_t i = 0; i < 9; ++i) {
        camera.camera_from_headset(i / 3, i % 3) = stored.camera_from_headset()->Get(i);
    }
    for (std::uint16_t i = 0; i < 3; ++i) camera.centre_mm[i] = stored.centre_mm()->Get(i);
    return camera;
}

void add_lens(const fb::CameraLens& stored, CameraModel& camera) {
    camera.lens = static_cast<LensModel>(stored.model());
    camera.k4 = stored.k4();
    camera.k5 = stored.k5();
    camera.k6 = stored.k6();
    camera.row_time_us = stored.row_time_us();
}

Result<void, PackError> read_cameras(const fb::Manifest& stored, PackManifest& out) {
    const auto* cameras = stored.cameras();
    const auto* lenses = stored.camera_lenses();
    const std::size_t camera_count = cameras == nullptr ? 0 : cameras->size();
    const std::size_t lens_count = lenses == nullptr ? 0 : lenses->size();
    if (camera_count > kMaxCameras || (lens_count != 0 && lens_count != camera_count))
        return failure(PackError::kCameraCount);
    for (std::uint32_t c = 0; c < camera_count; ++c) {
        CameraModel camera = camera_from(*cameras->Get(c));
        if (lens_count != 0) {
            if (lenses->Get(c)->model() > static_cast<std::uint8_t>(LensModel::kFisheye))
                return failure(PackError::kCameraIntrinsics);
            add_lens(*lenses->Get(c), camera);
        }
        if (!out.cameras.push_back(camera)) return failure(PackError::kCameraCount);
    }
    return {};
}

Result<void, PackError> read_reference_marks(const fb::Manifest& stored, PackManifest& out) {
    const auto* marks = stored.reference_marks();
    const std::size_t count = marks == nullptr ? 0 : marks->size();
    if (count > kMaxReferenceMarks) return failure(PackError::kReferenceMarks);
    for (std::uint32_t i = 0; i < count; ++i) {
        const fb::ReferenceMark& from = *marks->Get(i);
        HelmetMark mark;
        for (std::uint16_t a = 0; a < 3; ++a) mark.headset_mm[a] = from.headset_mm()->Get(a);
        mark.cameras = from.cameras();
        const bool reserved = from.reserved() != 0 || from.reserved2() != 0 || from.reserved3() != 0;
        if (reserved || !out.reference_marks.push_back(mark)) return failure(PackError::kReferenceMarks);
    }
    return {};
}

// The verifier of FlatBuffers sees to the alignment of a vector's length, not to that of its structs. An
// empty one has none to align.
template <class T>
bool is_aligned(const flatbuffers::Vector<const T*>* structs) {
    return structs == nullptr || structs->size() == 0 ||
           reinterpret_cast<std::uintptr_t>(structs->Data()) % alignof(T) == 0;
}

Result<void, PackError> read_identity(const fb::Manifest& stored, PackManifest& out) {
    for (std::uint16_t i = 0; i < 16; ++i) out.uuid[i] = stored.uuid()->bytes()->Get(i);
    out.name = {stored.name()->c_str(), stored.name()->size()};
    if (!is_plain_text(out.name, kMaxNameBytes)) return failure(PackError::kPackName);
    out.pack_version = stored.pack_version();
    out.security_counter = stored.security_counter();
    out.solver_abi_min = stored.solver_abi_min();
    out.solver_abi_max = stored.solver_abi_max();
    if (out.solver_abi_min > kSolverAbi || out.solver_abi_max < kOldestSolverAbi)
        return failure(PackError::kSolverVersion);
    if (stored.boards() != nullptr) {
        for (const flatbuffers::String* board : *stored.boards()) {
            const std::string_view name{board->c_str(), board->size()};
            if (!is_plain_text(name, kMaxNameBytes) || !out.boards.push_back(name))
                return failure(PackError::kPackName);
        }
    }
    return {};
}

Result<void, PackError> read_counts(const fb::Manifest& stored, PackManifest& out) {
    if (stored.solver() > static_cast<std::uint8_t>(kLastSolverKind)) return failure(PackError::kSolverKind);
    out.solver = static_cast<SolverKind>(stored.solver());
    out.counts.markers = stored.marker_count();
    out.counts.shapes = stored.shape_count();
    out.counts.rbf_dimensions = stored.rbf_dimension_count();
    out.counts.rbf_centres = stored.rbf_centre_count();
    out.counts.regions = stored.region_count();
    const PackCounts& n = out.counts;
    if (n.markers < kMinMarkers || n.markers > kMaxMarkers) return failure(PackError::kMarkerCount);
    if (n.shapes < 1 || n.shapes > kMaxShapes) return failure(PackError::kShapeCount);
    const bool rbf = out.solver == SolverKind::kRbf;
    const std::size_t least = rbf ? 1 : 0;
    const std::size_t dimension_limit = rbf ? kMaxRbfDimensions : 0;
    const std::size_t centre_limit = rbf ? kMaxRbfCentres : 0;
    if (n.rbf_dimensions < least || n.rbf_dimensions > dimension_limit || n.rbf_dimensions > 3 * n.markers ||
        n.rbf_centres < least || n.rbf_centres > centre_limit) {
        return failure(PackError::kRbfCounts);
    }
    const bool regional = is_regional(out.solver);
    if (n.regions < (regional ? 1 : 0) || n.regions > (regional ? kMaxRegions : 0)) {
        return failure(PackError::kRegionCount);
    }
    out.rate_hz = stored.rate_hz();
    out.noise_mm = stored.noise_mm();
    out.sparsity_mm2 = stored.sparsity_mm2();
    out.ridge_mm2 = stored.ridge_mm2();
    if (stored.rbf_kernel() >
        static_cast<std::uint8_t>(rbf ? RbfKernel::kMultiquadric : RbfKernel::kGaussian))
        return failure(PackError::kRbfKernel);
    out.rbf_kernel = static_cast<RbfKernel>(stored.rbf_kernel());
    out.rbf_hull_near_widths = stored.rbf_hull_near_widths();
    out.rbf_hull_far_widths = stored.rbf_hull_far_widths();
    if (auto ok = read_cameras(stored, out); !ok) return failure(ok.error());
    if (auto ok = read_reference_marks(stored, out); !ok) return failure(ok.error());
    out.memory_bytes = stored.memory_bytes();
    if (out.memory_bytes < out.total_bytes || out.memory_bytes > kMaxPackBytes)
        return failure(PackError::kMemory);
    return {};
}

bool all_zero(ByteSpan bytes) {
    for (const std::byte b : bytes) {
        if (b != std::byte{0}) return false;
    }
    return true;
}

// Appends the section after checking it against the end of the one before; `end` moves on.
Result<void, PackError> place_section(ByteSpan bytes, const PackSection& section, std::uint64_t& end,
                                      PackManifest& out) {
    if (section.offset % kPackAlignment != 0) return failure(PackError::kSectionAlignment);
    if (section.offset > bytes.size() || section.length > bytes.size() - section.offset) {
        return failure(PackError::kSectionOutside);
    }
    if (section.offset < end) return failure(PackError::kSectionOverlap);
    if (section.offset != align_up(end)) return failure(PackError::kSectionGap);
    if (!all_zero(bytes.subspan(end, section.offset - end))) return failure(PackError::kPadding);
    for (const PackSection& other : out.sections) {
        if (other.type == section.type) return failure(PackError::kSectionDuplicate);
    }
    end = section.offset + section.length;
    if (!out.sections.push_back(section)) return failure(PackError::kSectionCount);
    return {};
}

Result<void, PackError> read_sections(ByteSpan bytes, const fb::Manifest& stored, PackManifest& out) {
    const auto& table = *stored.sections();
    if (table.size() == 0 || table.size() > kSectionTypeCount) return failure(PackError::kSectionCount);
    std::uint64_t end = kPackHeaderBytes + out.manifest_bytes;
    for (const fb::Section* entry : table) {
        if (entry->type() < 1 || entry->type() > kSectionTypeCount || entry->reserved() != 0 ||
            entry->reserved2() != 0) {
            return failure(PackError::kSectionUnknown);
        }
        PackSection section;
        section.type = static_cast<SectionType>(entry->type());
        section.offset = entry->offset();
        section.length = entry->length();
        for (std::uint16_t i = 0; i < kHashBytes; ++i) section.hash[i] = std::byte{entry->hash()->Get(i)};
        if (auto placed = place_section(bytes, section, end, out); !placed) return placed;
    }
    if (end != bytes.size()) return failure(PackError::kTrailingBytes);
    return {};
}

}  // namespace

bool is_plain_text(std::string_view text, std::size_t max_bytes) {
    if (text.empty() || text.size() > max_bytes) return false;
    std::size_t i = 0;
    while (i < text.size()) {
        const auto lead = static_cast<unsigned char>(text[i]);
        if (lead < 0x20 || lead == 0x7f) return false;
        const std::size_t length = lead < 0x80   ? 1
                                   : lead < 0xc2 ? 0
                                   : lead < 0xe0 ? 2
                                   : lead < 0xf0 ? 3
                                   : lead < 0xf5 ? 4
                                                 : 0;
        if (length == 0 || length > text.size() - i) return false;
        for (std::size_t k = 1; k < length; ++k) {
            if ((static_cast<unsigned char>(text[i + k]) & 0xc0) != 0x80) return false;
        }
        if (length > 2) {
            // Overlong forms, surrogates and code points beyond U+10FFFF show in the second byte.
            const auto second = static_cast<unsigned char>(text[i + 1]);
            if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) ||
                (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f)) {
                return false;
            }
        }
        i += length;
    }
    return true;
}

std::string_view section_name(SectionType type) {
    switch (type) {
        case SectionType::kNeutral:
            return "neutral";
        case SectionType::kBasis:
            return "basis";
        case SectionType::kWeightLow:
            return "weight low";
        case SectionType::kWeightHigh:
            return "weight high";
        case SectionType::kPriorMean:
            return "prior mean";
        case SectionType::kPriorSigma:
            return "prior sigma";
        case SectionType::kTemporalGamma:
            return "temporal gamma";
        case SectionType::kShapeNames:
            return "shape names";
        case SectionType::kMarkerNames:
            return "marker names";
        case SectionType::kRbfMean:
            return "rbf mean";
        case SectionType::kRbfBasis:
            return "rbf basis";
        case SectionType::kRbfCentres:
            return "rbf centres";
        case SectionType::kRbfWidths:
            return "rbf widths";
        case SectionType::kRbfWeights:
            return "rbf weights";
        case SectionType::kRbfOffset:
            return "rbf offset";
        case SectionType::kRegionNames:
            return "region names";
        case SectionType::kRegionTable:
            return "region table";
        case SectionType::kRegionMarkers:
            return "region markers";
        case SectionType::kRegionMarkerBlend:
            return "marker blend";
        case SectionType::kRegionOrigin:
            return "region origin";
        case SectionType::kRegionExamples:
            return "region examples";
        case SectionType::kRegionShapes:
            return "region shapes";
        case SectionType::kRegionShapeBlend:
            return "shape blend";
        case SectionType::kMarkerSetNames:
            return "marker set names";
        case SectionType::kMarkerSetTable:
            return "marker set table";
        case SectionType::kMarkerSetMarkers:
            return "marker set markers";
        case SectionType::kMarkerSetMean:
            return "marker set mean";
        case SectionType::kMarkerSetModes:
            return "marker set modes";
        case SectionType::kMarkerSetVariance:
            return "marker set variance";
        case SectionType::kMarkerSetResidual:
            return "marker set residual";
    }
    return "unknown";
}

ByteSpan section_bytes(ByteSpan bytes, const PackSection& section) {
    RIG_CHECK(section.offset <= bytes.size() && section.length <= bytes.size() - section.offset);
    return bytes.subspan(section.offset, section.length);
}

Result<PackManifest, PackError> read_manifest(ByteSpan bytes, HashFunction hash) {
    const Result<Header, PackError> header = read_header(bytes);
    if (!header) return failure(header.error());
    PackManifest out;
    out.total_bytes = header->total_bytes;
    out.manifest_bytes = header->manifest_bytes;
    out.manifest_hash = header->manifest_hash;

    const ByteSpan raw = bytes.subspan(kPackHeaderBytes, out.manifest_bytes);
    Hash digest{};
    hash(raw, digest);
    if (digest != out.manifest_hash) return failure(PackError::kManifestHash);
    const auto* data = reinterpret_cast<const std::uint8_t*>(raw.data());
    flatbuffers::Verifier verifier(data, raw.size(), /*max_depth=*/8, /*max_tables=*/64);
    if (raw.size() < 8 || !fb::VerifyManifestBuffer(verifier)) return failure(PackError::kManifestStructure);
    const fb::Manifest& stored = *fb::GetManifest(data);
    if (!is_aligned(stored.sections()) || !is_aligned(stored.cameras()) ||
        !is_aligned(stored.camera_lenses()) || !is_aligned(stored.reference_marks()))
        return failure(PackError::kManifestStructure);

    if (auto ok = read_identity(stored, out); !ok) return failure(ok.error());
    if (auto ok = read_sections(bytes, stored, out); !ok) return failure(ok.error());
    if (auto ok = read_counts(stored, out); !ok) return failure(ok.error());
    return out;
}

}  // namespace rig
