#include "firmware_host/pack_file/opened_pack.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/pack/open_pack.hpp"
#include "firmware_host/pack_file/sha256.hpp"

namespace rig {

namespace {

class FileDescriptor {
  public:
    explicit FileDescriptor(int fd) : fd_(fd) {}
    ~FileDescriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    FileDescriptor(const FileDescriptor&) = delete;
    FileDescriptor& operator=(const FileDescriptor&) = delete;
    [[nodiscard]] int get() const { return fd_; }

  private:
    int fd_;
};

PackFileError error_of(const std::string& name, std::string_view fault) {
    return {name + ": " + std::string(fault)};
}

// Empty when the file can be mapped.
std::string fault_of_file(const struct stat& info) {
    if (!S_ISREG(info.st_mode)) return "not a regular file; give the path of a pack made by headrig train";
    if (info.st_size < static_cast<off_t>(kPackHeaderBytes))
        return std::string(pack_error_text(PackError::kTooShort));
    if (info.st_size > static_cast<off_t>(kMaxPackBytes))
        return std::string(pack_error_text(PackError::kTooLong));
    return {};
}

}  // namespace

void OpenedPack::Release::operator()(const std::byte* bytes) const {
    auto* start = const_cast<std::byte*>(bytes);
    if (mapped) {
        ::munmap(start, size);
    } else {
        std::free(start);
    }
}

Result<OpenedPack, PackFileError> OpenedPack::verify(Bytes bytes, const std::string& name) {
    const ByteSpan view{bytes.get(), bytes.get_deleter().size};
    const auto pack = open_pack(view, sha256);
    if (!pack) return failure(error_of(name, pack_error_text(pack.error())));
    const auto manifest = read_manifest(view, sha256);
    if (!manifest) return failure(error_of(name, pack_error_text(manifest.error())));
    return OpenedPack(std::move(bytes), *manifest, *pack);
}

Result<OpenedPack, PackFileError> open_pack_file(const std::filesystem::path& path) {
    const std::string name = path.string();
    // Not blocking: a FIFO in the place of a pack is refused below instead of waited for.
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0)
        return failure(error_of(name, std::string("cannot be opened: ") + std::strerror(errno)));
    struct stat info{};
    if (::fstat(file.get(), &info) != 0) {
        return failure(error_of(name, std::string("cannot be examined: ") + std::strerror(errno)));
    }
    if (const std::string fault = fault_of_file(info); !fault.empty()) return failure(error_of(name, fault));
    const auto size = static_cast<std::size_t>(info.st_size);
    void* start = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, file.get(), 0);
    if (start == MAP_FAILED)
        return failure(error_of(name, std::string("cannot be mapped: ") + std::strerror(errno)));
    return OpenedPack::verify(OpenedPack::Bytes(static_cast<const std::byte*>(start), {size, true}), name);
}

Result<OpenedPack, PackFileError> open_pack_copy(ByteSpan bytes, const std::string& name) {
    if (bytes.size() < kPackHeaderBytes)
        return failure(error_of(name, pack_error_text(PackError::kTooShort)));
    if (bytes.size() > kMaxPackBytes) return failure(error_of(name, pack_error_text(PackError::kTooLong)));
    void* start = std::aligned_alloc(kPackAlignment, align_up(bytes.size()));
    if (start == nullptr) return failure(error_of(name, "there is not enough memory for it"));
    std::memcpy(start, bytes.data(), bytes.size());
    return OpenedPack::verify(OpenedPack::Bytes(static_cast<const std::byte*>(start), {bytes.size(), false}),
                              name);
}

}  // namespace rig
