#include "firmware_host/companion/rig_folder/obj_import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "core/limits.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/rig_folder/rig_checks.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

constexpr double kSmallestDelta_mm = 0.005;
constexpr std::size_t kMaxParts = 256;  // triangle_part is one byte

Result<std::vector<fs::path>, FileError> shape_files(const ObjImport& import) {
    std::error_code error;
    std::vector<fs::path> files;
    for (fs::directory_iterator entry{import.folder, error}, end; !error && entry != end;
         entry.increment(error)) {
        const fs::path& path = entry->path();
        if (path.extension() == ".obj" && path.filename() != import.neutral) files.push_back(path);
    }
    if (error) return file_failure(import.folder, "the folder cannot be read: " + error.message());
    if (files.empty())
        return file_failure(import.folder, "no shapes in it: one .obj file beside the neutral for each");
    std::ranges::sort(files);
    std::vector<std::string> names;
    for (const fs::path& file : files) names.push_back(file.stem().string());
    if (const auto ok = check_names(import.folder, names, kMaxShapes, "shape"); !ok)
        return failure(ok.error());
    return files;
}

Result<void, FileError> add_vertices(const fs::path& file, const ObjMesh& neutral, double mm_per_unit,
                                     Rig& rig) {
    for (const auto& position : neutral.positions) {
        Float3 point_mm{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            point_mm[axis] = static_cast<float>(position[axis] * mm_per_unit);
        }
        if (!is_usable_point(point_mm)) {
            return file_failure(file, fmt::format("vertex {} is over 100 m away; check --unit and --scale",
                                                  rig.vertices_mm.size() + 1));
        }
        rig.vertices_mm.push_back(point_mm);
    }
    return {};
}

Result<void, FileError> add_triangles(const fs::path& file, const ObjMesh& neutral, Rig& rig) {
    rig.parts = neutral.materials;
    const bool has_bare = std::ranges::find(neutral.polygon_material, -1) != neutral.polygon_material.end();
    const auto bare_part = static_cast<std::uint8_t>(rig.parts.size());
    if (has_bare) rig.parts.emplace_back("face");
    if (const auto ok = check_names(file, rig.parts, kMaxParts, "part"); !ok) return ok;
    std::size_t first = 0;
    for (std::size_t p = 0; p < neutral.polygon_sizes.size(); ++p) {
        const std::int32_t material = neutral.polygon_material[p];
        const auto size = static_cast<std::size_t>(neutral.polygon_sizes[p]);
        for (std::size_t i = 1; i + 1 < size; ++i) {
            rig.triangles.push_back(
                {neutral.corners[first], neutral.corners[first + i], neutral.corners[first + i + 1]});
            rig.triangle_part.push_back(material < 0 ? bare_part : static_cast<std::uint8_t>(material));
        }
        first += size;
    }
    return {};
}

Result<SparseShape, FileError> read_shape(const fs::path& file, const ObjMesh& neutral,
                                          const fs::path& neutral_file, double mm_per_unit) {
    const auto mesh = read_obj(file);
    if (!mesh) return failure(mesh.error());
    if (mesh->positions.size() != neutral.positions.size()) {
        return file_failure(file, fmt::format("{} vertices, {} has {}", mesh->positions.size(),
                                              neutral_file.filename().string(), neutral.positions.size()));
    }
    if (mesh->polygon_sizes != neutral.polygon_sizes || mesh->corners != neutral.corners) {
        return file_failure(
            file, fmt::format("its faces are not those of {}: export both with the same vertex order",
                              neutral_file.filename().string()));
    }
    SparseShape shape{.name = file.stem().string(), .vertices = {}, .delta_mm = {}};
    for (std::size_t v = 0; v < mesh->positions.size(); ++v) {
        Float3 delta_mm{};
        double length2 = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double delta = (mesh->positions[v][axis] - neutral.positions[v][axis]) * mm_per_unit;
            delta_mm[axis] = static_cast<float>(delta);
            length2 += delta * delta;
        }
        if (length2 < kSmallestDelta_mm * kSmallestDelta_mm) continue;
        if (!is_usable_point(delta_mm)) {
            return file_failure(
                file, fmt::format("vertex {} is moved over 100 m; check --unit and --scale", v + 1));
        }
        shape.vertices.push_back(static_cast<std::int32_t>(v));
        shape.delta_mm.push_back(delta_mm);
    }
    return shape;
}

}  // namespace

Result<ImportedRig, FileError> import_obj_folder(const ObjImport& import) {
    std::error_code ignored;
    if (!fs::is_directory(import.folder, ignored))
        return file_failure(import.folder, "there is no such folder");
    const fs::path neutral_file = import.folder / import.neutral;
    const auto neutral = read_obj(neutral_file);
    if (!neutral) return failure(neutral.error());
    const auto files = shape_files(import);
    if (!files) return failure(files.error());
    ImportedRig imported;
    const auto vertices_ok = add_vertices(neutral_file, *neutral, import.mm_per_unit, imported.rig);
    if (!vertices_ok) return failure(vertices_ok.error());
    if (const auto ok = add_triangles(neutral_file, *neutral, imported.rig); !ok) return failure(ok.error());
    for (const fs::path& file : *files) {
        auto shape = read_shape(file, *neutral, neutral_file, import.mm_per_unit);
        if (!shape) return failure(shape.error());
        imported.rig.shapes.push_back(std::move(*shape));
    }
    const auto text = read_whole_text(import.markers);
    if (!text) return failure(text.error());
    auto layout = parse_marker_list(*text, import.markers, imported.rig, import.mm_per_unit);
    if (!layout) return failure(layout.error());
    imported.layout = std::move(*layout);
    return imported;
}

}  // namespace rig::host
