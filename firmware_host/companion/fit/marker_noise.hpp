// How noisy a recorded marker coordinate is. Three estimates that mean different things:
//
// - hold: spread about the mean while the face holds still. All noise, slow noise too, and every tremor.
// - differences: fourth differences, by their median. White noise alone, from any take: a face that moves
//   10 mm at 2 Hz adds 0.02 mm to a fourth difference at 60 Hz (0.44 to a second one), noise of 0.1 mm
//   makes 0.84 (0.24).
// - residual: what the solved model leaves, with its degrees of freedom taken off. Noise, misplaced markers
//   and everything the shapes cannot do; well above the others it asks for `headrig fit`.
//
// A pack's noise is the hold's where there is one, else the differences'.
#pragma once

#include <optional>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/fit/marker_take.hpp"
#include "firmware_host/companion/fit/take_solve.hpp"

namespace rig::host {

struct CoordinateNoise {
    std::vector<Vec3> sigma_mm;  // [m] of each coordinate; zero where too few frames tell
    double pooled_mm = 0.0;      // root mean square of those that are told; 0: none is
    std::size_t markers = 0;     // that are told
};

inline constexpr std::size_t kLeastNoiseSamples = 20;

// Standard deviation about the mean over frames [begin, end), which are clamped to the take.
[[nodiscard]] CoordinateNoise noise_of_hold(const MarkerTake& take, std::size_t begin, std::size_t end);

// Median of |x[t-2] - 4 x[t-1] + 6 x[t] - 4 x[t+1] + x[t+2]| over 0.6745 sqrt(70), where five frames in a row
// saw the marker.
[[nodiscard]] CoordinateNoise noise_of_differences(const MarkerTake& take);

// sqrt(sum of squared residuals / (coordinates seen - weights off their bounds)), over the frames that were
// solved; nothing when no freedom is left. `take` is in the face frame up to slip; the slip takes no freedom:
// it creeps from frame to frame, so the noise of one frame hardly moves it.
[[nodiscard]] std::optional<double> noise_of_residual(const SolvePack& pack, const MarkerTake& take,
                                                      const SolvedTake& solved);

}  // namespace rig::host
