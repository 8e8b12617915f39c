// "Basis": takes the face of one second at rest for the pack's neutral one, as an offset of each marker: how
// far the dot that is seen lies from the point that the pack means (glued a little aside, or its centroid off
// its centre). From then on the offsets are taken off before the face is stabilised and solved. Not for: a
// new neutral shape or new deltas; those need training.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_model.hpp"
#include "core/stabilise/stabilised_markers.hpp"
#include "core/track/named_markers.hpp"

namespace rig {

struct NeutralConfig {
    std::uint16_t frames = 60;       // at rest that are averaged: a second
    std::uint16_t most_ticks = 180;  // within which they must come
    double seen_share = 0.6;         // of the markers must be seen, each in half of the frames or more
    // A marker's rms distance from its mean place, on top of its noise: more is a movement. A face that is
    // asked to rest stays under 0.2 mm, a word moves lips by 2 mm and more.
    double still_mm = 0.4;
    // Rms over the markers of what the shapes explain of the displacement. Dots glued 1 mm aside at random
    // look like 0.6 mm of expression, a smile like 2 mm.
    double expression_mm = 1.2;
    double most_offset_mm = 5.0;  // of one marker
};

enum class NeutralPhase : std::uint8_t { kIdle = 0, kCollecting = 1, kTaken = 2, kRefused = 3 };
enum class NeutralRefusal : std::uint8_t {
    kNone = 0,
    kUnseen = 1,      // the face, or too many markers, were not seen long enough; value: share seen
    kMoved = 2,       // value: rms distance of `marker` from its mean place, mm
    kExpression = 3,  // value: rms over the markers of what is an expression, mm
    kOffset = 4,      // value: distance of `marker` from the neutral, mm
};

struct NeutralReport {
    NeutralPhase phase = NeutralPhase::kIdle;  // kTaken and kRefused only in the tick in which it ended
    NeutralRefusal refusal = NeutralRefusal::kNone;
    std::uint16_t frames = 0;  // collected so far
    std::uint16_t marker = 0;  // of the refusal, or of the largest offset
    double value = 0.0;        // of the refusal; when taken, the largest offset, mm
    double rms_mm = 0.0;       // when taken: of the offsets
};

struct NeutralState {
    // In force, face frame; a marker that was not seen while it rested keeps what it had.
    std::array<Vec3, kMaxMarkers> offset_mm{};
    bool any = false;  // some offset is not zero
    // Under way.
    bool collecting = false;
    std::uint16_t ticks = 0;
    std::uint16_t frames = 0;
    std::array<std::uint16_t, kMaxMarkers> seen{};
    std::array<Vec3, kMaxMarkers> sum_mm{};  // of displacements from neutral
    std::array<double, kMaxMarkers> squares_mm2{};
    std::array<Mat3, kMaxMarkers> information{};
    std::array<Vec3, kMaxMarkers> weighted{};  // information times displacement
    std::array<double, kMaxModes> coefficients{};
};

// Begins to collect, anew when it was under way. The offsets in force stay until it ends well.
void begin_neutral(NeutralState& state);
// No offsets, nothing under way.
void reset_neutral(NeutralState& state);

// Takes the offsets in force off markers in the headset frame; `pose` is where the face is about (a degree
// off moves an offset of 1 mm by 0.02 mm).
void subtract_offsets(const NeutralState& state, const Rigid& pose, NamedMarkers& named);

// One tick. `stabilised`: of this tick, offsets in force taken off; nothing when no face was there. When the
// last frame has come the offsets are set, all or none. neutral_mm [3m], noise_mm as in the pack.
void watch_neutral(const ShapeModel& model, std::span<const float> neutral_mm, double noise_mm,
                   const NeutralConfig& config, const StabiliserOutput* stabilised, NeutralState& state,
                   NeutralReport& report);

}  // namespace rig
