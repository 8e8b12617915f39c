// Bytes as they may stand in an attribute of a page: data:<type>;base64,...
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace rig::host {

// media_type: "image/png", "image/jpeg".
[[nodiscard]] std::string data_uri(std::string_view media_type, std::span<const std::uint8_t> bytes);

}  // namespace rig::host
