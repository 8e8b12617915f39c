#include "firmware_host/companion/world/slip_motion.hpp"

#include <algorithm>
#include <numbers>

namespace rig::host {

namespace {

// Every axis is built in [-1, 1] and then scaled so that the length over three axes keeps the bound.
constexpr double kDriftShare = 0.62;
constexpr double kJoltShare = 0.22;
constexpr double kStepShare = 0.16;
constexpr double kJoltWindow_s = 2.7;  // one jolt in each
constexpr double kJoltRing_hz = 6.0;   // a helmet on a strap
constexpr double kJoltDecay_s = 0.12;
constexpr double kStepWindow_s = 11.0;  // one step in each
constexpr double kStepRise_s = 0.08;

enum Stream : std::uint64_t {
    kFrequency = 100,
    kPhase = 200,
    kJoltTime = 300,
    kJoltSize = 400,
    kStepTime = 500,
    kStepSize = 600
};

double smooth_rise(double x) {
    const double t = std::clamp(x, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

}  // namespace

SlipMotion::SlipMotion(SlipKind kind, std::uint64_t seed) : kind_(kind), seed_(seed) {}

SlipBound SlipMotion::bound() const {
    constexpr double kRadian = std::numbers::pi / 180.0;
    switch (kind_) {
        case SlipKind::kGentle:
            return {1.5 * kRadian, 4.0};
        case SlipKind::kHard:
            return {3.0 * kRadian, 8.0};
        case SlipKind::kNone:
            break;
    }
    return {};
}

// Three slow sines, started at their own zero time so that the take begins unslipped.
double SlipMotion::drift(std::uint64_t axis, double time_s) const {
    constexpr std::array<double, 3> kSlowest_hz = {0.015, 0.05, 0.12};
    constexpr std::array<double, 3> kShare = {0.5, 0.33, 0.17};
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double hz = kSlowest_hz[k] * (1.0 + uniform(seed_, kFrequency + axis, k));
        const double phase = 2.0 * std::numbers::pi * uniform(seed_, kPhase + axis, k);
        const double swing = std::sin(2.0 * std::numbers::pi * hz * time_s + phase) - std::sin(phase);
        sum += 0.5 * kShare[k] * swing;
    }
    return sum;
}

double SlipMotion::jolts(std::uint64_t axis, double time_s) const {
    const auto window = static_cast<std::int64_t>(std::floor(time_s / kJoltWindow_s));
    for (std::int64_t w = window; w >= std::max<std::int64_t>(0, window - 1); --w) {
        const auto index = static_cast<std::uint64_t>(w);
        // A jolt shakes all axes at the same moment, in the first part of its window so that one never meets
        // the next.
        const double start =
            kJoltWindow_s * (static_cast<double>(w) + 0.1 + 0.5 * uniform(seed_, kJoltTime, index));
        const double since = time_s - start;
        if (since < 0.0) continue;
        const double size = 2.0 * uniform(seed_, kJoltSize + axis, index) - 1.0;
        return size * std::exp(-since / kJoltDecay_s) *
               std::sin(2.0 * std::numbers::pi * kJoltRing_hz * since);
    }
    return 0.0;
}

// Between two levels, the older of which is 0 at the start of the take.
double SlipMotion::steps(std::uint64_t axis, double time_s) const {
    const auto window = static_cast<std::uint64_t>(std::floor(time_s / kStepWindow_s));
    const double start =
        kStepWindow_s * (static_cast<double>(window) + 0.2 + 0.6 * uniform(seed_, kStepTime, window));
    const double before = window == 0 ? 0.0 : 2.0 * uniform(seed_, kStepSize + axis, window - 1) - 1.0;
    const double after = 2.0 * uniform(seed_, kStepSize + axis, window) - 1.0;
    return before + (after - before) * smooth_rise((time_s - start) / kStepRise_s);
}

HeadsetSlip SlipMotion::at(double time_s) const {
    HeadsetSlip slip;
    if (kind_ == SlipKind::kNone) return slip;
    const SlipBound limit = bound();
    const double per_axis = 1.0 / std::sqrt(3.0);
    for (std::uint64_t axis = 0; axis < 6; ++axis) {
        const double value = per_axis * (kDriftShare * drift(axis, time_s) +
                                         kJoltShare * jolts(axis, time_s) + kStepShare * steps(axis, time_s));
        if (axis < 3) {
            slip.rotation_rad[axis] = limit.rotation_rad * value;
        } else {
            slip.translation_mm[axis - 3] = limit.translation_mm * value;
        }
    }
    return slip;
}

}  // namespace rig::host
