#include "firmware_host/companion/fit/marker_take.hpp"

#include <cmath>

#include "firmware_host/companion/rig_folder/rig_checks.hpp"

namespace rig::host {

bool MarkerTake::seen(std::size_t frame, std::size_t marker) const {
    const Vec3& p = at(frame, marker);
    const auto usable = [](double x) { return std::abs(x) <= static_cast<double>(kMaxCoordinateMm); };
    return usable(p[0]) && usable(p[1]) && usable(p[2]);  // false for NaN
}

Result<MarkerTake, FileError> marker_take_of(const NpyArray<float>& array, const std::filesystem::path& name,
                                             double rate_hz) {
    if (array.shape.size() != 3 || array.shape[2] != 3)
        return file_failure(name, "not a marker stream; expected an array (frames, markers, 3)");
    if (array.shape[0] == 0 || array.shape[1] == 0) return file_failure(name, "the stream has no frames");
    MarkerTake take{.frame_count = array.shape[0],
                    .marker_count = array.shape[1],
                    .rate_hz = rate_hz,
                    .positions_mm = {}};
    take.positions_mm.reserve(take.frame_count * take.marker_count);
    for (std::size_t i = 0; i < take.frame_count * take.marker_count; ++i) {
        take.positions_mm.emplace_back(static_cast<double>(array.values[3 * i]),
                                       static_cast<double>(array.values[3 * i + 1]),
                                       static_cast<double>(array.values[3 * i + 2]));
    }
    return take;
}

Result<MarkerTake, FileError> load_marker_take(const std::filesystem::path& npy, double rate_hz) {
    const auto array = read_npy<float>(npy);
    if (!array) return failure(array.error());
    return marker_take_of(*array, npy, rate_hz);
}

MarkerTake thinned(const MarkerTake& take, std::size_t most) {
    const std::size_t stride = (take.frame_count + most - 1) / most;
    if (stride <= 1) return take;
    MarkerTake out{.frame_count = 0,
                   .marker_count = take.marker_count,
                   .rate_hz = take.rate_hz / static_cast<double>(stride),
                   .positions_mm = {}};
    for (std::size_t f = 0; f < take.frame_count; f += stride) {
        const auto begin = take.positions_mm.begin() + static_cast<std::ptrdiff_t>(f * take.marker_count);
        out.positions_mm.insert(out.positions_mm.end(), begin,
                                begin + static_cast<std::ptrdiff_t>(take.marker_count));
        ++out.frame_count;
    }
    return out;
}

}  // namespace rig::host
