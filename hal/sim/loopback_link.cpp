#include "hal/sim/loopback_link.hpp"

#include <algorithm>
#include <array>

namespace rig::sim {

namespace {

constexpr std::size_t kLengthBytes = sizeof(std::uint32_t);

// Bytes of one direction, first in first out.
class Pipe {
  public:
    explicit Pipe(std::size_t capacity_bytes) : bytes_(capacity_bytes) {}
    [[nodiscard]] std::size_t room() const { return bytes_.size() - size_; }
    [[nodiscard]] std::size_t size() const { return size_; }
    void clear() { first_ = size_ = 0; }
    void push(ByteSpan part) {
        for (const std::byte b : part) bytes_[(first_ + size_++) % bytes_.size()] = b;
    }
    void pop(MutableByteSpan into) {
        for (std::byte& b : into) b = pop_one();
    }
    void skip(std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) static_cast<void>(pop_one());
    }

  private:
    [[nodiscard]] std::byte pop_one() {
        const std::byte b = bytes_[first_];
        first_ = (first_ + 1) % bytes_.size();
        --size_;
        return b;
    }
    std::vector<std::byte> bytes_;
    std::size_t first_ = 0;
    std::size_t size_ = 0;
};

}  // namespace

struct LoopbackPair::Cable {
    Cable(std::size_t capacity_bytes, LoopbackKind kind_)
        : kind(kind_),
          pipes{Pipe(capacity_bytes + (kind_ == LoopbackKind::kDatagram ? kLengthBytes : 0)),
                Pipe(capacity_bytes + (kind_ == LoopbackKind::kDatagram ? kLengthBytes : 0))} {}
    std::mutex mutex;
    LoopbackKind kind;
    bool plugged = true;
    std::array<Pipe, 2> pipes;
    std::array<bool, 2> open{};
};

class LoopbackPair::End final : public ByteLink {
  public:
    End(Cable& cable, std::size_t side) : cable_(cable), side_(side) {}

    [[nodiscard]] Result<void, LinkError> open() override {
        const std::scoped_lock lock(cable_.mutex);
        cable_.open[side_] = cable_.plugged;
        if (!cable_.plugged) return failure(LinkError::kOpen);
        incoming().clear();
        return {};
    }
    void close() override {
        const std::scoped_lock lock(cable_.mutex);
        cable_.open[side_] = false;
    }
    [[nodiscard]] Result<std::size_t, LinkError> write(ByteSpan bytes) override {
        const std::scoped_lock lock(cable_.mutex);
        if (!cable_.open[side_]) return failure(LinkError::kClosed);
        return is_datagram() ? write_datagram(bytes) : write_stream(bytes);
    }
    [[nodiscard]] Result<std::size_t, LinkError> read(MutableByteSpan into) override {
        const std::scoped_lock lock(cable_.mutex);
        if (!cable_.open[side_]) return failure(LinkError::kClosed);
        return is_datagram() ? read_datagram(into) : read_stream(into);
    }
    [[nodiscard]] bool is_datagram() const override { return cable_.kind == LoopbackKind::kDatagram; }

  private:
    [[nodiscard]] Pipe& outgoing() { return cable_.pipes[side_]; }
    [[nodiscard]] Pipe& incoming() { return cable_.pipes[1 - side_]; }

    std::size_t write_stream(ByteSpan bytes) {
        const std::size_t taken = std::min(bytes.size(), outgoing().room());
        outgoing().push(bytes.first(taken));
        return taken;
    }
    std::size_t write_datagram(ByteSpan bytes) {
        if (bytes.empty() || bytes.size() + kLengthBytes > outgoing().room()) return 0;
        const auto length = static_cast<std::uint32_t>(bytes.size());
        outgoing().push(std::as_bytes(std::span(&length, 1)));
        outgoing().push(bytes);
        return bytes.size();
    }
    std::size_t read_stream(MutableByteSpan into) {
        const std::size_t got = std::min(into.size(), incoming().size());
        incoming().pop(into.first(got));
        return got;
    }
    // A datagram longer than `into` is lost whole.
    std::size_t read_datagram(MutableByteSpan into) {
        if (incoming().size() == 0) return 0;
        std::uint32_t length = 0;
        incoming().pop(std::as_writable_bytes(std::span(&length, 1)));
        if (length > into.size()) {
            incoming().skip(length);
            return 0;
        }
        incoming().pop(into.first(length));
        return length;
    }

    Cable& cable_;
    std::size_t side_;
};

LoopbackPair::LoopbackPair(std::size_t capacity_bytes, LoopbackKind kind)
    : cable_(std::make_unique<Cable>(capacity_bytes, kind)),
      near_(std::make_unique<End>(*cable_, 0)),
      far_(std::make_unique<End>(*cable_, 1)) {}

LoopbackPair::~LoopbackPair() = default;

ByteLink& LoopbackPair::near_end() {
    return *near_;
}

ByteLink& LoopbackPair::far_end() {
    return *far_;
}

void LoopbackPair::unplug() {
    const std::scoped_lock lock(cable_->mutex);
    cable_->plugged = false;
    cable_->open = {};
    for (Pipe& pipe : cable_->pipes) pipe.clear();
}

void LoopbackPair::plug_in() {
    const std::scoped_lock lock(cable_->mutex);
    cable_->plugged = true;
}

}  // namespace rig::sim
