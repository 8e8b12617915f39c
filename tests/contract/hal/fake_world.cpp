#include "tests/contract/hal/fake_world.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "core/base/check.hpp"
#include "hal/linux/monotonic_clock.hpp"

namespace rig::test {

using sim::WorldMessage;
using sim::WorldMessageKind;

sim::WorldHello small_hello(sim::WorldPace pace) {
    sim::WorldHello hello;
    hello.pace = pace;
    hello.camera_count = 2;
    hello.width_px = 8;
    hello.height_px = 6;
    hello.rate_millihertz = 100'000;
    hello.slot_count = 4;
    hello.image_stride_bytes = 64;
    hello.image_offset = 128;
    hello.memory_bytes = 128 + 4 * 2 * 64;
    return hello;
}

WorldMessage plain(WorldMessageKind kind, std::int64_t time_us) {
    WorldMessage message;
    message.kind = kind;
    message.time_us = time_us;
    return message;
}

WorldMessage frame_set(std::uint32_t slot, std::uint32_t sequence, std::int64_t time_us,
                       std::uint8_t camera_mask) {
    WorldMessage message = plain(WorldMessageKind::kFrameSet, time_us);
    message.slot = slot;
    message.sequence = sequence;
    message.camera_mask = camera_mask;
    return message;
}

WorldMessage line_edge(sim::WorldLine line, bool active, std::int64_t time_us) {
    WorldMessage message = plain(WorldMessageKind::kLineEdge, time_us);
    message.camera_or_line = static_cast<std::uint8_t>(line);
    message.active = active ? 1 : 0;
    return message;
}

FakeWorld::FakeWorld(sim::WorldHello hello, std::uint64_t memory_bytes)
    : hello_(hello), slot_free_(hello.slot_count, true) {
    listener_ = os::Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    RIG_CHECK(path().size() < sizeof(address.sun_path));
    std::memcpy(address.sun_path, path().c_str(), path().size());
    RIG_CHECK(bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
    RIG_CHECK(listen(listener_.get(), 1) == 0);
    memory_ = os::Descriptor(memfd_create("fake_world", MFD_CLOEXEC));
    RIG_CHECK(memory_.is_open() && ftruncate(memory_.get(), static_cast<off_t>(memory_bytes)) == 0);
}

FakeWorld::~FakeWorld() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
}

void FakeWorld::accept_and_greet() {
    accept_and_send(std::as_bytes(std::span(&hello_, 1)), true);
}

void FakeWorld::accept_and_send(std::span<const std::byte> bytes, bool with_memory) {
    connection_ = os::Descriptor(accept(listener_.get(), nullptr, nullptr));
    RIG_CHECK(connection_.is_open());
    if (!with_memory) {
        send_bytes(bytes);
        return;
    }
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
    iovec part{const_cast<std::byte*>(bytes.data()), bytes.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof(control);
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    const int number = memory_.get();
    std::memcpy(CMSG_DATA(header), &number, sizeof(int));
    RIG_CHECK(sendmsg(connection_.get(), &message, MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size()));
}

void FakeWorld::send(const WorldMessage& message) {
    send_bytes(std::as_bytes(std::span(&message, 1)));
}

// The other side may have hung up: that is a case under test, not a fault here.
void FakeWorld::send_bytes(std::span<const std::byte> bytes) {
    static_cast<void>(::send(connection_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL));
}

bool FakeWorld::receive(WorldMessage& message, int patience_ms) {
    std::size_t got = 0;
    while (got < sizeof(message)) {
        pollfd watched{connection_.get(), POLLIN, 0};
        if (poll(&watched, 1, patience_ms) != 1) return false;
        const ssize_t part =
            recv(connection_.get(), reinterpret_cast<std::byte*>(&message) + got, sizeof(message) - got, 0);
        if (part <= 0) return false;
        got += static_cast<std::size_t>(part);
    }
    return true;
}

void FakeWorld::paint(std::uint32_t slot, std::uint32_t sequence) {
    for (std::uint32_t camera = 0; camera < hello_.camera_count; ++camera) {
        const std::vector<std::uint8_t> image(std::size_t{hello_.width_px} * hello_.height_px,
                                              static_cast<std::uint8_t>(sequence * 16 + camera));
        const std::uint64_t index = std::uint64_t{slot} * hello_.camera_count + camera;
        const auto offset = static_cast<off_t>(hello_.image_offset + index * hello_.image_stride_bytes);
        RIG_CHECK(pwrite(memory_.get(), image.data(), image.size(), offset) ==
                  static_cast<ssize_t>(image.size()));
    }
}

void FakeWorld::note(const WorldMessage& message) {
    if (message.kind == WorldMessageKind::kSlotFree) {
        RIG_CHECK(message.slot < slot_free_.size() && !slot_free_[message.slot]);
        slot_free_[message.slot] = true;
    } else if (message.kind == WorldMessageKind::kTickDone) {
        done_sequence_ = message.sequence;
    } else {
        controls_.push_back(message);
    }
}

bool FakeWorld::wait_free_slot(std::uint32_t& slot, bool patient) {
    while (!stopping_) {
        const auto free = std::find(slot_free_.begin(), slot_free_.end(), true);
        if (free != slot_free_.end()) {
            slot = static_cast<std::uint32_t>(free - slot_free_.begin());
            return true;
        }
        WorldMessage message;
        const bool got = receive(message, patient ? 50 : 0);
        if (got) note(message);
        if (!got && !patient) return false;
    }
    return false;
}

void FakeWorld::perform(std::uint32_t frames) {
    thread_ = std::thread([this, frames] { play(frames); });
}

void FakeWorld::wait_performed() {
    if (thread_.joinable()) thread_.join();
}

void FakeWorld::play(std::uint32_t frames) {
    accept_and_greet();
    MonotonicClock clock;
    const bool lockstep = hello_.pace == sim::WorldPace::kLockstep;
    const std::int64_t period_us = 1'000'000'000 / hello_.rate_millihertz;
    const std::int64_t start_us = lockstep ? 0 : clock.now_us();
    WorldMessage message;
    for (std::uint32_t sequence = 1; sequence <= frames && !stopping_; ++sequence) {
        const std::int64_t time_us = start_us + sequence * period_us;
        if (!lockstep) clock.sleep_until_us(time_us);
        while (!lockstep && receive(message, 0)) note(message);
        std::uint32_t slot = 0;
        if (!wait_free_slot(slot, lockstep)) continue;
        slot_free_[slot] = false;
        paint(slot, sequence);
        send(frame_set(slot, sequence, time_us));
        while (lockstep && done_sequence_ != sequence && !stopping_) {
            if (receive(message, 50)) note(message);
        }
    }
    send(plain(WorldMessageKind::kEnd));
    while (!stopping_ && receive(message, 50)) note(message);
}

}  // namespace rig::test
