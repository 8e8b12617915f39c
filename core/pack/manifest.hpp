// What the manifest of a pack says, as plain numbers, once the container itself is known to be whole.
// Not a judgement of the tensors: open_pack.hpp does that.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/base/bounded_vector.hpp"
#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/pack/pack_error.hpp"
#include "core/pack/pack_format.hpp"

namespace rig {

struct PackSection {
    SectionType type = SectionType::kNeutral;
    std::uint64_t offset = 0;  // from the start of the pack
    std::uint64_t length = 0;  // bytes
    Hash hash{};
};

// Views point into the pack's bytes.
struct PackManifest {
    std::array<std::uint8_t, 16> uuid{};
    std::string_view name;
    std::uint32_t pack_version = 0;
    std::uint32_t security_counter = 0;
    std::uint16_t solver_abi_min = 0;
    std::uint16_t solver_abi_max = 0;
    BoundedVector<std::string_view, kMaxPackBoards> boards;  // empty: any
    std::uint64_t memory_bytes = 0;
    std::uint64_t total_bytes = 0;
    std::uint32_t manifest_bytes = 0;
    Hash manifest_hash{};
    SolverKind solver = SolverKind::kBoxQp;
    PackCounts counts;
    float rate_hz = 0.0F;
    float noise_mm = 0.0F;
    float sparsity_mm2 = 0.0F;
    float ridge_mm2 = 0.0F;
    RbfKernel rbf_kernel = RbfKernel::kGaussian;
    float rbf_hull_near_widths = 0.0F;
    float rbf_hull_far_widths = 0.0F;
    BoundedVector<CameraModel, kMaxCameras> cameras;
    BoundedVector<HelmetMark, kMaxReferenceMarks> reference_marks;
    BoundedVector<PackSection, kSectionTypeCount> sections;  // in file order
};

// Checks, in this order: bounds, manifest hash, FlatBuffers structure, versions, section table (64-bit
// arithmetic; known types once each; aligned, in order, no overlap, no gap, inside, ending exactly at the
// end; zero padding), counts within core/limits.hpp, memory. Section hashes and contents are not looked at.
// Any bytes are safe.
[[nodiscard]] Result<PackManifest, PackError> read_manifest(ByteSpan bytes, HashFunction hash);

// The bytes of a section that read_manifest() returned for these same bytes.
[[nodiscard]] ByteSpan section_bytes(ByteSpan bytes, const PackSection& section);

// UTF-8 without control characters, 1 to max_bytes long.
[[nodiscard]] bool is_plain_text(std::string_view text, std::size_t max_bytes);

}  // namespace rig
