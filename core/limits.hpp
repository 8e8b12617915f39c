// Every capacity of core, with its unit and its reason. A capacity reached at run time is a counted outcome
// of the stage that met it, never a silent change of the answer.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rig {

inline constexpr std::size_t kMaxCameras = 4;     // a helmet carries one to four
inline constexpr std::size_t kMaxMarkers = 128;   // the densest published layout has 102
inline constexpr std::size_t kMinMarkers = 4;     // fewer do not fix a rigid motion
inline constexpr std::size_t kMaxShapes = 256;    // artists' rigs reach 200 to 250
inline constexpr std::size_t kMaxUnknowns = 288;  // of one quadratic problem: every shape, and head room
inline constexpr std::size_t kMaxRows = 3 * kMaxMarkers;
inline constexpr std::size_t kMaxObservations = 256;  // per camera and frame: every marker twice
inline constexpr std::size_t kMaxPoints = 256;        // unlabelled 3D points of one frame: every marker twice
inline constexpr std::size_t kMaxModes = 48;          // shape-space dimensions of tracker and stabiliser
inline constexpr std::size_t kMaxRbfCentres = 256;    // reference frames of one pack; the sources use 100
inline constexpr std::size_t kMaxRbfDimensions = 32;  // principal components kept; the sources use 4 to 20
inline constexpr std::size_t kMaxRegions = 16;        // solved on their own; the sources use 3 and 14
inline constexpr std::size_t kMaxRegionShapes = 32;  // key shapes or examples of one; the sources use 8 to 15
inline constexpr std::size_t kMaxMarkerSets = 24;    // overlapping, for unseen markers; the source has 21
inline constexpr std::size_t kMaxReferenceMarks = 16;  // of a helmet; a bracket bends as a whole, few suffice
inline constexpr std::size_t kMaxWindowFrames = 61;    // of a smoothing filter: a second at 60 Hz
inline constexpr std::size_t kMaxControlPairs = 128;   // of each kind an artist may tie: every shape once
inline constexpr std::size_t kMaxImageWidth = 1920;    // px
inline constexpr std::size_t kMaxImageHeight = 1200;   // px
inline constexpr std::size_t kBlockPx = 4;  // side of the squares whose means make the local background
inline constexpr std::size_t kMaxBlocks = (kMaxImageWidth / kBlockPx) * (kMaxImageHeight / kBlockPx);
inline constexpr std::size_t kMaxRuns = 32768;  // horizontal runs of one image and polarity; a face has 2,000
inline constexpr std::size_t kMaxSplitRuns =
    8192;                                       // runs of one component that is cut again at a deeper level
inline constexpr std::size_t kMaxBlobs = 2048;  // components of a marker's least area or more, per image
inline constexpr std::size_t kMaxCandidates =
    1024;  // blobs that passed every check, before the best are kept
inline constexpr std::size_t kBlobWindowPx =
    64;  // square in which one blob is measured: one machine word a row
inline constexpr std::size_t kMaxDotDiameterPx = 48;  // leaves 8 px of skin on every side inside the window
inline constexpr std::size_t kMaxNameBytes = 63;      // of one shape or marker, UTF-8
inline constexpr std::size_t kMaxPackBoards = 16;     // boards that one pack names as compatible
inline constexpr std::size_t kMaxPackBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxManifestBytes = std::size_t{16}
                                                 << 10;  // one read, before anything is trusted
inline constexpr std::size_t kMaxWireFrameBytes = 655;   // on the wire, delimiters included

static_assert(kMaxObservations >= 2 * kMaxMarkers);
static_assert(kMaxPoints >= 2 * kMaxMarkers);
// the largest pack that can be written fits: basis, RBF basis, centres, weights as float32
static_assert(4 * (kMaxRows * kMaxShapes + kMaxRbfDimensions * kMaxRows + kMaxRbfCentres * kMaxRbfDimensions +
                   kMaxRbfCentres * kMaxShapes) <=
              kMaxPackBytes / 2);
// ... and the largest regional one: examples, their origins, their shapes, blends
static_assert(4 * kMaxRegions *
                  (kMaxRows * (kMaxRegionShapes + 3) + kMaxRegionShapes * kMaxShapes + kMaxShapes) <=
              kMaxPackBytes / 2);
// ... and every marker set with the whole face in it
static_assert(4 * kMaxMarkerSets * kMaxRows * (kMaxModes + 3) <= kMaxPackBytes / 2);
static_assert(kMaxModes <= kMaxShapes);
static_assert(kMaxShapes <= kMaxUnknowns);
static_assert(kMaxDotDiameterPx + 16 <= kBlobWindowPx);
static_assert(kMaxCandidates >= kMaxObservations);
static_assert(kMaxImageWidth % kBlockPx == 0 && kMaxImageHeight % kBlockPx == 0);

}  // namespace rig
