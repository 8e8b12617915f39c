// Which markers have come off the face and which have slid on it (F18), told from what tracking leaves over:
// a marker that is not seen for long although its neighbours are and a camera looks straight at its place;
// one that stays off the place which the rest of the face predicts, through many expressions. Not for:
// markers hidden for a moment, which inference fills in.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_fit.hpp"
#include "core/track/matching.hpp"
#include "core/track/topology.hpp"

namespace rig {

enum class MarkerTrouble : std::uint8_t { kNone = 0, kFallen = 1, kSlid = 2 };

// Of the information of a slid marker, what it keeps: where it is says little of the face.
inline constexpr double kSlidTrust = 0.1;

struct MarkerWatchConfig {
    double rate_hz = 60.0;
    double fallen_s = 5.0;   // unseen although it should be seen
    double astray_s = 1.0;   // a sighting without a name keeps its place beside an unseen marker
    double astray_mm = 6.0;  // ... within this of it; nor is a marker ever taken to have moved farther
    // Squared steps that show whether a sighting moves with the face or stands still under the helmet: by how
    // much the ones must exceed the others. A face at rest shows neither; then it takes three times as long.
    double astray_steps_mm2 = 10.0;
    // Off the face, which bends after a marker that slid and takes others along: 3 mm show as 1.6 and more,
    // and beside it as up to 1.0 (headrig experiment identity-troubles). Right ones stay within 0.05 on the
    // public takes.
    double slid_mm = 1.2;
    // The corners of the lips the face follows farther, 3 mm show as 1.05, but beside them as 0.66 at most.
    // So less is enough of a marker that stands off by so much more than any other.
    double slid_alone_mm = 0.8;
    double alone_ratio = 1.4;
    std::uint8_t slid_expressions = 10;  // ... in so many expressions more than it was not
    double new_expression = 1.0;         // distance of the coefficients from the last one that counted
    double facing_cosine = 0.64;         // of a marker's normal with a camera that surely sees it: 50 degrees
};

struct MarkerWatchState {
    std::array<MarkerTrouble, kMaxMarkers> trouble{};
    std::array<std::uint16_t, kMaxMarkers> absent_ticks{};
    std::array<std::uint16_t, kMaxMarkers> astray_ticks{};
    std::array<Vec3, kMaxMarkers> astray_mm{};           // from the expected place, face frame
    std::array<Vec3, kMaxMarkers> astray_place_mm{};     // headset frame
    std::array<double, kMaxMarkers> astray_steps_mm2{};  // about that place less about the face's, squared
    std::array<std::uint8_t, kMaxMarkers> off_count{};   // expressions in which it stood off, less the others
    std::array<double, kMaxModes> last_expression{};
};

// The place where each marker should be and what was found there. Spans: [marker_count].
struct WatchedFrame {
    std::span<const Vec3> expected_mm;  // headset frame, learnt bias and all
    const SightingSet& sightings;
    const LeftOverSightings& left_over;
    const NamedMarkers& named;
    const ShapeFit& fit;
};

// How far a marker stands off its place: its learnt bias less the neutral's offset.
[[nodiscard]] double off_its_place_mm(const Rigid& headset_from_face, std::span<const Vec3> neutral_offset_mm,
                                      const Vec3& bias_mm, std::size_t marker);

// One tracked frame. `bias_mm` [marker_count], headset frame: how each marker differs from the fitted face,
// learnt; a marker that was found astray for long gets its new place added there. `neutral_offset_mm`: of it,
// what the performer's neutral explains, face frame; empty: nothing.
void watch_markers(const ShapeModel& model, const Topology& topology, const MarkerWatchConfig& config,
                   const WatchedFrame& frame, std::span<const Vec3> neutral_offset_mm,
                   std::span<Vec3> bias_mm, MarkerWatchState& state);

}  // namespace rig
