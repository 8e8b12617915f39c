// Why a file could not be read or written. Not for device or link trouble: those have their own enums.
#pragma once

#include <expected>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace rig::host {

// Names the file, the fault and, where there is one, the remedy; ready to be shown to a person.
struct FileError {
    std::string message;
};

// "<file>: <fault>" and "<file>:<line>: <fault>", line counting from 1.
[[nodiscard]] std::unexpected<FileError> file_failure(const std::filesystem::path& file,
                                                      std::string_view fault);
[[nodiscard]] std::unexpected<FileError> file_failure_at(const std::filesystem::path& file, std::size_t line,
                                                         std::string_view fault);

// Text from a file as it may be shown in an error: control bytes become '?', long text is cut.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace rig::host
