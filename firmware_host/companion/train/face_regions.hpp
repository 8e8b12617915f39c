// Which markers belong to which part of a face, from where they sit on the neutral face: the regions that are
// solved on their own. Not what is learned in them: regional_training.hpp.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

// How large a layout is, about the eyes.
struct LayoutExtent {
    double half_width_mm = 1.0;  // of the widest marker from the middle
    double depth_mm = 1.0;       // of the lowest marker below the eyes
};
[[nodiscard]] LayoutExtent extent_of(const MarkerLayout& layout);

// A marker may belong to several regions; its blends sum to 1.
struct MarkerRegion {
    std::string name;
    std::vector<std::uint16_t> markers;  // rising
    std::vector<double> blend;           // > 0
};

// Eyes and mouth [Chuang02 section 5], with a band between them in which the blends go over linearly; pupils
// as a region of their own when markers are named so ("pupil" or "iris" in their name). Regions without
// markers are left out. neutral: face frame, origin between the eyes, so that heights are shares of the
// lowest marker's.
[[nodiscard]] std::vector<MarkerRegion> feature_regions(const MarkerLayout& layout);

// Up to 14 small regions [Zhang06 section 5.3]: forehead, glabella, eyes, nose, cheeks, corners of the mouth,
// lips, chin, jaws. A marker near a border belongs to all regions that meet there. Regions that would own
// fewer than three markers are shared out among the others.
[[nodiscard]] std::vector<MarkerRegion> surface_regions(const MarkerLayout& layout);

// The markers around the lips: those that belong to the lips and their corners among the surface regions more
// than to others. What [Chuang02 Fig. 6] measures on; the mouth of feature_regions() reaches up to the nose.
[[nodiscard]] MarkerRegion lip_region(const MarkerLayout& layout);

// One region with every marker.
[[nodiscard]] std::vector<MarkerRegion> whole_face(const MarkerLayout& layout);

// [regions x N] row-major: how much each region has to say of each shape, as the share of the shape's squared
// motion at the region's markers; shares under 2 % are given to the others, so that no region decides about
// what it hardly sees. A shape's shares sum to 1, or to 0 when it moves none of the markers.
[[nodiscard]] std::vector<double> shape_shares(std::span<const MarkerRegion> regions,
                                               std::span<const float> basis_mm, std::size_t shape_count);

}  // namespace rig::host
