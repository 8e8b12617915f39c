#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/limits.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/rig_folder/obj_import.hpp"
#include "firmware_host/companion/rig_folder/rig_checks.hpp"
#include "firmware_host/companion/rig_folder/surface.hpp"

namespace rig::host {

namespace {

constexpr double kMaxDistance_mm = 20.0;  // a measured point lies on the skin; more is a wrong unit or frame

struct ListColumns {
    std::size_t name = 0;
    std::optional<std::size_t> vertex;
    std::optional<std::array<std::size_t, 3>> point;
};

std::optional<std::size_t> find_column(const CsvReader& reader, std::string_view name) {
    const auto found = std::ranges::find(reader.columns(), name);
    if (found == reader.columns().end()) return std::nullopt;
    return static_cast<std::size_t>(found - reader.columns().begin());
}

Result<ListColumns, FileError> find_columns(const CsvReader& reader) {
    const auto name = find_column(reader, "name");
    const auto x = find_column(reader, "x");
    const auto y = find_column(reader, "y");
    const auto z = find_column(reader, "z");
    ListColumns columns{.name = name.value_or(0), .vertex = find_column(reader, "vertex"), .point = {}};
    if (x && y && z) columns.point = {*x, *y, *z};
    if (!name || (!columns.vertex && !columns.point)) {
        return reader.fail("a marker list has the columns name,vertex or name,x,y,z");
    }
    return columns;
}

Result<void, FileError> place_on_vertex(const CsvReader& reader, std::size_t column, const Rig& rig,
                                        LayoutMarker& marker) {
    const auto index = reader.integer(column);
    if (!index) return failure(index.error());
    if (*index < 0 || static_cast<std::uint64_t>(*index) >= rig.vertices_mm.size()) {
        return reader.fail(fmt::format("vertex {} is not in the mesh of {} vertices (they count from 0)",
                                       *index, rig.vertices_mm.size()));
    }
    const auto vertex = static_cast<std::int32_t>(*index);
    marker.vertices = {vertex, vertex, vertex};
    marker.barycentric = {1.0F, 0.0F, 0.0F};
    return {};
}

Result<void, FileError> place_on_surface(const CsvReader& reader, const std::array<std::size_t, 3>& columns,
                                         const Rig& rig, double mm_per_unit, LayoutMarker& marker) {
    Double3 point_mm{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto value = reader.number(columns[axis]);
        if (!value) return failure(value.error());
        point_mm[axis] = *value * mm_per_unit;
    }
    const SurfacePoint nearest = nearest_surface_point(rig, point_mm);
    if (!(nearest.distance_mm <= kMaxDistance_mm)) {
        return reader.fail(
            fmt::format("marker '{}' is {:.1f} mm off the surface; check --unit, --scale and the axes",
                        printable(marker.name), nearest.distance_mm));
    }
    marker.vertices = rig.triangles[nearest.triangle];
    for (std::size_t i = 0; i < 3; ++i) marker.barycentric[i] = static_cast<float>(nearest.barycentric[i]);
    return {};
}

Result<LayoutMarker, FileError> read_marker(const CsvReader& reader, const ListColumns& columns,
                                            const Rig& rig, double mm_per_unit,
                                            const std::vector<Double3>& normals) {
    LayoutMarker marker;
    marker.name = reader.fields()[columns.name];
    const bool by_vertex = columns.vertex && (!columns.point || !reader.fields()[*columns.vertex].empty());
    const auto placed = by_vertex ? place_on_vertex(reader, *columns.vertex, rig, marker)
                                  : place_on_surface(reader, *columns.point, rig, mm_per_unit, marker);
    if (!placed) return failure(placed.error());
    if (!settle_on_mesh(rig, normals, marker)) {
        return reader.fail(
            fmt::format("marker '{}' has no normal: no face with an area is there", printable(marker.name)));
    }
    return marker;
}

}  // namespace

Result<MarkerLayout, FileError> parse_marker_list(std::string_view text, const std::filesystem::path& name,
                                                  const Rig& rig, double mm_per_unit) {
    auto reader = CsvReader::open(text, name);
    if (!reader) return failure(reader.error());
    const auto columns = find_columns(*reader);
    if (!columns) return failure(columns.error());
    const std::vector<Double3> normals = vertex_normals(rig);
    MarkerLayout layout;
    while (true) {
        const auto more = reader->next();
        if (!more) return failure(more.error());
        if (!*more) break;
        if (layout.markers.size() == kMaxMarkers)
            return reader->fail(fmt::format("more than {} markers", kMaxMarkers));
        auto marker = read_marker(*reader, *columns, rig, mm_per_unit, normals);
        if (!marker) return failure(marker.error());
        layout.markers.push_back(std::move(*marker));
    }
    if (const auto ok = check_layout(name, layout, rig); !ok) return failure(ok.error());
    return layout;
}

}  // namespace rig::host
