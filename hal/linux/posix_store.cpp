#include "hal/linux/posix_store.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "hal/linux/system_call.hpp"

namespace rig {

namespace {

constexpr std::size_t kBlockBytes = 4096;

StoreError error_of(int error_number) {
    return error_number == ENOSPC || error_number == EDQUOT ? StoreError::kNoSpace : StoreError::kIo;
}

Result<void, StoreError> write_all(int file, std::size_t offset, ByteSpan bytes) {
    while (!bytes.empty()) {
        const os::SystemResult written = os::system_call(
            [&] { return pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset)); });
        if (!written.done()) return failure(error_of(written.error_number));
        if (written.value == 0) return failure(StoreError::kIo);
        offset += static_cast<std::size_t>(written.value);
        bytes = bytes.subspan(static_cast<std::size_t>(written.value));
    }
    return {};
}

Result<void, StoreError> fill_erased(int file, std::size_t offset, std::size_t length) {
    std::array<std::byte, kBlockBytes> erased;
    erased.fill(std::byte{0xFF});
    while (length > 0) {
        const std::size_t part = std::min(length, erased.size());
        if (auto written = write_all(file, offset, ByteSpan(erased).first(part)); !written) return written;
        offset += part;
        length -= part;
    }
    return {};
}

Result<void, StoreError> sync_folder_of(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
    const os::SystemResult opened =
        os::system_call([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
    if (!opened.done()) return failure(StoreError::kIo);
    const os::Descriptor descriptor(static_cast<int>(opened.value));
    if (!os::system_call([&] { return fsync(descriptor.get()); }).done()) return failure(StoreError::kIo);
    return {};
}

}  // namespace

Result<void, StoreError> PosixStore::open() {
    close();
    sync_failed_ = false;
    const auto open_existing = [&] {
        return os::system_call([&] { return ::open(path_.c_str(), O_RDWR | O_CLOEXEC); }, {ENOENT});
    };
    os::SystemResult opened = open_existing();
    if (opened.tolerated()) {
        if (auto created = create(); !created) return created;
        opened = open_existing();
    }
    if (!opened.done()) return failure(StoreError::kOpen);
    os::Descriptor file(static_cast<int>(opened.value));
    struct stat facts{};
    if (!os::system_call([&] { return fstat(file.get(), &facts); }).done()) return failure(StoreError::kOpen);
    if (!S_ISREG(facts.st_mode) || static_cast<std::size_t>(facts.st_size) != size_bytes_) {
        return failure(StoreError::kOpen);
    }
    file_ = std::move(file);
    return {};
}

Result<void, StoreError> PosixStore::create() const {
    const std::string temporary = path_ + ".new";
    const os::SystemResult opened = os::system_call(
        [&] { return ::open(temporary.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644); });
    if (!opened.done()) return failure(StoreError::kOpen);
    const os::Descriptor file(static_cast<int>(opened.value));
    Result<void, StoreError> outcome = fill_erased(file.get(), 0, size_bytes_);
    if (outcome && !os::system_call([&] { return fsync(file.get()); }).done())
        outcome = failure(StoreError::kIo);
    if (outcome && !os::system_call([&] { return rename(temporary.c_str(), path_.c_str()); }).done()) {
        outcome = failure(StoreError::kOpen);
    }
    if (!outcome) {
        static_cast<void>(os::system_call([&] { return unlink(temporary.c_str()); }));
        return outcome;
    }
    return sync_folder_of(path_);
}

Result<void, StoreError> PosixStore::check_range(std::size_t offset, std::size_t length) const {
    if (!file_.is_open() || sync_failed_) return failure(StoreError::kIo);
    if (offset > size_bytes_ || length > size_bytes_ - offset) return failure(StoreError::kOutOfRange);
    return {};
}

Result<void, StoreError> PosixStore::read(std::size_t offset, MutableByteSpan into) {
    if (auto checked = check_range(offset, into.size()); !checked) return checked;
    while (!into.empty()) {
        const os::SystemResult got = os::system_call(
            [&] { return pread(file_.get(), into.data(), into.size(), static_cast<off_t>(offset)); });
        if (!got.done() || got.value == 0) return failure(StoreError::kIo);
        offset += static_cast<std::size_t>(got.value);
        into = into.subspan(static_cast<std::size_t>(got.value));
    }
    return {};
}

Result<void, StoreError> PosixStore::erase(std::size_t offset, std::size_t length) {
    if (auto checked = check_range(offset, length); !checked) return checked;
    return fill_erased(file_.get(), offset, length);
}

Result<void, StoreError> PosixStore::program(std::size_t offset, ByteSpan bytes) {
    if (auto checked = check_range(offset, bytes.size()); !checked) return checked;
    return write_all(file_.get(), offset, bytes);
}

Result<void, StoreError> PosixStore::sync() {
    if (auto checked = check_range(0, 0); !checked) return checked;
    if (os::system_call([&] { return fdatasync(file_.get()); }).done()) return {};
    sync_failed_ = true;
    return failure(StoreError::kIo);
}

}  // namespace rig
