// Bytes to a SolvePack, or the reason why not. The only way by which numbers from outside become a pack.
#pragma once

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/pack/manifest.hpp"
#include "core/pack/pack_error.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

// Everything of read_manifest(), then section hashes, then meaning: lengths fit the counts, all numbers
// finite and of a size a face can have, low <= high, sigma > 0, widths > 0, RBF rows orthonormal, cameras
// plausible, names plain and unique. `bytes` starts at a 64-byte boundary in memory (a mapped file does) and
// must outlive the result, which points into it. `hash` is SHA-256. Any bytes are safe; nothing is allocated.
[[nodiscard]] Result<SolvePack, PackError> open_pack(ByteSpan bytes, HashFunction hash);

// The rule for one camera: kCameraIntrinsics or kCameraRotation. Any numbers are safe.
[[nodiscard]] Result<void, PackError> check_camera(const CameraModel& camera);
// The rule for one reference mark of a rig with so many cameras: kReferenceMarks. Any numbers are safe.
[[nodiscard]] Result<void, PackError> check_reference_mark(const HelmetMark& mark, std::size_t camera_count);

}  // namespace rig
