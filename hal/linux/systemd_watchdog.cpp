#include "hal/linux/systemd_watchdog.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "hal/linux/system_call.hpp"

namespace rig {

namespace {

std::string_view environment(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string_view{} : std::string_view{value};
}

// 0 when the text is not a whole positive number.
std::int64_t number_of(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && value > 0 ? value : 0;
}

}  // namespace

SystemdWatchdog::SystemdWatchdog(std::string_view notify_socket, std::int64_t timeout_us) {
    const bool usable = notify_socket.size() >= 2 && notify_socket.size() < address_.size() &&
                        (notify_socket.front() == '/' || notify_socket.front() == '@');
    if (!usable) return;
    const os::SystemResult made =
        os::system_call([] { return ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); });
    if (!made.done()) return;
    socket_ = os::Descriptor(static_cast<int>(made.value));
    std::copy(notify_socket.begin(), notify_socket.end(), address_.begin());
    if (address_[0] == '@') address_[0] = '\0';
    address_length_ = notify_socket.size();
    timeout_us_ = std::max<std::int64_t>(timeout_us, 0);
}

SystemdWatchdog SystemdWatchdog::from_environment() {
    const std::string_view pid = environment("WATCHDOG_PID");
    const bool for_us = pid.empty() || number_of(pid) == static_cast<std::int64_t>(getpid());
    return {environment("NOTIFY_SOCKET"), for_us ? number_of(environment("WATCHDOG_USEC")) : 0};
}

void SystemdWatchdog::arm() {
    armed_ = true;
    send(timeout_us_ > 0 ? "READY=1\nWATCHDOG=1" : "READY=1");
}

void SystemdWatchdog::feed() {
    if (armed_ && timeout_us_ > 0) send("WATCHDOG=1");
}

void SystemdWatchdog::disarm() {
    if (armed_) send(timeout_us_ > 0 ? "STOPPING=1\nWATCHDOG_USEC=0" : "STOPPING=1");
    armed_ = false;
}

void SystemdWatchdog::send(std::string_view message) const {
    if (!socket_.is_open()) return;
    sockaddr_un supervisor{};
    supervisor.sun_family = AF_UNIX;
    std::memcpy(supervisor.sun_path, address_.data(), address_length_);
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_length_);
    static_cast<void>(os::system_call([&] {
        return sendto(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL,
                      reinterpret_cast<const sockaddr*>(&supervisor), length);
    }));
}

}  // namespace rig
