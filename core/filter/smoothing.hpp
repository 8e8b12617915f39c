// The smoothing stage: each shape through the filter that was chosen for it, all shapes of one moment.
//
// A Savitzky-Golay filter may answer for a frame some time back. The state has one capture time, so every
// shape waits for it: what another filter, or none, has made of a shape is handed out with the same delay.
// Lids from now on a jaw from a tenth of a second ago would be a face that never was.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/filter/one_euro.hpp"
#include "core/filter/savitzky_golay.hpp"
#include "core/limits.hpp"

namespace rig {

enum class FilterKind : std::uint8_t { kNone = 0, kOneEuro = 1, kSavitzkyGolay = 2 };

struct ShapeFilter {
    FilterKind kind = FilterKind::kOneEuro;
    std::uint8_t window_frames = 15;  // of kSavitzkyGolay: 3..kMaxWindowFrames, above the delay
    bool operator==(const ShapeFilter&) const = default;
};

// What a person chooses. Entries beyond the shapes of the pack are not looked at.
struct FilterChoice {
    std::array<ShapeFilter, kMaxShapes> shapes{};
    std::uint8_t delay_frames = 0;  // of all shapes, 0..kMaxWindowFrames - 1
    bool operator==(const FilterChoice&) const = default;
};

[[nodiscard]] bool is_valid(const FilterChoice& choice, std::size_t shape_count);
// The same filter for every shape.
[[nodiscard]] FilterChoice same_filter(ShapeFilter filter, std::uint8_t delay_frames);

struct SmoothingConfig {
    FilterChoice choice;
    bool any_one_euro = true;
    bool any_delay = false;  // some shape has a window, or there is a delay
    std::array<std::uint8_t, kMaxShapes> window_frames{};
    OneEuroConfig one_euro;
    std::span<const float> low;   // [N] ranges of the weights
    std::span<const float> high;  // [N]
};

// rate_hz: nominal, 1..1000. low, high: [N], outlive the config. Precondition: is_valid(choice, N).
void configure_smoothing(const FilterChoice& choice, double rate_hz, std::span<const float> low,
                         std::span<const float> high, SmoothingConfig& config);

struct SmoothingState {
    OneEuroState one_euro;
    SavitzkyGolayState savitzky_golay;
    std::array<double, kMaxShapes> undelayed{};
};

struct SmoothingReport {
    bool interval_clamped = false;     // the time since the frame before was not believed (F34)
    std::uint16_t inputs_refused = 0;  // not finite: an older value stands in
    std::uint16_t delay_frames = 0;    // of this answer
    std::int64_t delay_us = 0;
    std::int64_t answered_us = 0;  // capture time of the frame behind the weights that are handed on
};

// weights and filtered: [N], may be the same memory. filtered is always finite and in range.
void smooth(const SmoothingConfig& config, std::span<const double> weights, std::int64_t capture_us,
            SmoothingState& state, std::span<double> filtered, SmoothingReport& report);

void reset_smoothing(SmoothingState& state);

}  // namespace rig
