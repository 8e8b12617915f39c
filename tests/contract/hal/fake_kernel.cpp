#include "tests/contract/hal/fake_kernel.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>

namespace rig::test {
namespace {

constexpr std::uint64_t kNever = ~std::uint64_t{0};

std::uint64_t calls = 0;
std::uint64_t failing_call = kNever;
int failing_errno = 0;
bool failing_forever = false;
bool failed = false;
std::string_view failed_name;
std::uint64_t transfer_limit = 0;

bool fails_now(std::string_view name) {
    const std::uint64_t number = calls++;
    const bool now =
        number == failing_call || (failing_forever && failing_call != kNever && number > failing_call);
    if (!now) return false;
    failed = true;
    failed_name = name;
    errno = failing_errno;
    return true;
}

size_t limited(size_t count) {
    return transfer_limit == 0 ? count : std::min<size_t>(count, transfer_limit);
}

}  // namespace

void fail_call(std::uint64_t nth, int error_number, bool forever) {
    heal();
    failing_call = nth;
    failing_errno = error_number;
    failing_forever = forever;
}

void heal() {
    calls = 0;
    failing_call = kNever;
    failing_forever = false;
    failed = false;
    failed_name = {};
}

std::uint64_t calls_made() {
    return calls;
}

bool has_failed() {
    return failed;
}

std::string_view failed_call() {
    return failed_name;
}

void limit_transfers(std::uint64_t bytes) {
    transfer_limit = bytes;
}

int open_descriptors() {
    DIR* folder = opendir("/proc/self/fd");
    int count = 0;
    while (readdir(folder) != nullptr) ++count;
    closedir(folder);
    return count;
}

}  // namespace rig::test

// The names are the linker's: --wrap=read sends calls of read() to __wrap_read().
// NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {

#define RIG_WRAP(type, name, parameters, arguments)       \
    type __real_##name parameters;                        \
    type __wrap_##name parameters;                        \
    type __wrap_##name parameters {                       \
        if (rig::test::fails_now(#name)) return type(-1); \
        return __real_##name arguments;                   \
    }

RIG_WRAP(int, posix_openpt, (int flags), (flags))
RIG_WRAP(int, grantpt, (int fd), (fd))
RIG_WRAP(int, unlockpt, (int fd), (fd))
RIG_WRAP(int, poll, (pollfd * fds, nfds_t count, int timeout), (fds, count, timeout))
RIG_WRAP(int, symlink, (const char* target, const char* path), (target, path))
RIG_WRAP(int, unlink, (const char* path), (path))
RIG_WRAP(int, rename, (const char* from, const char* to), (from, to))
RIG_WRAP(int, lstat, (const char* path, struct stat* facts), (path, facts))
RIG_WRAP(int, fstat, (int fd, struct stat* facts), (fd, facts))
RIG_WRAP(int, fsync, (int fd), (fd))
RIG_WRAP(int, fdatasync, (int fd), (fd))
RIG_WRAP(ssize_t, readlink, (const char* path, char* into, size_t size), (path, into, size))
RIG_WRAP(ssize_t, read, (int fd, void* into, size_t count), (fd, into, rig::test::limited(count)))
RIG_WRAP(ssize_t, write, (int fd, const void* from, size_t count), (fd, from, rig::test::limited(count)))
RIG_WRAP(ssize_t, pread, (int fd, void* into, size_t count, off_t offset),
         (fd, into, rig::test::limited(count), offset))
RIG_WRAP(ssize_t, pwrite, (int fd, const void* from, size_t count, off_t offset),
         (fd, from, rig::test::limited(count), offset))

int __real_ptsname_r(int fd, char* into, size_t size);
int __wrap_ptsname_r(int fd, char* into, size_t size);
int __wrap_ptsname_r(int fd, char* into, size_t size) {
    if (rig::test::fails_now("ptsname_r")) return errno;
    return __real_ptsname_r(fd, into, size);
}

int __real_ioctl(int fd, unsigned long request, void* argument);
int __wrap_ioctl(int fd, unsigned long request, ...);
int __wrap_ioctl(int fd, unsigned long request, ...) {
    va_list rest;
    va_start(rest, request);
    void* argument = va_arg(rest, void*);
    va_end(rest);
    if (rig::test::fails_now("ioctl")) return -1;
    return __real_ioctl(fd, request, argument);
}

int __real_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    if (rig::test::fails_now("open")) return -1;
    return __real_open(path, flags, mode);
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)
