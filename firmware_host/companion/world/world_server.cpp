#include "firmware_host/companion/world/world_server.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "firmware_host/companion/world/world_session.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kImageAlignment = 64;

sim::WorldHello hello_of(const World& world, const ServerConfig& config) {
    sim::WorldHello hello;
    hello.pace = config.pace;
    hello.camera_count = static_cast<std::uint8_t>(world.cameras().size());
    hello.width_px = static_cast<std::uint16_t>(world.cameras()[0].width_px);
    hello.height_px = static_cast<std::uint16_t>(world.cameras()[0].height_px);
    hello.rate_millihertz = static_cast<std::uint32_t>(std::lround(1000.0 * world.config().rate_hz));
    hello.slot_count = config.slot_count;
    hello.image_stride_bytes = static_cast<std::uint32_t>((world.image_bytes() + kImageAlignment - 1) /
                                                          kImageAlignment * kImageAlignment);
    hello.memory_bytes = std::uint64_t{hello.slot_count} * hello.camera_count * hello.image_stride_bytes;
    hello.frame_total = world.frame_count();
    return hello;
}

void ring(int wake) {
    const std::uint64_t one = 1;
    // A full counter is readable already: that is all a ring is for.
    if (::write(wake, &one, sizeof(one)) < 0) return;
}

}  // namespace

WorldServer::WorldServer(const World& world, ServerConfig config, TruthRecorder* truth)
    : world_(world),
      config_(std::move(config)),
      truth_(truth),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    config_.slot_count = std::clamp<std::uint32_t>(config_.slot_count, 4, 64);
    config_.render_threads = std::clamp<std::size_t>(config_.render_threads, 1, 4);
}

WorldServer::~WorldServer() {
    stop();
    if (thread_.joinable()) thread_.join();
    if (listener_ >= 0) {
        ::close(listener_);
        ::unlink(config_.socket.c_str());
    }
    if (wake_ >= 0) ::close(wake_);
}

Result<void, FileError> WorldServer::listen() {
    auto listener = listen_at(config_.socket);
    if (!listener) return failure(listener.error());
    listener_ = listener->release();
    return {};
}

void WorldServer::stop() {
    stop_ = true;
    ring(wake_);
}

void WorldServer::start(Progress progress) {
    thread_ = std::jthread([this, told = std::move(progress)] { end_ = run(told); });
}

ServerEnd WorldServer::join() {
    if (thread_.joinable()) thread_.join();
    return end_;
}

// -1 when nobody came.
int WorldServer::wait_for_daemon() const {
    const std::int64_t deadline =
        config_.connect_timeout_us > 0 ? monotonic_us() + config_.connect_timeout_us : 0;
    while (!stop_) {
        std::array<pollfd, 2> ready = {pollfd{listener_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
        const std::int64_t left_ms = deadline == 0 ? -1 : (deadline - monotonic_us()) / 1000;
        if (deadline != 0 && left_ms <= 0) return -1;
        if (::poll(ready.data(), ready.size(), static_cast<int>(left_ms)) < 0 && errno != EINTR) return -1;
        if ((ready[0].revents & POLLIN) == 0) continue;
        const int connection = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (connection >= 0) return connection;
    }
    return -1;
}

ServerEnd WorldServer::run(const Progress& progress) {
    if (listener_ < 0) {
        fault_ = "listen() has not succeeded";
        return ServerEnd::kFailed;
    }
    const Descriptor connection(wait_for_daemon());
    if (connection.get() < 0) return stop_ ? ServerEnd::kStopped : ServerEnd::kNoDaemon;
    const sim::WorldHello hello = hello_of(world_, config_);
    auto memory = SharedImages::create(hello.memory_bytes);
    if (!memory) {
        fault_ = memory.error().message;
        return ServerEnd::kFailed;
    }
    if (!send_all(connection.get(), std::as_bytes(std::span(&hello, 1)), memory->descriptor())) {
        return ServerEnd::kDisconnected;
    }
    FramesAhead frames(world_, memory->bytes(), hello.image_stride_bytes, config_.slot_count,
                       config_.render_threads, truth_, [this] {
                           ++counters_.rendered;
                           ring(wake_);
                       });
    WorldSession session(world_, config_, counters_, frames, connection.get(), wake_, stop_);
    return session.run(progress);
}

}  // namespace rig::host
