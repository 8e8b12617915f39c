// Any link, with the faults of a plan.
#pragma once

#include <array>
#include <cstdint>

#include "hal/byte_link.hpp"
#include "hal/clock.hpp"
#include "hal/sim/fault_plan.hpp"

namespace rig::sim {

// Breaks the bytes, never the contract. Clock times of the plan count from construction.
class FaultyLink final : public ByteLink {
  public:
    FaultyLink(ByteLink& inner, const Clock& clock, const FaultPlan& plan, std::uint8_t target);
    [[nodiscard]] Result<void, LinkError> open() override;
    void close() override { inner_.close(); }
    [[nodiscard]] Result<std::size_t, LinkError> write(ByteSpan bytes) override;
    [[nodiscard]] Result<std::size_t, LinkError> read(MutableByteSpan into) override;
    [[nodiscard]] bool is_datagram() const override { return inner_.is_datagram(); }

    [[nodiscard]] std::uint64_t flipped_bits() const { return flipped_bits_; }
    [[nodiscard]] std::uint64_t lost_bytes() const { return lost_bytes_; }

  private:
    static constexpr std::size_t kScratchBytes = 2048;

    [[nodiscard]] const FaultEvent* active(FaultKind what) const;
    [[nodiscard]] bool is_reset();
    void flip_bits(MutableByteSpan bytes);
    [[nodiscard]] Result<std::size_t, LinkError> write_lossy(ByteSpan bytes, double loss);
    [[nodiscard]] std::size_t lose_bytes(MutableByteSpan bytes, double loss);

    ByteLink& inner_;
    const Clock& clock_;
    const FaultPlan& plan_;
    std::uint8_t target_;
    std::int64_t started_us_;
    FaultRandom random_;
    std::array<std::byte, kScratchBytes> scratch_{};
    std::uint64_t flipped_bits_ = 0;
    std::uint64_t lost_bytes_ = 0;
};

}  // namespace rig::sim
