// Whole files into memory and back. Not for streams or anything larger than a few hundred megabytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

inline constexpr std::size_t kMaxWholeFileBytes = std::size_t{1} << 31;

// Errors: missing, a folder, unreadable, larger than kMaxWholeFileBytes. An empty file is not an error here.
[[nodiscard]] Result<std::vector<std::byte>, FileError> read_whole_file(const std::filesystem::path& path);
[[nodiscard]] Result<std::string, FileError> read_whole_text(const std::filesystem::path& path);

// Replaces the file. The folder must exist.
[[nodiscard]] Result<void, FileError> write_whole_file(const std::filesystem::path& path, ByteSpan bytes);
[[nodiscard]] Result<void, FileError> write_whole_text(const std::filesystem::path& path,
                                                       std::string_view text);

// Makes the folder and its parents; not an error when it is there.
[[nodiscard]] Result<void, FileError> make_folder(const std::filesystem::path& folder);
// The same, but a folder that holds anything is an error unless `replace` is true; nothing is ever deleted.
[[nodiscard]] Result<void, FileError> make_output_folder(const std::filesystem::path& folder, bool replace);

}  // namespace rig::host
