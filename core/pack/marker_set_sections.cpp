#include "core/pack/marker_set_sections.hpp"

namespace rig {

namespace {

constexpr double kOrthonormalTolerance = 1e-3;  // rows stored as float32; a wrong basis misses by far more

template <class T>
std::span<const T> take(std::span<const T>& from, std::size_t count) {
    const std::span<const T> part = from.first(count);
    from = from.subspan(count);
    return part;
}

Result<void, PackError> check_markers(const MarkerSetModel& set, std::size_t marker_count) {
    for (std::size_t a = 0; a < set.markers.size(); ++a) {
        const bool rising = a == 0 || set.markers[a] > set.markers[a - 1];
        if (set.markers[a] >= marker_count || !rising) return failure(PackError::kMarkerSetMarkers);
    }
    return {};
}

Result<void, PackError> check_modes(const MarkerSetModel& set) {
    const std::size_t rows = 3U * set.marker_count;
    for (std::size_t a = 0; a < set.mode_count; ++a) {
        if (a > 0 && set.variance_mm2[a] > set.variance_mm2[a - 1])
            return failure(PackError::kMarkerSetVariance);
        for (std::size_t b = 0; b <= a; ++b) {
            double sum = 0.0;
            for (std::size_t r = 0; r < rows; ++r) {
                sum += static_cast<double>(set.modes[a * rows + r]) *
                       static_cast<double>(set.modes[b * rows + r]);
            }
            const double error = sum - (a == b ? 1.0 : 0.0);
            if (error > kOrthonormalTolerance || error < -kOrthonormalTolerance)
                return failure(PackError::kMarkerSetModes);
        }
    }
    return {};
}

}  // namespace

Result<void, PackError> read_marker_set_table(ByteSpan table, PackCounts& counts, SolvePack& pack) {
    const std::size_t count = table.size() / kMarkerSetRecordBytes;
    if (table.size() % kMarkerSetRecordBytes != 0 || count < 1 || count > kMaxMarkerSets)
        return failure(PackError::kMarkerSetTable);
    for (std::size_t f = 0; f < count; ++f) {
        const std::size_t at = f * kMarkerSetRecordBytes;
        MarkerSetModel& set = pack.marker_sets[f];
        set.level = load<std::uint8_t>(table, at);
        set.marker_count = load<std::uint16_t>(table, at + 2);
        set.mode_count = load<std::uint16_t>(table, at + 4);
        const bool reserved =
            load<std::uint8_t>(table, at + 1) != 0 || load<std::uint16_t>(table, at + 6) != 0;
        const bool sizes = set.marker_count >= 1 && set.marker_count <= counts.markers &&
                           set.mode_count >= 1 && set.mode_count <= kMaxModes &&
                           set.mode_count <= 3U * set.marker_count;
        const bool whole = set.level == 0 && set.marker_count == counts.markers;
        const bool order = f == 0 ? whole : set.level >= 1 && set.level >= pack.marker_sets[f - 1].level;
        if (reserved || !sizes || !order || set.level > kDeepestMarkerSetLevel)
            return failure(PackError::kMarkerSetTable);
        counts.set_markers += set.marker_count;
        counts.set_modes += set.mode_count;
        counts.set_mode_floats += 3U * set.marker_count * set.mode_count;
    }
    counts.marker_sets = count;
    pack.marker_set_count = static_cast<std::uint8_t>(count);
    return {};
}

Result<void, PackError> assemble_marker_sets(const MarkerSetSections& sections, SolvePack& pack) {
    MarkerSetSections rest = sections;
    for (std::size_t f = 0; f < pack.marker_set_count; ++f) {
        MarkerSetModel& set = pack.marker_sets[f];
        const std::size_t m = set.marker_count;
        const std::size_t k = set.mode_count;
        set.name = sections.names[f];
        set.markers = take(rest.markers, m);
        set.mean_mm = take(rest.mean_mm, 3 * m);
        set.modes = take(rest.modes, 3 * m * k);
        set.variance_mm2 = take(rest.variance_mm2, k);
        set.residual_mm2 = take(rest.residual_mm2, m);
        if (auto ok = check_markers(set, pack.marker_count); !ok) return ok;
        if (auto ok = check_modes(set); !ok) return ok;
    }
    return {};
}

}  // namespace rig
