#include "firmware_host/companion/rig_folder/layout_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/limits.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/rig_folder/rig_checks.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

using Columns = std::array<std::size_t, 3>;

struct LayoutColumns {
    std::optional<std::size_t> number;
    std::size_t name = 0;
    Columns vertices{};
    Columns barycentric{};
    std::optional<Columns> neutral;
    Columns normal{};
    std::optional<Columns> offset;
};

std::optional<std::size_t> find_column(const CsvReader& reader, std::string_view name) {
    const auto& columns = reader.columns();
    const auto found = std::ranges::find(columns, name);
    if (found == columns.end()) return std::nullopt;
    return static_cast<std::size_t>(found - columns.begin());
}

Result<Columns, FileError> find_three(const CsvReader& reader, const std::array<const char*, 3>& names) {
    Columns columns{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto column = find_column(reader, names[i]);
        if (!column) return reader.fail(fmt::format("column '{}' is missing", names[i]));
        columns[i] = *column;
    }
    return columns;
}

Result<LayoutColumns, FileError> find_columns(const CsvReader& reader) {
    LayoutColumns columns;
    columns.number = find_column(reader, "marker");
    const auto name = find_column(reader, "name");
    if (!name) return reader.fail("column 'name' is missing");
    columns.name = *name;
    const auto vertices = find_three(reader, {"v0", "v1", "v2"});
    if (!vertices) return failure(vertices.error());
    columns.vertices = *vertices;
    const auto barycentric = find_three(reader, {"b0", "b1", "b2"});
    if (!barycentric) return failure(barycentric.error());
    columns.barycentric = *barycentric;
    const auto normal = find_three(reader, {"nx", "ny", "nz"});
    if (!normal) return failure(normal.error());
    columns.normal = *normal;
    if (find_column(reader, "ox_mm")) {
        const auto offset = find_three(reader, {"ox_mm", "oy_mm", "oz_mm"});
        if (!offset) return failure(offset.error());
        columns.offset = *offset;
    }
    if (find_column(reader, "x_mm")) {
        const auto neutral = find_three(reader, {"x_mm", "y_mm", "z_mm"});
        if (!neutral) return failure(neutral.error());
        columns.neutral = *neutral;
    }
    return columns;
}

Result<Float3, FileError> read_three(const CsvReader& reader, const Columns& columns) {
    Float3 values{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto value = reader.number(columns[i]);
        if (!value) return failure(value.error());
        values[i] = static_cast<float>(*value);
    }
    return values;
}

Result<Int3, FileError> read_vertices(const CsvReader& reader, const Columns& columns,
                                      std::size_t vertex_count) {
    Int3 vertices{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto value = reader.integer(columns[i]);
        if (!value) return failure(value.error());
        if (*value < 0 || static_cast<std::uint64_t>(*value) >= vertex_count) {
            return reader.fail(
                fmt::format("vertex {} is not in the mesh of {} vertices", *value, vertex_count));
        }
        vertices[i] = static_cast<std::int32_t>(*value);
    }
    return vertices;
}

Float3 surface_point(const LayoutMarker& marker, const Rig& rig) {
    Float3 point_mm{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const Float3& vertex = rig.vertices_mm[static_cast<std::size_t>(marker.vertices[corner])];
        for (std::size_t axis = 0; axis < 3; ++axis)
            point_mm[axis] += marker.barycentric[corner] * vertex[axis];
    }
    return point_mm;
}

Result<LayoutMarker, FileError> read_marker(const CsvReader& reader, const LayoutColumns& columns,
                                            std::size_t row, const Rig& rig) {
    if (columns.number) {
        const auto number = reader.integer(*columns.number);
        if (!number) return failure(number.error());
        if (*number < 0 || static_cast<std::uint64_t>(*number) != row) {
            return reader.fail(fmt::format("marker {} stands where marker {} is expected", *number, row));
        }
    }
    LayoutMarker marker;
    marker.name = reader.fields()[columns.name];
    const auto vertices = read_vertices(reader, columns.vertices, rig.vertices_mm.size());
    if (!vertices) return failure(vertices.error());
    marker.vertices = *vertices;
    const auto barycentric = read_three(reader, columns.barycentric);
    if (!barycentric) return failure(barycentric.error());
    marker.barycentric = *barycentric;
    const auto normal = read_three(reader, columns.normal);
    if (!normal) return failure(normal.error());
    marker.normal = *normal;
    if (columns.offset) {
        const auto offset = read_three(reader, *columns.offset);
        if (!offset) return failure(offset.error());
        marker.offset_mm = *offset;
    }
    marker.neutral_mm = surface_point(marker, rig);
    if (!columns.neutral) return marker;
    const auto neutral = read_three(reader, *columns.neutral);
    if (!neutral) return failure(neutral.error());
    marker.neutral_mm = *neutral;
    return marker;
}

// Root mean square over shapes of a marker's motion, for people who read the file.
double rms_motion_mm(const MarkerModel& model, std::size_t marker, std::size_t shape_count) {
    double sum = 0.0;
    for (std::size_t row = 3 * marker; row < 3 * marker + 3; ++row) {
        for (std::size_t s = 0; s < shape_count; ++s) {
            const double delta = static_cast<double>(model.basis_mm[row * shape_count + s]);
            sum += delta * delta;
        }
    }
    return std::sqrt(sum / static_cast<double>(shape_count));
}

std::string layout_text(const MarkerLayout& layout, const MarkerModel& model, std::size_t shape_count) {
    // Layouts without offsets are the rule and keep the columns that other programs know.
    const bool offsets = std::ranges::any_of(
        layout.markers, [](const LayoutMarker& marker) { return marker.offset_mm != Float3{}; });
    std::vector<std::string> columns{"marker", "name", "v0",   "v1", "v2", "b0", "b1",    "b2",
                                     "x_mm",   "y_mm", "z_mm", "nx", "ny", "nz", "rms_mm"};
    if (offsets) columns.insert(columns.end(), {"ox_mm", "oy_mm", "oz_mm"});
    CsvWriter csv{columns};
    for (std::size_t m = 0; m < layout.markers.size(); ++m) {
        const LayoutMarker& marker = layout.markers[m];
        csv.integer(static_cast<std::int64_t>(m)).text(marker.name);
        for (const std::int32_t vertex : marker.vertices) csv.integer(vertex);
        for (const float share : marker.barycentric) csv.number(static_cast<double>(share), 6);
        for (const float x_mm : marker.neutral_mm) csv.number(static_cast<double>(x_mm), 4);
        for (const float n : marker.normal) csv.number(static_cast<double>(n), 4);
        csv.number(rms_motion_mm(model, m, shape_count), 4);
        if (offsets) {
            for (const float o_mm : marker.offset_mm) csv.number(static_cast<double>(o_mm), 4);
        }
        csv.end_row();
    }
    return csv.contents();
}

bool is_count(const std::string& layout) {
    return !layout.empty() && std::ranges::all_of(layout, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

Result<MarkerLayout, FileError> parse_layout(std::string_view text, const fs::path& name, const Rig& rig) {
    auto reader = CsvReader::open(text, name);
    if (!reader) return failure(reader.error());
    const auto columns = find_columns(*reader);
    if (!columns) return failure(columns.error());
    MarkerLayout layout;
    while (true) {
        const auto more = reader->next();
        if (!more) return failure(more.error());
        if (!*more) break;
        if (layout.markers.size() == kMaxMarkers) {
            return reader->fail(fmt::format("more than {} markers", kMaxMarkers));
        }
        auto marker = read_marker(*reader, *columns, layout.markers.size(), rig);
        if (!marker) return failure(marker.error());
        layout.markers.push_back(std::move(*marker));
    }
    if (const auto ok = check_layout(name, layout, rig); !ok) return failure(ok.error());
    return layout;
}

Result<MarkerLayout, FileError> load_layout(const fs::path& folder, const std::string& layout,
                                            const Rig& rig) {
    const fs::path path =
        is_count(layout) ? folder / fmt::format("markers_{}.csv", layout) : fs::path{layout};
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    return parse_layout(*text, path, rig);
}

Result<void, FileError> save_layout(const fs::path& folder, const MarkerLayout& layout, const Rig& rig) {
    const std::string stem = fmt::format("markers_{}", layout.markers.size());
    if (const auto ok = check_layout(folder / (stem + ".csv"), layout, rig); !ok) return ok;
    if (const auto ok = make_folder(folder); !ok) return ok;
    const std::size_t marker_count = layout.markers.size();
    const std::size_t shape_count = rig.shapes.size();
    const MarkerModel model = marker_model(rig, layout);
    const auto text_ok = write_whole_text(folder / (stem + ".csv"), layout_text(layout, model, shape_count));
    if (!text_ok) return text_ok;
    const NpyArray<float> neutral{.shape = {marker_count, 3}, .values = model.neutral_mm};
    if (const auto ok = write_npy(folder / (stem + "_neutral.npy"), neutral); !ok) return ok;
    const NpyArray<float> basis{.shape = {3 * marker_count, shape_count}, .values = model.basis_mm};
    return write_npy(folder / (stem + "_B.npy"), basis);
}

}  // namespace rig::host
