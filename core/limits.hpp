// Every capacity of core, with its unit and its reason. A capacity reached at run time is a counted outcome of the
// stage that met it, never a silent change of the answer.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rig {

inline constexpr std::size_t kMaxCameras = 4;         // a helmet carries one to four
inline constexpr std::size_t kMaxMarkers = 128;       // the densest published layout has 102
inline constexpr std::size_t kMinMarkers = 4;         // fewer do not fix a rigid motion
inline constexpr std::size_t kMaxShapes = 256;        // artists' rigs reach 200 to 250
inline constexpr std::size_t kMaxRows = 3 * kMaxMarkers;
inline constexpr std::size_t kMaxObservations = 256;  // per camera and frame: every marker twice
inline constexpr std::size_t kMaxPoints = 256;        // unlabelled 3D points of one frame: every marker twice
inline constexpr std::size_t kMaxModes = 48;         // shape-space dimensions of tracker and stabiliser
inline constexpr std::size_t kMaxRbfCentres = 256;    // reference frames of one pack; the sources use 100
inline constexpr std::size_t kMaxRbfDimensions = 32;  // principal components kept; the sources use 4 to 20
inline constexpr std::size_t kMaxImageWidth = 1920;   // px
inline constexpr std::size_t kMaxImageHeight = 1200;  // px
inline constexpr std::size_t kMaxNameBytes = 63;      // of one shape or marker, UTF-8
inline constexpr std::size_t kMaxPackBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxManifestBytes = std::size_t{16} << 10;  // one read, before anything is trusted
inline constexpr std::size_t kMaxWireFrameBytes = 655;                   // on the wire, delimiters included

static_assert(kMaxObservations >= 2 * kMaxMarkers);
static_assert(kMaxPoints >= 2 * kMaxMarkers);
static_assert(kMaxModes <= kMaxShapes);

}  // namespace rig
