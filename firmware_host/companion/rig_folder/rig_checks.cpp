#include "firmware_host/companion/rig_folder/rig_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "core/limits.hpp"

namespace rig::host {

namespace {

// Layout files carry six decimals of each weight and four of a normal.
constexpr float kBarycentricTolerance = 1.0e-3F;
constexpr float kNormalTolerance = 1.0e-2F;
// A layout made for another head is far off; rounding of its own head is not.
constexpr float kNeutralToleranceMm = 0.05F;

Result<void, FileError> check_marker(const std::filesystem::path& where, const LayoutMarker& marker,
                                     const Rig& rig) {
    const auto fail = [&](std::string_view fault) {
        return file_failure(where, fmt::format("marker '{}': {}", printable(marker.name), fault));
    };
    Float3 surface_mm{};
    float sum = 0.0F;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::int32_t vertex = marker.vertices[corner];
        const float share = marker.barycentric[corner];
        if (vertex < 0 || static_cast<std::size_t>(vertex) >= rig.vertices_mm.size()) {
            return fail(
                fmt::format("vertex {} is not in the mesh of {} vertices", vertex, rig.vertices_mm.size()));
        }
        if (!(share >= -kBarycentricTolerance && share <= 1.0F + kBarycentricTolerance)) {
            return fail("a barycentric weight is outside 0..1");
        }
        sum += share;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            surface_mm[axis] += share * rig.vertices_mm[static_cast<std::size_t>(vertex)][axis];
        }
    }
    if (std::abs(sum - 1.0F) > kBarycentricTolerance) return fail("the barycentric weights do not sum to 1");
    if (!is_usable_point(marker.neutral_mm)) return fail("its neutral position is not a finite point in mm");
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (std::abs(surface_mm[axis] - marker.neutral_mm[axis]) > kNeutralToleranceMm) {
            return fail(
                "its neutral position is not where vertices and weights put it (a layout of another head?)");
        }
    }
    for (const float offset : marker.offset_mm) {
        if (!(std::abs(offset) <= kMaxOffsetMm))
            return fail(fmt::format("its offset is not a number up to {} mm", kMaxOffsetMm));
    }
    const Float3& n = marker.normal;
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(std::abs(length - 1.0F) <= kNormalTolerance)) return fail("its normal is not of unit length");
    return {};
}

}  // namespace

bool is_usable_name(std::string_view name) {
    if (name.empty() || name.size() > kMaxNameBytes || name.front() == ' ' || name.back() == ' ')
        return false;
    return std::ranges::none_of(name, [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte < 0x20 || byte == 0x7F || c == ',' || c == '"';
    });
}

bool is_usable_point(const Float3& point_mm) {
    return std::ranges::all_of(point_mm, [](float x) { return std::abs(x) <= kMaxCoordinateMm; });
}

Result<void, FileError> check_names(const std::filesystem::path& where, const std::vector<std::string>& names,
                                    std::size_t max_count, std::string_view noun) {
    if (names.empty()) return file_failure(where, fmt::format("no {} in it", noun));
    if (names.size() > max_count) {
        return file_failure(
            where, fmt::format("{} names of {}s, at most {} are possible", names.size(), noun, max_count));
    }
    std::unordered_set<std::string_view> seen;
    for (const std::string& name : names) {
        if (!is_usable_name(name)) {
            return file_failure(
                where, fmt::format("'{}' cannot be the name of a {} (1 to {} bytes, printable, no comma)",
                                   printable(name), noun, kMaxNameBytes));
        }
        if (!seen.insert(name).second) {
            return file_failure(where, fmt::format("two {}s are named '{}'", noun, name));
        }
    }
    return {};
}

Result<void, FileError> check_layout(const std::filesystem::path& where, const MarkerLayout& layout,
                                     const Rig& rig) {
    std::vector<std::string> names;
    for (const LayoutMarker& marker : layout.markers) names.push_back(marker.name);
    if (const auto ok = check_names(where, names, kMaxMarkers, "marker"); !ok) return ok;
    if (names.size() < kMinMarkers) {
        return file_failure(where,
                            fmt::format("{} markers, at least {} are needed", names.size(), kMinMarkers));
    }
    for (const LayoutMarker& marker : layout.markers) {
        if (const auto ok = check_marker(where, marker, rig); !ok) return ok;
    }
    return {};
}

}  // namespace rig::host
