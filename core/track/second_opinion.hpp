// Whether the names of a tracked face are the best there are: the face is drawn to the same sightings anew,
// from other expressions, without what the tracker remembers. A start may put the lower lip on the chin, and
// motion, prior and learnt bias then keep it there; what gives it away is that sightings are left over beside
// markers that none was found for, or that the face has to bend. Not for: swaps inside a frame; the tracker's
// second naming sees those.
#pragma once

#include <cstdint>
#include <span>

#include "core/track/naming_rounds.hpp"

namespace rig {

// The expression as it is by its leading modes, the mean one, the first three modes far to either side, and
// the first farther still: a jaw wide open.
inline constexpr std::uint8_t kOpinions = 10;

struct SecondOpinionState {
    std::uint8_t left = 0;       // opinions still to be asked for, one a frame
    std::uint8_t suspicion = 0;  // frames that looked wrong, less those that did not
    std::uint16_t pause = 0;     // frames until suspicion counts again
    std::uint16_t next_pause = 0;
    std::uint16_t taken_lately = 0;  // frames in which another opinion that is taken leaves the pauses alone
};

// Every opinion is asked for in the frames that follow.
void ask_for_opinions(SecondOpinionState& state);

// One was better: suspicion was right, and is listened to as at first. Not when one was taken a moment
// before: two namings that a ghost makes equally good would take turns for ever.
void take_opinion(SecondOpinionState& state);

// Of one frame and its final names. `odd`: something else about the names is wrong. Suspicion that lasts asks
// for opinions; when they change nothing, ever more time passes before the next.
void suspect(const ShapeModel& model, std::span<const Vec3> predicted_mm, const SightingSet& sightings,
             const Matches& matches, const LeftOverSightings& left_over, bool odd, SecondOpinionState& state);

// One opinion (0..kOpinions - 1) on a frame's sightings and names, `fit` the face behind the names. True:
// another naming leaves clearly less unexplained (naming_cost_mm2), by at least half a sighting; it is in
// workspace.matches, its face in workspace.trial. Failing that, each opinion looks at a few rivals: a marker
// that none was found for, beside a sighting that only one view gives to another marker. A camera sees along
// its ray no farther than the first of them, and the wrong one of both bends the face; so the rival has the
// name when the face then fits clearly better. `off_place` [marker_count] or empty: markers known to stand
// off their place on the face, whose sightings nobody else claims. Work is bounded: five coarse and eleven
// whole fits.
[[nodiscard]] bool second_opinion(const ShapeModel& model, const ShapeFit& fit, const SightingSet& sightings,
                                  const Matches& matches, std::span<const bool> off_place,
                                  std::uint8_t opinion, NamingWorkspace& workspace);

}  // namespace rig
