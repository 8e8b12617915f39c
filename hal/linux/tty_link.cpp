#include "hal/linux/tty_link.hpp"

#include <fcntl.h>
#include <unistd.h>

#include "hal/linux/raw_terminal.hpp"
#include "hal/linux/system_call.hpp"

namespace rig {

Result<void, LinkError> TtyLink::open() {
    close();
    const os::SystemResult opened =
        os::system_call([&] { return ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); });
    if (!opened.done()) return failure(LinkError::kOpen);
    os::Descriptor port(static_cast<int>(opened.value));
    if (!os::make_raw(port.get(), baud_) || !os::discard_input(port.get())) return failure(LinkError::kOpen);
    port_ = std::move(port);
    return {};
}

Result<std::size_t, LinkError> TtyLink::write(ByteSpan bytes) {
    if (!port_.is_open()) return failure(LinkError::kClosed);
    if (bytes.empty()) return std::size_t{0};
    const os::SystemResult written =
        os::system_call([&] { return ::write(port_.get(), bytes.data(), bytes.size()); }, {EAGAIN});
    if (written.tolerated()) return std::size_t{0};
    if (written.failed()) return failure(lost(written.error_number));
    return static_cast<std::size_t>(written.value);
}

Result<std::size_t, LinkError> TtyLink::read(MutableByteSpan into) {
    if (!port_.is_open()) return failure(LinkError::kClosed);
    if (into.empty()) return std::size_t{0};
    const os::SystemResult got =
        os::system_call([&] { return ::read(port_.get(), into.data(), into.size()); }, {EAGAIN});
    if (got.tolerated()) return std::size_t{0};
    if (got.failed()) return failure(lost(got.error_number));
    if (got.value == 0) return failure(lost(EIO));  // hang-up
    return static_cast<std::size_t>(got.value);
}

// kClosed stays until open(), so the descriptor goes at once: a node that comes back gets its old name only
// when the last holder has let go.
LinkError TtyLink::lost(int error_number) {
    const bool gone = error_number == EIO || error_number == ENODEV || error_number == ENXIO ||
                      error_number == EBADF || error_number == ESHUTDOWN;
    if (!gone) return LinkError::kIo;
    close();
    return LinkError::kClosed;
}

}  // namespace rig
