#include "hal/linux/pty_link.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>

#include "hal/linux/raw_terminal.hpp"
#include "hal/linux/system_call.hpp"

namespace rig {

namespace {

constexpr int kLook_ms = 5;
constexpr int kCloseLooks = 60;  // 0.3 s
constexpr int kEmptyLooks = 3;

}  // namespace

Result<void, LinkError> PtyLink::open() {
    close();
    if (!open_pair() || (!symlink_path_.empty() && !publish_symlink())) {
        close();
        return failure(LinkError::kOpen);
    }
    return {};
}

bool PtyLink::open_pair() {
    const os::SystemResult opened =
        os::system_call([] { return posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); });
    if (!opened.done()) return false;
    master_ = os::Descriptor(static_cast<int>(opened.value));
    const int master = master_.get();
    if (!os::system_call([&] { return grantpt(master); }).done()) return false;
    if (!os::system_call([&] { return unlockpt(master); }).done()) return false;
    const os::SystemResult named = os::system_call([&] {
        errno = ptsname_r(master, slave_path_.data(),
                          slave_path_.size());  // returns the error, unlike the others
        return errno == 0 ? 0 : -1;
    });
    if (!named.done()) return false;
    if (!os::make_raw(master, os::kKeepRate)) return false;
    // A slave that was never opened accepts and keeps bytes as if somebody were there. Only after a first
    // close does the master see a hang-up, so the link makes that close itself.
    return discard_leftovers();
}

bool PtyLink::discard_leftovers() const {
    const os::SystemResult opened = os::system_call(
        [&] { return ::open(slave_path_.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); });
    if (!opened.done()) return false;
    const os::Descriptor slave(static_cast<int>(opened.value));
    return os::discard_input(slave.get());
}

// A symlink is replaced by rename, so that a reader finds the old one or the new one and never none.
bool PtyLink::publish_symlink() const {
    struct stat existing{};
    const bool present = os::system_call([&] { return lstat(symlink_path_.c_str(), &existing); }).done();
    if (present && !S_ISLNK(existing.st_mode)) return false;
    const std::string temporary = symlink_path_ + ".new";
    const os::SystemResult stale = os::system_call([&] { return unlink(temporary.c_str()); }, {ENOENT});
    if (stale.failed()) return false;
    if (!os::system_call([&] { return symlink(slave_path_.data(), temporary.c_str()); }).done()) return false;
    if (os::system_call([&] { return rename(temporary.c_str(), symlink_path_.c_str()); }).done()) return true;
    static_cast<void>(os::system_call([&] { return unlink(temporary.c_str()); }));
    return false;
}

bool PtyLink::owns_symlink() const {
    if (symlink_path_.empty() || slave_path_[0] == '\0') return false;
    std::array<char, 64> target{};
    const os::SystemResult length =
        os::system_call([&] { return readlink(symlink_path_.c_str(), target.data(), target.size() - 1); });
    return length.done() && std::strcmp(target.data(), slave_path_.data()) == 0;
}

// Closing the master throws away what the reader has not taken yet: a hang-up empties its buffer. So a reader
// that is there gets a moment to take the last bytes.
void PtyLink::let_reader_finish() {
    if (!master_.is_open() || slave_path_[0] == '\0' || !slave_is_open()) return;
    const os::SystemResult opened = os::system_call(
        [&] { return ::open(slave_path_.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); });
    if (!opened.done()) return;
    const os::Descriptor slave(static_cast<int>(opened.value));
    int empty_looks = 0;
    for (int look = 0; look < kCloseLooks && empty_looks < kEmptyLooks; ++look) {
        // The kernel moves bytes between two buffers on the way, and only the second is counted: one look may
        // be wrong.
        empty_looks = os::unread_bytes(slave.get()) == 0 ? empty_looks + 1 : 0;
        static_cast<void>(os::system_call([] { return poll(nullptr, 0, kLook_ms); }));
    }
}

void PtyLink::close() {
    let_reader_finish();
    if (owns_symlink()) static_cast<void>(os::system_call([&] { return unlink(symlink_path_.c_str()); }));
    master_.reset();
    slave_path_ = {};
    leftovers_possible_ = false;
}

// POLLHUP on the master is how Linux says that no slave is open. A hang-up here is therefore "nobody there",
// not a dead device. A reader that goes and comes between two calls is not noticed; it may meet bytes that
// are as old as one tick, which the framing tells from new ones by their sequence.
bool PtyLink::slave_is_open() {
    pollfd state{master_.get(), 0, 0};
    const os::SystemResult polled = os::system_call([&] { return poll(&state, 1, 0); });
    if (!polled.done() || (state.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0) return polled.done();
    if (leftovers_possible_) leftovers_possible_ = !discard_leftovers();
    return false;
}

Result<std::size_t, LinkError> PtyLink::write(ByteSpan bytes) {
    if (!master_.is_open()) return failure(LinkError::kClosed);
    if (bytes.empty() || !slave_is_open()) return std::size_t{0};
    leftovers_possible_ = true;
    const os::SystemResult written =
        os::system_call([&] { return ::write(master_.get(), bytes.data(), bytes.size()); }, {EAGAIN, EIO});
    if (written.tolerated()) return std::size_t{0};
    if (written.failed()) return failure(LinkError::kIo);
    return static_cast<std::size_t>(written.value);
}

Result<std::size_t, LinkError> PtyLink::read(MutableByteSpan into) {
    if (!master_.is_open()) return failure(LinkError::kClosed);
    if (into.empty()) return std::size_t{0};
    const os::SystemResult got =
        os::system_call([&] { return ::read(master_.get(), into.data(), into.size()); }, {EAGAIN, EIO});
    if (got.tolerated()) {
        static_cast<void>(slave_is_open());  // for its dropping of leftovers
        return std::size_t{0};
    }
    if (got.failed()) return failure(LinkError::kIo);
    return static_cast<std::size_t>(got.value);
}

}  // namespace rig
