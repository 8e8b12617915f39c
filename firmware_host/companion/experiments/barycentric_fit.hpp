// One case of the experiment "hybrid16-barycentric": marker-to-mesh initialisation over a range-of-motion
// take [Hybrid16 section 6].
//
// The true places are the head's layout of 60 markers; the layout as given has every marker moved 1 or 3 mm
// along the skin, each in a direction of its own. The take is the recorded performance on the true places
// after half a second of neutral face, with 0.1 mm of noise, in a frame and scale of its own. The motion is
// exactly linear in the shapes of the head, which flatters the solver.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "firmware_host/companion/fit/layout_fit.hpp"

namespace rig::host {

struct BarycentricCase {
    double misplaced_mm = 1.0;
    std::uint64_t seed = 1;
    Placement placement = Placement::kTake;
};

struct BarycentricFigures {
    double given_mm = 0.0;   // rms distance of marker and model over the take, layout as given
    double fitted_mm = 0.0;  // ... with the places found, before offsets
    double final_mm = 0.0;   // ... after the offsets
    std::size_t rounds = 0;
    double place_given_mm = 0.0;  // rms distance from the true places on the neutral mesh
    double place_fitted_mm = 0.0;
    double scale_error = 0.0;  // of the similarity, relative
    std::vector<FitRound> history;
};

// `data` is the folder with rig/ and takes/.
[[nodiscard]] Result<BarycentricFigures, FileError> measure_barycentric(const std::filesystem::path& data,
                                                                        const BarycentricCase& which);

}  // namespace rig::host
