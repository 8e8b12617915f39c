#include "firmware_host/companion/train/marker_sets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "firmware_host/companion/train/face_regions.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kLeastMarkers = 4;  // twelve coordinates: room for the source's 5 to 10 components
// How far a border between two sets reaches, in the face's height below the eyes: markers in it bridge them.
constexpr double kFeatureBorder = 0.2;
constexpr double kDetailBorder = 0.1;

struct Anchor {
    const char* name;
    double across;  // share of the widest marker's distance from the middle, left positive
    double up;      // share of the lowest marker's distance below the eyes
};

constexpr std::array<Anchor, 4> kFeatures{
    {{"left_eye", 0.5, 0.2}, {"right_eye", -0.5, 0.2}, {"nose", 0.0, -0.2}, {"mouth", 0.0, -0.7}}};

constexpr std::array<Anchor, 16> kDetails{{{"forehead", 0.0, 0.45},
                                           {"left_inner_brow", 0.2, 0.25},
                                           {"right_inner_brow", -0.2, 0.25},
                                           {"left_outer_brow", 0.65, 0.3},
                                           {"right_outer_brow", -0.65, 0.3},
                                           {"left_lower_lid", 0.5, -0.12},
                                           {"right_lower_lid", -0.5, -0.12},
                                           {"nose_bridge", 0.0, -0.05},
                                           {"nose_tip", 0.0, -0.3},
                                           {"left_cheek", 0.75, -0.35},
                                           {"right_cheek", -0.75, -0.35},
                                           {"left_mouth_corner", 0.4, -0.52},
                                           {"right_mouth_corner", -0.4, -0.52},
                                           {"upper_lip", 0.0, -0.45},
                                           {"lower_lip", 0.0, -0.66},
                                           {"chin", 0.0, -0.95}}};

double distance_mm(const LayoutMarker& marker, const Anchor& anchor, const LayoutExtent& extent) {
    return std::hypot(static_cast<double>(marker.neutral_mm[0]) - anchor.across * extent.half_width_mm,
                      static_cast<double>(marker.neutral_mm[1]) - anchor.up * extent.depth_mm);
}

// The markers for which this anchor is not farther than the nearest one and the border, and at least the
// kLeastMarkers nearest.
std::vector<std::uint16_t> markers_of(const MarkerLayout& layout, const Anchor& anchor,
                                      std::span<const Anchor> level, const LayoutExtent& extent,
                                      double border_mm) {
    const std::size_t m = layout.markers.size();
    std::vector<double> gap_mm(m);
    std::vector<bool> chosen(m, false);
    for (std::size_t k = 0; k < m; ++k) {
        gap_mm[k] = distance_mm(layout.markers[k], anchor, extent);
        double nearest_mm = gap_mm[k];
        for (const Anchor& other : level)
            nearest_mm = std::min(nearest_mm, distance_mm(layout.markers[k], other, extent));
        chosen[k] = gap_mm[k] <= nearest_mm + border_mm;
    }
    std::vector<std::size_t> order(m);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return gap_mm[k]; });
    for (std::size_t i = 0; i < std::min(kLeastMarkers, m); ++i) chosen[order[i]] = true;
    std::vector<std::uint16_t> out;
    for (std::size_t k = 0; k < m; ++k) {
        if (chosen[k]) out.push_back(static_cast<std::uint16_t>(k));
    }
    return out;
}

void add_level(const MarkerLayout& layout, std::span<const Anchor> anchors, std::uint8_t level, double border,
               std::vector<MarkerSet>& sets) {
    const LayoutExtent extent = extent_of(layout);
    for (const Anchor& anchor : anchors) {
        MarkerSet set{anchor.name, level,
                      markers_of(layout, anchor, anchors, extent, border * extent.depth_mm)};
        const bool known =
            std::ranges::any_of(sets, [&](const MarkerSet& other) { return other.markers == set.markers; });
        if (!known) sets.push_back(std::move(set));
    }
}

}  // namespace

std::vector<MarkerSet> marker_sets(const MarkerLayout& layout) {
    std::vector<MarkerSet> sets(1);
    sets[0].name = "face";
    for (std::size_t k = 0; k < layout.markers.size(); ++k)
        sets[0].markers.push_back(static_cast<std::uint16_t>(k));
    add_level(layout, kFeatures, 1, kFeatureBorder, sets);
    add_level(layout, kDetails, 2, kDetailBorder, sets);
    return sets;
}

}  // namespace rig::host
