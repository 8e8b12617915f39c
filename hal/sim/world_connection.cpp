#include "hal/sim/world_connection.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

#include "hal/linux/system_call.hpp"

namespace rig::sim {

namespace {

constexpr std::int64_t kDialAgain_us = 20'000;
constexpr std::int64_t kReaderWakes_us = 1'000'000;
constexpr std::int64_t kSendPatience_us = 1'000'000;

int milliseconds(std::int64_t time_us) {
    return static_cast<int>(std::clamp<std::int64_t>((time_us + 999) / 1000, 0, 1'000'000));
}

// The descriptor that came with a message, if any; more than one is against the protocol, and all but one are
// closed.
os::Descriptor received_descriptor(msghdr& message) {
    os::Descriptor first;
    for (cmsghdr* control = CMSG_FIRSTHDR(&message); control != nullptr;
         control = CMSG_NXTHDR(&message, control)) {
        if (control->cmsg_level != SOL_SOCKET || control->cmsg_type != SCM_RIGHTS) continue;
        const std::size_t count = (control->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (std::size_t i = 0; i < count; ++i) {
            int number = -1;
            std::memcpy(&number, CMSG_DATA(control) + i * sizeof(int), sizeof(int));
            os::Descriptor descriptor(number);
            if (!first.is_open()) first = std::move(descriptor);
        }
    }
    return first;
}

}  // namespace

Result<std::unique_ptr<WorldClient::Connection>, WorldError> WorldClient::Connection::connect(
    const std::string& socket_path, WorldPatience patience) {
    std::unique_ptr<Connection> connection(new Connection(patience));
    if (!connection->dial(socket_path)) return failure(WorldError::kNoWorld);
    os::Descriptor memory;
    if (!connection->receive_hello(memory)) return failure(WorldError::kRefusedHello);
    if (!connection->map(memory)) return failure(WorldError::kNoMemory);
    connection->ledger_ = std::make_unique<WorldLedger>(connection->hello_);
    if (!connection->lockstep()) connection->start_reader();
    return connection;
}

WorldClient::Connection::~Connection() {
    stopping_ = true;
    if (reader_.joinable()) {
        interrupt();
        reader_.join();
    }
    if (memory_ != nullptr) munmap(memory_, hello_.memory_bytes);
}

bool WorldClient::Connection::dial(const std::string& socket_path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket_path.empty() || socket_path.size() >= sizeof(address.sun_path)) return false;
    std::memcpy(address.sun_path, socket_path.data(), socket_path.size());
    const os::SystemResult event = os::system_call([] { return eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC); });
    if (!event.done()) return false;
    interrupt_event_ = os::Descriptor(static_cast<int>(event.value));
    const std::int64_t deadline_us = monotonic_.now_us() + patience_.connect_us;
    while (true) {
        const os::SystemResult made =
            os::system_call([] { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0); });
        if (!made.done()) return false;
        socket_ = os::Descriptor(static_cast<int>(made.value));
        const os::SystemResult connected = os::system_call(
            [&] {
                return ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address));
            },
            {ENOENT, ECONNREFUSED, EAGAIN});
        if (connected.done()) return true;
        if (!connected.tolerated() || monotonic_.now_us() >= deadline_us) return false;
        monotonic_.sleep_until_us(monotonic_.now_us() + kDialAgain_us);
    }
}

bool WorldClient::Connection::receive_hello(os::Descriptor& memory) {
    const std::int64_t deadline_us = monotonic_.now_us() + patience_.connect_us;
    std::size_t received = 0;
    std::array<std::byte, sizeof(WorldHello)> bytes{};
    while (received < bytes.size()) {
        if (wait_readable(deadline_us - monotonic_.now_us()) != Wake::kMessage) return false;
        alignas(cmsghdr) std::array<char, CMSG_SPACE(4 * sizeof(int))> control{};
        iovec part{bytes.data() + received, bytes.size() - received};
        msghdr message{};
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        const os::SystemResult got = os::system_call(
            [&] { return recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC | MSG_DONTWAIT); }, {EAGAIN});
        if (got.tolerated()) continue;
        if (got.failed() || got.value == 0) return false;
        os::Descriptor descriptor = received_descriptor(message);
        if (!memory.is_open()) memory = std::move(descriptor);
        received += static_cast<std::size_t>(got.value);
    }
    hello_ = rig::load<WorldHello>(bytes, 0);
    struct stat facts{};
    if (!memory.is_open() || !os::system_call([&] { return fstat(memory.get(), &facts); }).done())
        return false;
    return hello_is_sound(hello_, static_cast<std::uint64_t>(std::max<off_t>(facts.st_size, 0)));
}

bool WorldClient::Connection::map(const os::Descriptor& memory) {
    void* address = mmap(nullptr, hello_.memory_bytes, PROT_READ, MAP_SHARED, memory.get(), 0);
    if (address == MAP_FAILED) return false;
    memory_ = static_cast<std::byte*>(address);
    return true;
}

void WorldClient::Connection::start_reader() {
    reader_ = std::thread([this] { read_until_down(); });
}

void WorldClient::Connection::read_until_down() {
    while (!stopping_ && !is_down()) {
        if (wait_readable(kReaderWakes_us) != Wake::kMessage) continue;
        const Lock held = lock();
        receive_bytes();
        while (accept_message(held)) {
        }
        send_freed_slots(held);
        arrived_.notify_all();
    }
}

std::int64_t WorldClient::Connection::now_us() const {
    return lockstep() ? world_time_us_.load(std::memory_order_acquire) : monotonic_.now_us();
}

const std::uint8_t* WorldClient::Connection::image(std::uint32_t slot, std::size_t camera) const {
    const std::uint64_t index = std::uint64_t{slot} * hello_.camera_count + camera;
    return reinterpret_cast<const std::uint8_t*>(memory_) + hello_.image_offset +
           index * hello_.image_stride_bytes;
}

WorldClient::Connection::Wake WorldClient::Connection::wait_readable(std::int64_t timeout_us) {
    std::array<pollfd, 2> watched{{{socket_.get(), POLLIN, 0}, {interrupt_event_.get(), POLLIN, 0}}};
    const os::SystemResult polled =
        os::system_call([&] { return poll(watched.data(), watched.size(), milliseconds(timeout_us)); });
    if (!polled.done()) return Wake::kDown;
    if (watched[1].revents != 0) {
        std::uint64_t count = 0;
        static_cast<void>(
            os::system_call([&] { return ::read(interrupt_event_.get(), &count, sizeof(count)); }, {EAGAIN}));
        return Wake::kInterrupt;
    }
    return watched[0].revents != 0 ? Wake::kMessage : Wake::kDeadline;
}

void WorldClient::Connection::receive_bytes() {
    const os::SystemResult got = os::system_call(
        [&] {
            return recv(socket_.get(), inbox_.data() + inbox_bytes_, inbox_.size() - inbox_bytes_,
                        MSG_DONTWAIT);
        },
        {EAGAIN});
    if (got.done() && got.value > 0) inbox_bytes_ += static_cast<std::size_t>(got.value);
    if (got.tolerated() || (got.done() && got.value > 0)) return;
    if (!ledger_->ended()) go_down("the world closed the connection before its end");
    stopping_ = true;
}

bool WorldClient::Connection::accept_message(const Lock&) {
    if (is_down() || inbox_bytes_ < sizeof(WorldMessage)) return false;
    const auto message = rig::load<WorldMessage>(inbox_, 0);
    inbox_bytes_ -= sizeof(WorldMessage);
    std::memmove(inbox_.data(), inbox_.data() + sizeof(WorldMessage), inbox_bytes_);
    if (const char* fault = ledger_->accept(message)) go_down(fault);
    world_time_us_.store(ledger_->time_us(), std::memory_order_release);
    return true;
}

void WorldClient::Connection::go_down(const char* fault) {
    const char* none = nullptr;
    fault_.compare_exchange_strong(none, fault);
    arrived_.notify_all();
}

WorldClient::Connection::Wake WorldClient::Connection::wait_message(Lock& lock, std::int64_t deadline_us) {
    if (is_down() || ledger_->ended()) return Wake::kDown;
    if (now_us() >= deadline_us) return Wake::kDeadline;
    if (!lockstep()) {
        const std::chrono::steady_clock::time_point deadline{std::chrono::microseconds(deadline_us)};
        return arrived_.wait_until(lock, deadline) == std::cv_status::timeout ? Wake::kDeadline
                                                                              : Wake::kMessage;
    }
    // One message a call: which messages a tick has seen must not depend on how the socket grouped them.
    if (ledger_->tick_outstanding()) return Wake::kDeadline;
    if (accept_message(lock)) return Wake::kMessage;
    const Wake wake = wait_readable(patience_.silence_us);
    if (wake == Wake::kDeadline) go_down("the world said nothing for too long");
    if (wake != Wake::kMessage) return wake;
    receive_bytes();
    static_cast<void>(accept_message(lock));
    return Wake::kMessage;
}

// A world that has hung up may still have left messages for us, its end perhaps: reading finds out, sending
// only stops.
void WorldClient::Connection::send(const WorldMessage& message, const Lock&) {
    ByteSpan rest = std::as_bytes(std::span(&message, 1));
    while (!rest.empty() && !hung_up_ && !is_down()) {
        const os::SystemResult sent = os::system_call(
            [&] { return ::send(socket_.get(), rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT); },
            {EAGAIN});
        if (sent.done()) rest = rest.subspan(static_cast<std::size_t>(sent.value));
        hung_up_ = sent.failed();
        if (!sent.tolerated()) continue;
        pollfd watched{socket_.get(), POLLOUT, 0};
        const os::SystemResult writable =
            os::system_call([&] { return poll(&watched, 1, milliseconds(kSendPatience_us)); });
        if (writable.value != 1) go_down("the world does not take messages");
    }
}

void WorldClient::Connection::send_freed_slots(const Lock& lock) {
    for (const std::uint32_t slot : ledger_->take_freed_slots()) {
        WorldMessage message;
        message.kind = WorldMessageKind::kSlotFree;
        message.slot = slot;
        send(message, lock);
    }
}

void WorldClient::Connection::sleep_until_us(std::int64_t deadline_us) {
    if (!lockstep()) {
        monotonic_.sleep_until_us(deadline_us);
        return;
    }
    Lock held = lock();
    while (now_us() < deadline_us && wait_message(held, deadline_us) == Wake::kMessage) {
    }
}

void WorldClient::Connection::interrupt() {
    const std::uint64_t one = 1;
    static_cast<void>(
        os::system_call([&] { return ::write(interrupt_event_.get(), &one, sizeof(one)); }, {EAGAIN}));
    monotonic_.interrupt();
}

}  // namespace rig::sim
