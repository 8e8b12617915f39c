// Drawing a roughly placed face onto sightings without names, until each has one: what the bootstrap does
// with its starts and the second opinion with its doubts. Not for: where to start; that is theirs.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/shape_fit.hpp"
#include "core/track/matching.hpp"

namespace rig {

// How far the face may be from where a start has it.
struct NamingReach {
    double rotation_sigma_rad = 0.15;
    double translation_sigma_mm = 12.0;
};

inline constexpr double kNamingGateMm = 3.0;  // around the face of the last round

struct NamingWorkspace {
    MatchingWorkspace matching;
    ShapeFitWorkspace fit;
    ShapeModel coarse;  // the leading modes alone
    Matches matches{};
    NamedMarkers named;
    ShapeFit trial;
    std::array<Vec3, kMaxMarkers> predicted_mm{};  // headset frame
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> informations{};
};

// Fills workspace.coarse, which approach() fits. To be called when `model` is another one.
void take_leading_modes(const ShapeModel& model, ShapeModel& coarse);

// Draws a start near: pose and the leading modes onto the nearest sightings. Returns how well they are
// explained: the sum over those within 6 mm of a marker of 1 - (distance / 6 mm)^2.
double approach(const NamingReach& reach, const SightingSet& sightings, NamingWorkspace& workspace,
                ShapeFit& fit);

// Deformable matching in rounds of tightening gates. Afterwards workspace.trial is the face, predicted_mm its
// markers, matches and named what they were taken for.
void run_rounds(const ShapeModel& model, const NamingReach& reach, const ShapeFit& start,
                const SightingSet& sightings, NamingWorkspace& workspace);

// The face that given names ask for, as the last round would have it; trial and predicted_mm as above.
void fit_to_names(const ShapeModel& model, const NamingReach& reach, const ShapeFit& start,
                  const SightingSet& sightings, const Matches& matches, NamingWorkspace& workspace);

// What a naming leaves unexplained, mm^2: of each named sighting the squared distance from its marker, of
// each other one the squared gate, which is also the most of any.
[[nodiscard]] double naming_cost_mm2(const ShapeModel& model, const SightingSet& sightings,
                                     const Matches& matches, const NamingWorkspace& workspace);

}  // namespace rig
