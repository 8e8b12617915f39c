#include "firmware_host/daemon/output_gate.hpp"

#include <algorithm>
#include <cmath>

namespace rig {

namespace {

// Number of numbers changed: 0 or 1.
std::uint32_t put_in_range(float& value, float low, float high, float otherwise) {
    const float kept = std::isfinite(value) ? std::clamp(value, low, high) : otherwise;
    const bool changed = !(kept == value);
    value = kept;
    return changed ? 1 : 0;
}

constexpr float kLargestSlip = 1e5F;

}  // namespace

void OutputGate::configure(std::span<const float> low, std::span<const float> high) {
    low_ = low;
    high_ = high;
    for (std::size_t i = 0; i < low_.size(); ++i) held_[i] = std::clamp(0.0F, low_[i], high_[i]);
}

std::uint32_t OutputGate::pass(FaceState& state) {
    std::uint32_t changed = 0;
    state.shape_count = static_cast<std::uint16_t>(std::min<std::size_t>(state.shape_count, low_.size()));
    for (std::size_t i = 0; i < state.shape_count; ++i) {
        changed += put_in_range(state.weights[i], low_[i], high_[i], held_[i]);
        changed += put_in_range(state.confidence[i], 0.0F, 1.0F, 0.0F);
        held_[i] = state.weights[i];
    }
    for (float& turn : state.slip.rotation_rad)
        changed += put_in_range(turn, -kLargestSlip, kLargestSlip, 0.0F);
    for (float& shift : state.slip.translation_mm)
        changed += put_in_range(shift, -kLargestSlip, kLargestSlip, 0.0F);
    if (changed > 0) state.faults |= fault_bit(Fault::kSolveWeak);
    return changed;
}

}  // namespace rig
