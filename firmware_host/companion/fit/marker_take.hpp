// A recorded stream of named markers, as `headrig solve` takes it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "core/base/linalg.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

struct MarkerTake {
    std::size_t frame_count = 0;
    std::size_t marker_count = 0;
    double rate_hz = 60.0;
    std::vector<Vec3> positions_mm;  // [frame * marker_count + marker]; not finite: not seen

    [[nodiscard]] const Vec3& at(std::size_t frame, std::size_t marker) const {
        return positions_mm[frame * marker_count + marker];
    }
    // Finite and within 1e5 mm.
    [[nodiscard]] bool seen(std::size_t frame, std::size_t marker) const;
};

// Float32 .npy (frames, markers, 3), mm. Errors name the file: another shape, no frames.
[[nodiscard]] Result<MarkerTake, FileError> load_marker_take(const std::filesystem::path& npy,
                                                             double rate_hz);
[[nodiscard]] Result<MarkerTake, FileError> marker_take_of(const NpyArray<float>& array,
                                                           const std::filesystem::path& name, double rate_hz);

// Every k-th frame, k the least that leaves at most `most` of them; the rate falls with it.
[[nodiscard]] MarkerTake thinned(const MarkerTake& take, std::size_t most);

}  // namespace rig::host
