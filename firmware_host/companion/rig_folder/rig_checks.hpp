// What makes a rig, a layout or a take usable at all, however it came about: read from a folder, imported or
// built.
#pragma once

#include <filesystem>
#include <string_view>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

inline constexpr std::size_t kMaxVertices = std::size_t{1} << 22;  // film heads stay under a million
inline constexpr float kMaxOffsetMm = 20.0F;  // of a marker from its surface point: more is another place
inline constexpr float kMaxCoordinateMm = 1.0e5F;  // 100 m: anything beyond is a wrong unit

// Not empty, at most kMaxNameBytes, printable, no comma, quote or blank at either end: it has to survive CSV
// headers.
[[nodiscard]] bool is_usable_name(std::string_view name);
[[nodiscard]] bool is_usable_point(const Float3& point_mm);  // finite and within kMaxCoordinateMm

// Errors name `where`.
[[nodiscard]] Result<void, FileError> check_names(const std::filesystem::path& where,
                                                  const std::vector<std::string>& names,
                                                  std::size_t max_count, std::string_view noun);
[[nodiscard]] Result<void, FileError> check_layout(const std::filesystem::path& where,
                                                   const MarkerLayout& layout, const Rig& rig);

}  // namespace rig::host
