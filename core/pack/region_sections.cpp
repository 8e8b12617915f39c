#include "core/pack/region_sections.hpp"

#include "core/base/float_kernels.hpp"

namespace rig {

namespace {

constexpr double kBlendTolerance = 1e-4;  // of a sum of float32 shares
constexpr double kOriginTolerance_mm = 0.01;
constexpr double kCentreTolerance_mm = 1e-3;  // for each example of the sum that has to be zero

bool near(double x, double y, double tolerance) {
    return x - y <= tolerance && y - x <= tolerance;
}

Result<void, PackError> check_markers(const RegionModel& region, std::size_t marker_count) {
    for (std::size_t a = 0; a < region.markers.size(); ++a) {
        const bool rising = a == 0 || region.markers[a] > region.markers[a - 1];
        if (region.markers[a] >= marker_count || !rising) return failure(PackError::kRegionMarkers);
    }
    return {};
}

bool is_centroid(const RegionModel& region, std::span<const float> neutral_mm) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double sum = 0.0;
        for (const std::uint16_t k : region.markers) sum += static_cast<double>(neutral_mm[3U * k + axis]);
        const double centroid = sum / static_cast<double>(region.markers.size());
        for (std::size_t a = 0; a < region.markers.size(); ++a) {
            if (!near(static_cast<double>(region.origin_mm[3 * a + axis]), centroid, kOriginTolerance_mm))
                return false;
        }
    }
    return true;
}

Result<void, PackError> check_examples(const RegionModel& region) {
    const std::size_t stride = padded(region.example_count);
    for (std::size_t r = 0; r < 3U * region.marker_count; ++r) {
        const float* row = region.examples_mm.data() + r * stride;
        double sum = 0.0;
        for (std::size_t j = 0; j < region.example_count; ++j) sum += static_cast<double>(row[j]);
        for (std::size_t j = region.example_count; j < stride; ++j) {
            if (row[j] != 0.0F) return failure(PackError::kRegionExamples);
        }
        const double tolerance = kCentreTolerance_mm * static_cast<double>(region.example_count);
        if (region.solver == RegionSolver::kSimplex && !near(sum, 0.0, tolerance))
            return failure(PackError::kRegionExamples);
    }
    return {};
}

Result<void, PackError> check_blends(const SolvePack& pack) {
    std::array<double, kMaxMarkers> marker_sum{};
    std::array<double, kMaxShapes> shape_sum{};
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionModel& region = pack.regions[r];
        for (std::size_t a = 0; a < region.markers.size(); ++a)
            marker_sum[region.markers[a]] += static_cast<double>(region.marker_blend[a]);
        for (std::size_t i = 0; i < pack.shape_count; ++i)
            shape_sum[i] += static_cast<double>(region.shape_blend[i]);
    }
    for (const double sum : marker_sum) {
        if (sum != 0.0 && !near(sum, 1.0, kBlendTolerance)) return failure(PackError::kRegionMarkerBlend);
    }
    for (const double sum : shape_sum) {
        if (sum != 0.0 && !near(sum, 1.0, kBlendTolerance)) return failure(PackError::kRegionShapeBlend);
    }
    return {};
}

template <class T>
std::span<const T> take(std::span<const T>& from, std::size_t count) {
    const std::span<const T> part = from.first(count);
    from = from.subspan(count);
    return part;
}

}  // namespace

Result<void, PackError> read_region_table(ByteSpan table, SolverKind solver, PackCounts& counts,
                                          SolvePack& pack) {
    if (table.size() != kRegionRecordBytes * counts.regions) return failure(PackError::kSectionLength);
    const RegionSolver own =
        solver == SolverKind::kExamples ? RegionSolver::kSimplex : RegionSolver::kNonNegative;
    bool has_own = false;
    pack.region_count = static_cast<std::uint8_t>(counts.regions);
    for (std::size_t r = 0; r < counts.regions; ++r) {
        const std::size_t at = r * kRegionRecordBytes;
        const auto kind = load<std::uint8_t>(table, at);
        RegionModel& region = pack.regions[r];
        region.marker_count = load<std::uint16_t>(table, at + 2);
        region.example_count = load<std::uint16_t>(table, at + 4);
        const bool reserved =
            load<std::uint8_t>(table, at + 1) != 0 || load<std::uint16_t>(table, at + 6) != 0;
        if (kind > static_cast<std::uint8_t>(RegionSolver::kSimplex) || reserved || region.marker_count < 1 ||
            region.marker_count > counts.markers || region.example_count < 1 ||
            region.example_count > kMaxRegionShapes) {
            return failure(PackError::kRegionTable);
        }
        region.solver = static_cast<RegionSolver>(kind);
        has_own |= region.solver == own;
        counts.region_markers += region.marker_count;
        counts.region_examples += region.example_count;
        counts.region_example_floats += 3U * region.marker_count * padded(region.example_count);
    }
    return has_own ? Result<void, PackError>{} : failure(PackError::kRegionTable);
}

Result<std::span<const std::uint16_t>, PackError> read_marker_list(ByteSpan part, std::size_t count) {
    if (part.size() != sizeof(std::uint16_t) * count) return failure(PackError::kSectionLength);
    // Aligned, as every section is.
    return std::span(reinterpret_cast<const std::uint16_t*>(part.data()), count);
}

Result<void, PackError> assemble_regions(const RegionSections& sections, SolvePack& pack) {
    RegionSections rest = sections;
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        RegionModel& region = pack.regions[r];
        const std::size_t m = region.marker_count;
        const std::size_t n = region.example_count;
        region.name = sections.names[r];
        region.markers = take(rest.markers, m);
        region.marker_blend = take(rest.marker_blend, m);
        region.origin_mm = take(rest.origin_mm, 3 * m);
        region.examples_mm = take(rest.examples_mm, 3 * m * padded(n));
        region.shapes = take(rest.shapes, n * pack.shape_count);
        region.shape_blend = take(rest.shape_blend, pack.shape_count);
        if (auto ok = check_markers(region, pack.marker_count); !ok) return ok;
        if (region.solver == RegionSolver::kNonNegative && !is_centroid(region, pack.neutral_mm))
            return failure(PackError::kRegionOrigin);
        if (auto ok = check_examples(region); !ok) return ok;
    }
    return check_blends(pack);
}

}  // namespace rig
