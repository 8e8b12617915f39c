// Which markers make up the named sets of a face, level by level, from where they sit on the neutral face
// [Zhang06 section 10, Fig. 4]. Not how they move together: marker_set_training.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

struct MarkerSet {
    std::string name;
    std::uint8_t level = 0;
    std::vector<std::uint16_t> markers;  // rising
};

// Up to 21 sets: level 0 the whole face; level 1 left eye, right eye, nose, mouth; level 2 sixteen details
// (forehead, brows, lids, bridge, tip of the nose, cheeks, corners, lips, chin). Sets of a level overlap
// where they meet, and every marker is in one of each level. A set has at least four markers, the nearest
// ones; a set with the same markers as one before it is left out, so sparse layouts have fewer. Names are
// unique. layout: at least one marker.
[[nodiscard]] std::vector<MarkerSet> marker_sets(const MarkerLayout& layout);

}  // namespace rig::host
