#include "core/track/helmet_marks.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/track/sightings.hpp"

namespace rig {

namespace {

constexpr int kMostShifts = 64;  // tried in a frame: ten times what a face has near its helmet's marks

struct ExpectedMark {
    std::size_t mark = 0;  // of the pack
    Vec2 pixel = Vec2::Zero();
};
using ExpectedMarks = BoundedVector<ExpectedMark, kMaxReferenceMarks>;

ExpectedMarks expected_marks(const CameraModel& camera, std::size_t index,
                             std::span<const HelmetMark> marks) {
    ExpectedMarks expected;
    for (std::size_t i = 0; i < marks.size(); ++i) {
        if (!marks[i].is_seen_by(index)) continue;
        const Projection at = project(camera, marks[i].headset_mm);
        if (!(at.z_mm > 1.0) || !is_finite(at.pixel[0]) || !is_finite(at.pixel[1])) continue;
        const bool kept = expected.push_back({i, at.pixel});
        RIG_CHECK(kept);
    }
    return expected;
}

// The nearest observation that is not used yet, within reach; -1 when there is none.
int nearest(const Vec2& pixel, std::span<const Observation> observations, double reach_px,
            std::span<const std::int16_t> used, double& squared_px) {
    int best = -1;
    squared_px = reach_px * reach_px;
    for (std::size_t j = 0; j < observations.size(); ++j) {
        const Vec2 off = pixel_of(observations[j]) - pixel;
        const double d2 = off.dot(off);
        if (!(d2 < squared_px)) continue;
        if (std::find(used.begin(), used.end(), static_cast<std::int16_t>(j)) != used.end()) continue;
        best = static_cast<int>(j);
        squared_px = d2;
    }
    return best;
}

struct ShiftScore {
    std::size_t marks = 0;
    double missed_px2 = 0.0;  // squared distances, those of marks that are not there at the limit
};

ShiftScore score_shift(const ExpectedMarks& expected, std::span<const Observation> observations,
                       double reach_px, const Vec2& shift) {
    ShiftScore score;
    for (const ExpectedMark& mark : expected) {
        double squared_px = 0.0;
        score.marks += nearest(mark.pixel + shift, observations, reach_px, {}, squared_px) >= 0 ? 1U : 0U;
        score.missed_px2 += squared_px;
    }
    return score;
}

// Tried: no shift, and every shift that brings a mark onto an observation within reach.
Vec2 common_shift(const ExpectedMarks& expected, std::span<const Observation> observations,
                  const HelmetMarkConfig& config) {
    const double near_px = config.drift.mistaken_px;
    Vec2 best_shift = Vec2::Zero();
    ShiftScore best = score_shift(expected, observations, near_px, best_shift);
    const std::size_t needed = std::max<std::size_t>(2, (expected.size() + 1) / 2);
    // The normal case: the camera sits where it sat, though a strand of hair may hide a mark.
    if (best.marks >= needed) return best_shift;
    int tried = 0;
    for (const ExpectedMark& mark : expected) {
        for (const Observation& observation : observations) {
            const Vec2 shift = pixel_of(observation) - mark.pixel;
            if (!(shift.dot(shift) <= config.reach_px * config.reach_px)) continue;
            if (++tried > kMostShifts) return best_shift;
            const ShiftScore score = score_shift(expected, observations, near_px, shift);
            if (score.marks < needed || score.marks < best.marks) continue;
            if (score.marks == best.marks && score.missed_px2 >= best.missed_px2) continue;
            best = score;
            best_shift = shift;
        }
    }
    return best_shift;
}

// The small turn that moves the middle of the picture by this shift.
Vec3 turn_of_shift(const CameraModel& camera, const Vec2& shift_px) {
    return {-shift_px[1] / camera.fy_px, shift_px[0] / camera.fx_px, 0.0};
}

// Takes back the marks that lie off where the fitted camera sees them, and lists the others' observations.
void settle(const CameraModel& fitted, std::span<const HelmetMark> marks,
            std::span<const Observation> observations, double settled_px, HelmetMarkOutput& output) {
    for (std::size_t i = 0; i < marks.size(); ++i) {
        if (output.found[i] < 0) continue;
        const auto at = static_cast<std::size_t>(output.found[i]);
        const Vec2 off = pixel_of(observations[at]) - project(fitted, marks[i].headset_mm).pixel;
        if (!(off.dot(off) <= settled_px * settled_px)) {
            output.found[i] = -1;
            continue;
        }
        const bool kept = output.taken.push_back(static_cast<std::uint16_t>(at));
        RIG_CHECK(kept);
    }
    std::sort(output.taken.begin(), output.taken.end());
}

}  // namespace

void find_helmet_marks(const CameraModel& camera, std::size_t index, std::span<const HelmetMark> marks,
                       std::span<const Observation> observations, const HelmetMarkConfig& config,
                       MountDriftState& state, HelmetMarkOutput& output) {
    RIG_CHECK(marks.size() <= kMaxReferenceMarks && observations.size() <= kMaxObservations);
    output.found.fill(-1);
    output.taken.clear();
    output.drift = MountDriftReport{};
    output.now = camera;
    const CameraModel before = turned_camera(camera, state.turn_rad);
    const ExpectedMarks expected = expected_marks(before, index, marks);
    if (expected.empty()) return;
    const Vec2 shift = common_shift(expected, observations, config);
    BoundedVector<ReferenceMark, kMaxReferenceMarks> seen;
    for (const ExpectedMark& mark : expected) {
        double squared_px = 0.0;
        const int at =
            nearest(mark.pixel + shift, observations, config.drift.mistaken_px, output.found, squared_px);
        if (at < 0) continue;
        output.found[mark.mark] = static_cast<std::int16_t>(at);
        const bool kept = seen.push_back(
            {marks[mark.mark].headset_mm, pixel_of(observations[static_cast<std::size_t>(at)]), true});
        RIG_CHECK(kept);
    }
    const Vec3 start_rad = state.turn_rad + turn_of_shift(camera, shift);
    watch_mount(camera, config.drift, seen.span(), start_rad, state, output.drift);
    const Vec3 turn_rad = output.drift.measured ? output.drift.frame_turn_rad : start_rad;
    settle(turned_camera(camera, turn_rad), marks, observations, config.settled_px, output);
    if (state.started) output.now = turned_camera(camera, state.turn_rad);
}

}  // namespace rig
