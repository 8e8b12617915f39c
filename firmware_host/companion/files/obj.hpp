// Wavefront OBJ text: positions, polygons and material names. Normals, texture coordinates, groups and lines
// are read over; curves and surfaces are refused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

struct ObjMesh {
    std::vector<std::array<double, 3>> positions;  // finite, in the file's unit
    std::vector<std::int32_t> corners;           // of all polygons, one after the other; index into positions
    std::vector<std::int32_t> polygon_sizes;     // corners of each polygon, at least 3
    std::vector<std::int32_t> polygon_material;  // index into materials, -1 before the first usemtl
    std::vector<std::string> materials;          // in order of first use
};

inline constexpr std::size_t kMaxObjPositions = std::size_t{1} << 22;
inline constexpr std::size_t kMaxObjCorners = std::size_t{1} << 25;

// Errors name file and line: an unknown statement, a line cut short, a number that is none or not finite, a
// corner that names no position, no positions, no polygons.
[[nodiscard]] Result<ObjMesh, FileError> parse_obj(std::string_view text, const std::filesystem::path& name);
[[nodiscard]] Result<ObjMesh, FileError> read_obj(const std::filesystem::path& path);

}  // namespace rig::host
