// Where on the mesh the markers of a performer really sit, from a recorded range-of-motion take:
// marker-to-mesh initialisation [Hybrid16 section 6], for a layout that is known only roughly and a take in
// any frame and scale.
//
//   round 0   landmarks -> Procrustes (R, t, scale); the layout as given is solved and judged
//   round 1   every marker: nearest triangle, barycentric coordinates of its neutral position; solve.
//             If that made it worse, the neutral frames were not neutral: back to the layout as given.
//   round r   every marker: among the Q nearest triangles, the place with the lowest error over the
//             take; similarity again; solve
//   end       when no marker's error changes by more than a threshold, or after the allowed rounds
//
// What is left of each marker's error, its mean vector over the take in the face frame, becomes the marker's
// offset in the layout: subtracting it from every target is the same.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "firmware_host/companion/fit/marker_take.hpp"
#include "firmware_host/companion/fit/similarity.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

// How a marker is put into a candidate triangle.
enum class Placement : std::uint8_t {
    kTake,    // the barycentric coordinates with the lowest error over the take (ours)
    kNeutral  // projection of the marker's position in the neutral frames, as the source has it
};

struct FitOptions {
    std::size_t neutral_begin = 0;  // frames [begin, end) hold the neutral face; their mean is the neutral
    std::size_t neutral_end = 1;    // position of each marker
    std::vector<std::string> landmarks;  // markers that were placed with care; empty: all of them
    std::size_t candidates = 32;         // Q: 1..512 triangles; how far a marker may walk in a round
    std::size_t most_rounds = 10;        // after round 0
    double threshold_mm = 0.02;          // of the change of any marker's error
    double noise_mm = 0.1;               // of one marker coordinate
    bool scaled = true;                  // false: rig and take are in the same millimetres
    bool stabilised = true;              // false: nothing moves the head in the take
    Placement placement = Placement::kTake;
};

inline constexpr std::size_t kMostTriangles = 512;
// Of a longer take every k-th frame is used: neighbours show the same moment.
inline constexpr std::size_t kMostFitFrames = 2000;

// Distances between marker and model over the take, mm.
struct FitRound {
    double rms_mm = 0.0;     // over markers and frames
    double mean_mm = 0.0;    // of the markers' own rms
    double worst_mm = 0.0;   // largest of them
    double change_mm = 0.0;  // largest change of one of them since the round before
    std::size_t moved = 0;   // markers that went to another triangle
};

struct FittedMarker {
    double given_mm = 0.0;   // rms error over the take at the place as given
    double rms_mm = 0.0;     // ... at the place found, before the offset is subtracted
    double walked_mm = 0.0;  // from the place as given to the place found, along a straight line
    std::size_t frames = 0;  // that saw it
};

struct LayoutFit {
    MarkerLayout layout;           // places found, with offsets; on the rig scaled by rig_scale
    double rig_scale = 1.0;        // rig in the take's millimetres = rig_scale x rig as given
    Similarity face_from_take;     // of the rig as given
    std::vector<FitRound> rounds;  // [0]: the layout as given
    bool converged = false;
    bool projection_refused = false;  // round 1 was worse than the layout as given, which was kept instead
    double final_rms_mm = 0.0;        // solved again with the offsets
    std::vector<FittedMarker> markers;
};

// `stage` says what is being done, share is 0..1 of the whole.
using FitProgress = std::function<void(double share, const std::string& stage)>;

// What is wrong with the options, with the remedy; empty when nothing is.
[[nodiscard]] std::string fault_of_options(const FitOptions& options);

// Marker k of the take is marker k of the layout. Errors: another number of markers, unknown landmarks, a
// marker that no neutral frame or too few frames show, landmarks on a line, markers that stay far off the
// mesh. Deterministic.
[[nodiscard]] Result<LayoutFit, FileError> fit_layout(const Rig& rig, const MarkerLayout& rough,
                                                      const MarkerTake& take, const FitOptions& options,
                                                      const FitProgress& progress = {});

// The rig with every length multiplied.
[[nodiscard]] Rig scaled_rig(const Rig& rig, double scale);

}  // namespace rig::host
