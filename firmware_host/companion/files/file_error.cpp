#include "firmware_host/companion/files/file_error.hpp"

#include <fmt/format.h>

namespace rig::host {

std::unexpected<FileError> file_failure(const std::filesystem::path& file, std::string_view fault) {
    return failure(FileError{fmt::format("{}: {}", file.string(), fault)});
}

std::unexpected<FileError> file_failure_at(const std::filesystem::path& file, std::size_t line,
                                           std::string_view fault) {
    return failure(FileError{fmt::format("{}:{}: {}", file.string(), line, fault)});
}

std::string printable(std::string_view text) {
    constexpr std::size_t kShown = 40;
    std::string shown;
    for (const char c : text.substr(0, kShown)) {
        const auto byte = static_cast<unsigned char>(c);
        shown += (byte < 0x20 || byte == 0x7F) ? '?' : c;
    }
    if (text.size() > kShown) shown += "...";
    return shown;
}

}  // namespace rig::host
