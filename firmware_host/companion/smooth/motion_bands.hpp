// A recorded curve split into frequency bands, each with a gain of its own [Bruderlin, Williams: Motion
// signal processing, SIGGRAPH 1995, section 2; Deng06 section 7]:
//
//   G_0 = x,  G_(k+1) = w_k * G_k,  L_k = G_k - G_(k+1),  k = 0..K-1
//   y = G_K + sum_k gain_k L_k
//
// w_0 = (1 4 6 4 1) / 16, the cubic B-spline kernel of the paper; w_k is w_0 with 2^k - 1 zeros between its
// numbers, so nothing is decimated and every level has all frames. K = the largest with 2^K <= frames, so
// that G_K is little more than the mean. Band 0 holds the fastest motion, from frame to frame;
// band k >= 1 is centred at a period of about 3.7 2^k frames (7.1, 15.0, ...). Beyond its ends a curve is
// continued by its point reflection, 2 x_end - x, so that a ramp stays a ramp. All gains 1 give the input
// back to rounding, whatever the bands.
//
// Not causal: for finished takes. On the board: core/filter.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace rig::host {

// K for a curve of that many frames; 0 for one frame or none.
[[nodiscard]] std::size_t band_count(std::size_t frames);
// Frames a cycle of the frequency that passes band k most, on an endless curve.
[[nodiscard]] double band_period_frames(std::size_t band);

// gains: of bands 0, 1, ...; bands beyond them keep the last gain's place with gain 1. low <= high bound
// every frame of the answer. x: finite.
[[nodiscard]] std::vector<double> shape_bands(std::span<const double> x, std::span<const double> gains,
                                              double low, double high);

// Convolution with a Gaussian of that standard deviation, cut at four of them and normalised, ends reflected
// as above [Zhang06 section 14.1]. sigma_frames >= 0; 0 gives x back. The answer lies in [low, high].
[[nodiscard]] std::vector<double> smooth_gaussian(std::span<const double> x, double sigma_frames, double low,
                                                  double high);

}  // namespace rig::host
