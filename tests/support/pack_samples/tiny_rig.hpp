// A rig of a few hundred vertices with known shapes, for tests that train.
#pragma once

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::test {

struct TinyRig {
    host::Rig rig;
    host::MarkerLayout layout;
    host::Take take;
};

// A bulging sheet; shape i pushes the neighbourhood of a point of its own outwards and sideways. Markers sit
// on vertices. The take moves every shape with its own period; frames at 60 Hz.
[[nodiscard]] TinyRig tiny_rig(std::size_t marker_count, std::size_t shape_count, std::size_t frame_count);

}  // namespace rig::test
