#include "firmware_host/companion/files/whole_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <system_error>

namespace rig::host {

namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using OpenFile = std::unique_ptr<std::FILE, CloseFile>;

std::unexpected<FileError> system_failure(const std::filesystem::path& path, std::string_view what,
                                          int error_number) {
    return file_failure(path, fmt::format("{}: {}", what, std::strerror(error_number)));
}

// Reads to the end rather than trusting the size, so that pipes work too.
template <class Buffer>
Result<Buffer, FileError> read_to_end(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return file_failure(path, "is a folder, expected a file");
    const OpenFile file{std::fopen(path.c_str(), "rb")};
    if (!file) return system_failure(path, "cannot be opened", errno);
    Buffer buffer;
    std::array<typename Buffer::value_type, 1 << 16> chunk;
    while (const std::size_t count = std::fread(chunk.data(), 1, chunk.size(), file.get())) {
        if (buffer.size() + count > kMaxWholeFileBytes) return file_failure(path, "is larger than 2 GiB");
        buffer.insert(buffer.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(count));
    }
    if (std::ferror(file.get()) != 0) return system_failure(path, "cannot be read", errno);
    return buffer;
}

}  // namespace

Result<std::vector<std::byte>, FileError> read_whole_file(const std::filesystem::path& path) {
    return read_to_end<std::vector<std::byte>>(path);
}

Result<std::string, FileError> read_whole_text(const std::filesystem::path& path) {
    return read_to_end<std::string>(path);
}

Result<void, FileError> write_whole_file(const std::filesystem::path& path, ByteSpan bytes) {
    OpenFile file{std::fopen(path.c_str(), "wb")};
    if (!file) return system_failure(path, "cannot be written", errno);
    const std::size_t written = bytes.empty() ? 0 : std::fwrite(bytes.data(), 1, bytes.size(), file.get());
    if (written != bytes.size()) return system_failure(path, "cannot be written", errno);
    if (std::fclose(file.release()) != 0) return system_failure(path, "cannot be written", errno);
    return {};
}

Result<void, FileError> write_whole_text(const std::filesystem::path& path, std::string_view text) {
    return write_whole_file(path, std::as_bytes(std::span{text.data(), text.size()}));
}

Result<void, FileError> make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return file_failure(folder, "the folder cannot be made: " + error.message());
    if (!std::filesystem::is_directory(folder, error))
        return file_failure(folder, "is a file, expected a folder");
    return {};
}

Result<void, FileError> make_output_folder(const std::filesystem::path& folder, bool replace) {
    std::error_code error;
    if (!replace && std::filesystem::is_directory(folder, error) &&
        !std::filesystem::is_empty(folder, error)) {
        return file_failure(folder, "the folder is not empty; add --force to write into it");
    }
    return make_folder(folder);
}

}  // namespace rig::host
