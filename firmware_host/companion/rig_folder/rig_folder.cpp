#include "firmware_host/companion/rig_folder/rig_folder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/limits.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/rig_folder/rig_checks.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxParts = 256;  // triangle_part is one byte

// One name a line, without blank lines.
Result<std::vector<std::string>, FileError> read_names(const fs::path& path, std::size_t max_count,
                                                       std::string_view noun) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    std::vector<std::string> names;
    std::string_view rest = *text;
    while (!rest.empty()) {
        const std::size_t end = rest.find('\n');
        std::string_view line = rest.substr(0, end);
        if (line.ends_with('\r')) line.remove_suffix(1);
        names.emplace_back(line);
        rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    }
    if (const auto ok = check_names(path, names, max_count, noun); !ok) return failure(ok.error());
    return names;
}

Result<void, FileError> write_names(const fs::path& path, const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += name + '\n';
    return write_whole_text(path, text);
}

// An (n, 3) array as n triples.
template <class T>
Result<std::vector<std::array<T, 3>>, FileError> read_triples(const fs::path& path) {
    const auto array = read_npy<T>(path);
    if (!array) return failure(array.error());
    if (array->shape.size() != 2 || array->shape[1] != 3)
        return file_failure(path, "the array's shape is not (n, 3)");
    std::vector<std::array<T, 3>> triples(array->shape[0]);
    for (std::size_t i = 0; i < triples.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) triples[i][axis] = array->values[3 * i + axis];
    }
    return triples;
}

template <class T>
Result<void, FileError> write_triples(const fs::path& path, const std::vector<std::array<T, 3>>& triples) {
    NpyArray<T> array{.shape = {triples.size(), 3}, .values = {}};
    array.values.reserve(3 * triples.size());
    for (const auto& triple : triples) array.values.insert(array.values.end(), triple.begin(), triple.end());
    return write_npy(path, array);
}

template <class T>
Result<std::vector<T>, FileError> read_list(const fs::path& path) {
    auto array = read_npy<T>(path);
    if (!array) return failure(array.error());
    if (array->shape.size() != 1) return file_failure(path, "the array's shape is not (n,)");
    return std::move(array->values);
}

bool is_index(std::int32_t index, std::size_t count) {
    return index >= 0 && static_cast<std::size_t>(index) < count;
}

Result<void, FileError> load_vertices(const fs::path& folder, Rig& rig) {
    const fs::path path = folder / "vertices.npy";
    auto vertices = read_triples<float>(path);
    if (!vertices) return failure(vertices.error());
    if (vertices->empty()) return file_failure(path, "there are no vertices");
    if (vertices->size() > kMaxVertices)
        return file_failure(path, fmt::format("more than {} vertices", kMaxVertices));
    const auto bad = std::ranges::find_if_not(*vertices, is_usable_point);
    if (bad != vertices->end()) {
        return file_failure(path,
                            fmt::format("vertex {} is not a finite point in mm", bad - vertices->begin()));
    }
    rig.vertices_mm = std::move(*vertices);
    return {};
}

Result<void, FileError> load_triangles(const fs::path& folder, Rig& rig) {
    const fs::path path = folder / "triangles.npy";
    auto triangles = read_triples<std::int32_t>(path);
    if (!triangles) return failure(triangles.error());
    if (triangles->empty()) return file_failure(path, "there are no triangles");
    for (std::size_t t = 0; t < triangles->size(); ++t) {
        for (const std::int32_t vertex : (*triangles)[t]) {
            if (is_index(vertex, rig.vertices_mm.size())) continue;
            return file_failure(path, fmt::format("triangle {} names vertex {}, vertices.npy has {}", t,
                                                  vertex, rig.vertices_mm.size()));
        }
    }
    rig.triangles = std::move(*triangles);
    return {};
}

Result<void, FileError> load_parts(const fs::path& folder, Rig& rig) {
    auto parts = read_names(folder / "parts.txt", kMaxParts, "part");
    if (!parts) return failure(parts.error());
    const fs::path path = folder / "triangle_part.npy";
    auto part_of = read_list<std::uint8_t>(path);
    if (!part_of) return failure(part_of.error());
    if (part_of->size() != rig.triangles.size()) {
        return file_failure(
            path, fmt::format("{} entries, triangles.npy has {}", part_of->size(), rig.triangles.size()));
    }
    const auto bad = std::ranges::find_if(*part_of, [&](std::uint8_t part) { return part >= parts->size(); });
    if (bad != part_of->end()) {
        return file_failure(path, fmt::format("entry {} is part {}, parts.txt names {}",
                                              bad - part_of->begin(), *bad, parts->size()));
    }
    rig.parts = std::move(*parts);
    rig.triangle_part = std::move(*part_of);
    return {};
}

// Offsets of shape s are o[s]..o[s + 1]: they start at 0, never fall, and end at the number of deltas.
Result<void, FileError> check_offsets(const fs::path& path, const std::vector<std::int32_t>& offsets,
                                      std::size_t shape_count, std::size_t delta_count) {
    if (offsets.size() != shape_count + 1) {
        return file_failure(path,
                            fmt::format("{} offsets, expected {}: one more than blendshapes.txt has names",
                                        offsets.size(), shape_count + 1));
    }
    if (offsets.front() != 0) return file_failure(path, "the first offset is not 0");
    if (!std::ranges::is_sorted(offsets))
        return file_failure(path, "the offsets fall somewhere; they must not");
    if (static_cast<std::size_t>(offsets.back()) != delta_count) {
        return file_failure(path, fmt::format("the last offset is {}, but delta_vertex.npy has {} entries",
                                              offsets.back(), delta_count));
    }
    return {};
}

Result<void, FileError> check_deltas(const fs::path& folder, const Rig& rig,
                                     const std::vector<std::int32_t>& vertices,
                                     const std::vector<Float3>& deltas) {
    if (deltas.size() != vertices.size()) {
        return file_failure(folder / "delta_xyz.npy",
                            fmt::format("{} rows, delta_vertex.npy has {}", deltas.size(), vertices.size()));
    }
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (!is_index(vertices[i], rig.vertices_mm.size())) {
            return file_failure(folder / "delta_vertex.npy",
                                fmt::format("entry {} is vertex {}, vertices.npy has {}", i, vertices[i],
                                            rig.vertices_mm.size()));
        }
        if (!is_usable_point(deltas[i])) {
            return file_failure(folder / "delta_xyz.npy",
                                fmt::format("row {} is not a finite delta in mm", i));
        }
    }
    return {};
}

// A vertex named twice by one shape would be moved twice by some readers and once by others.
Result<void, FileError> check_distinct(const fs::path& folder, const Rig& rig) {
    std::vector<std::size_t> last_shape(rig.vertices_mm.size(), rig.shapes.size());
    for (std::size_t s = 0; s < rig.shapes.size(); ++s) {
        for (const std::int32_t vertex : rig.shapes[s].vertices) {
            std::size_t& last = last_shape[static_cast<std::size_t>(vertex)];
            if (last == s) {
                return file_failure(
                    folder / "delta_vertex.npy",
                    fmt::format("shape '{}' names vertex {} twice", rig.shapes[s].name, vertex));
            }
            last = s;
        }
    }
    return {};
}

Result<void, FileError> load_shapes(const fs::path& folder, Rig& rig) {
    const auto names = read_names(folder / "blendshapes.txt", kMaxShapes, "shape");
    if (!names) return failure(names.error());
    const auto offsets = read_list<std::int32_t>(folder / "delta_offsets.npy");
    if (!offsets) return failure(offsets.error());
    const auto vertices = read_list<std::int32_t>(folder / "delta_vertex.npy");
    if (!vertices) return failure(vertices.error());
    const auto deltas = read_triples<float>(folder / "delta_xyz.npy");
    if (!deltas) return failure(deltas.error());
    const auto offsets_ok =
        check_offsets(folder / "delta_offsets.npy", *offsets, names->size(), vertices->size());
    if (!offsets_ok) return offsets_ok;
    if (const auto ok = check_deltas(folder, rig, *vertices, *deltas); !ok) return ok;
    for (std::size_t s = 0; s < names->size(); ++s) {
        const std::int32_t begin = (*offsets)[s];
        const std::int32_t end = (*offsets)[s + 1];
        rig.shapes.push_back({.name = (*names)[s],
                              .vertices = {vertices->begin() + begin, vertices->begin() + end},
                              .delta_mm = {deltas->begin() + begin, deltas->begin() + end}});
    }
    return check_distinct(folder, rig);
}

Result<void, FileError> save_shapes(const fs::path& folder, const Rig& rig) {
    std::vector<std::string> names;
    NpyArray<std::int32_t> offsets{.shape = {rig.shapes.size() + 1}, .values = {0}};
    NpyArray<std::int32_t> vertices;
    std::vector<Float3> deltas;
    for (const SparseShape& shape : rig.shapes) {
        names.push_back(shape.name);
        vertices.values.insert(vertices.values.end(), shape.vertices.begin(), shape.vertices.end());
        deltas.insert(deltas.end(), shape.delta_mm.begin(), shape.delta_mm.end());
        offsets.values.push_back(static_cast<std::int32_t>(deltas.size()));
    }
    vertices.shape = {vertices.values.size()};
    if (const auto ok = check_names(folder / "blendshapes.txt", names, kMaxShapes, "shape"); !ok) return ok;
    if (const auto ok = write_names(folder / "blendshapes.txt", names); !ok) return ok;
    if (const auto ok = write_npy(folder / "delta_offsets.npy", offsets); !ok) return ok;
    if (const auto ok = write_npy(folder / "delta_vertex.npy", vertices); !ok) return ok;
    return write_triples(folder / "delta_xyz.npy", deltas);
}

}  // namespace

Result<Rig, FileError> load_rig(const fs::path& folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
        return file_failure(folder,
                            "there is no such rig folder; `headrig sample DIR` makes one to try with");
    }
    Rig rig;
    for (const auto load_part : {load_vertices, load_triangles, load_parts, load_shapes}) {
        if (const auto ok = load_part(folder, rig); !ok) return failure(ok.error());
    }
    return rig;
}

Result<void, FileError> save_rig(const fs::path& folder, const Rig& rig) {
    if (const auto ok = make_folder(folder); !ok) return ok;
    if (const auto ok = write_triples(folder / "vertices.npy", rig.vertices_mm); !ok) return ok;
    if (const auto ok = write_triples(folder / "triangles.npy", rig.triangles); !ok) return ok;
    const NpyArray<std::uint8_t> part_of{.shape = {rig.triangle_part.size()}, .values = rig.triangle_part};
    if (const auto ok = write_npy(folder / "triangle_part.npy", part_of); !ok) return ok;
    if (const auto ok = check_names(folder / "parts.txt", rig.parts, kMaxParts, "part"); !ok) return ok;
    if (const auto ok = write_names(folder / "parts.txt", rig.parts); !ok) return ok;
    return save_shapes(folder, rig);
}

}  // namespace rig::host
