// The on-disk form of a head: mesh, sparse shapes, names, marker layouts. README.md of this folder is the
// format.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

using Float3 = std::array<float, 3>;
using Int3 = std::array<std::int32_t, 3>;

// A shape moves vertices[i] by delta_mm[i] per unit weight.
struct SparseShape {
    std::string name;
    std::vector<std::int32_t> vertices;
    std::vector<Float3> delta_mm;
};

struct LayoutMarker {
    std::string name;
    Int3 vertices{};
    Float3 barycentric{};  // sums to 1
    Float3 neutral_mm{};   // of the surface point, on the mesh
    Float3 normal{};       // outward, unit
    Float3 offset_mm{};    // of the marker from its surface point, along the face's axes in every expression
};

struct MarkerLayout {
    std::vector<LayoutMarker> markers;
};

struct Rig {
    std::vector<Float3> vertices_mm;  // neutral
    std::vector<Int3> triangles;
    std::vector<std::uint8_t> triangle_part;  // index into parts
    std::vector<std::string> parts;
    std::vector<SparseShape> shapes;
};

// A performance: weights[frame * shape_count + shape], 0..1 unless the rig says otherwise.
struct Take {
    std::vector<std::string> shape_names;
    double rate_hz = 60.0;
    std::size_t frame_count = 0;
    std::vector<float> weights;
};

// Every loader checks: files there and whole, indices in range, offsets monotonic, numbers finite, counts
// consistent, names unique. Errors name the file.
[[nodiscard]] Result<Rig, FileError> load_rig(const std::filesystem::path& folder);
[[nodiscard]] Result<void, FileError> save_rig(const std::filesystem::path& folder, const Rig& rig);

// `layout` is a number ("60": markers_60.csv of the folder) or a path to a layout file.
[[nodiscard]] Result<MarkerLayout, FileError> load_layout(const std::filesystem::path& folder,
                                                          const std::string& layout, const Rig& rig);
// markers_<n>.csv, markers_<n>_neutral.npy and markers_<n>_B.npy.
[[nodiscard]] Result<void, FileError> save_layout(const std::filesystem::path& folder,
                                                  const MarkerLayout& layout, const Rig& rig);

// b0 [3m] and B [3m x N] row-major of a layout, computed from mesh and shapes; b0 with the offsets.
struct MarkerModel {
    std::vector<float> neutral_mm;
    std::vector<float> basis_mm;
};
[[nodiscard]] MarkerModel marker_model(const Rig& rig, const MarkerLayout& layout);

// CSV `frame,time_s,<shape names>`; columns are matched to the rig's shapes by name, any order; every rig
// shape that the file lacks is 0, a column that the rig lacks is an error.
[[nodiscard]] Result<Take, FileError> load_take(const std::filesystem::path& csv, const Rig& rig);
[[nodiscard]] Result<void, FileError> save_take(const std::filesystem::path& csv, const Take& take);

}  // namespace rig::host
