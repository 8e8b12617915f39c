// The service manager as watchdog: the sd_notify protocol, which is one datagram per message to
// $NOTIFY_SOCKET.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/linux/descriptor.hpp"
#include "hal/watchdog.hpp"

namespace rig {

// Without a service manager every call does nothing and timeout_us() is 0. A message that cannot be sent at
// once is dropped: a manager that does not read must not stop the rig, and a missed feed is repeated by the
// next tick.
class SystemdWatchdog final : public Watchdog {
  public:
    // `notify_socket`: a path, or a name that starts with '@' for the abstract namespace; empty for none.
    SystemdWatchdog(std::string_view notify_socket, std::int64_t timeout_us);
    // From NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID of this process.
    [[nodiscard]] static SystemdWatchdog from_environment();

    void arm() override;     // READY=1 and the first feed
    void feed() override;    // WATCHDOG=1
    void disarm() override;  // STOPPING=1, and no time-out from here on
    [[nodiscard]] std::int64_t timeout_us() const override { return timeout_us_; }

  private:
    void send(std::string_view message) const;

    os::Descriptor socket_;
    std::int64_t timeout_us_ = 0;
    std::array<char, 108> address_{};  // sockaddr_un::sun_path, '@' already turned into a zero byte
    std::size_t address_length_ = 0;
    bool armed_ = false;
};

}  // namespace rig
