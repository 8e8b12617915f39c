// What performances say about each weight: where it usually is, how far it strays, how fast it goes.
#pragma once

#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

// Weights are dimensionless; vectors are [N].
struct WeightStatistics {
    std::vector<double> mean;
    std::vector<double> sigma;  // standard deviation
    std::vector<double> step;   // rms change between two frames at the pack's rate, over the livelier frames
};

// What holds when no take is given: two recorded performances (a range-of-motion take and speech) have means
// of 0.13 and 0.06, pooled standard deviations of 0.15 and 0.10 and steps of 0.010 and 0.024 at 60 Hz over
// the shapes they use. The spread is taken twice as wide, so that full expressions of other performers are
// within three of it.
inline constexpr double kDefaultMean = 0.1;
inline constexpr double kDefaultSigma = 0.3;
inline constexpr double kDefaultStepAt60Hz = 0.03;

// A shape whose standard deviation in the takes is under this keeps the defaults: that it sleeps in one
// performance says nothing about another.
inline constexpr double kAsleepSigma = 0.005;

// Floors under what takes say: one performance is not all that a face can do.
inline constexpr double kLeastSigma = 0.1;
inline constexpr double kLeastStepAt60Hz = 0.01;

// The step is the rms over this share of a shape's frames, those in which it moves most. Most frames of a
// take hold still; a pull that suits those is late when something happens.
inline constexpr double kLivelyShare = 0.1;

// All takes have shape_count weights a frame. No frames: the defaults. Steps are scaled from each take's rate
// to rate_hz as speeds are; frames of different takes are not neighbours.
[[nodiscard]] WeightStatistics weight_statistics(std::span<const Take> takes, std::size_t shape_count,
                                                 double rate_hz);

}  // namespace rig::host
