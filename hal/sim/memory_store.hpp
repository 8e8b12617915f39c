// Persistent bytes in memory, whose power can be cut at any operation.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/store.hpp"

namespace rig::sim {

// What has become of a change that no sync() had made durable when the power went.
enum class CutOutcome : std::uint8_t { kNotDone, kHalf, kDone };

// Operations (erase, program, sync) are numbered from 0 over the store's life. When the power goes during
// operation n, the outcome applies to n and to every change since the last good sync; a sync that is cut
// makes nothing durable by itself. From then on every call is kIo until power_on().
class MemoryStore final : public Store {
  public:
    explicit MemoryStore(std::size_t size_bytes);
    [[nodiscard]] std::size_t size_bytes() const override { return live_.size(); }
    [[nodiscard]] Result<void, StoreError> read(std::size_t offset, MutableByteSpan into) override;
    [[nodiscard]] Result<void, StoreError> erase(std::size_t offset, std::size_t length) override;
    [[nodiscard]] Result<void, StoreError> program(std::size_t offset, ByteSpan bytes) override;
    [[nodiscard]] Result<void, StoreError> sync() override;

    void cut_power_at(std::uint64_t operation, CutOutcome outcome);
    void cut_power_now(CutOutcome outcome);
    // Starts again from what survived; no cut is planned any more.
    void power_on();
    [[nodiscard]] std::uint64_t operation_count() const { return operation_count_; }
    [[nodiscard]] bool has_power() const { return powered_; }

  private:
    struct Change {
        std::size_t offset;
        std::vector<std::byte> bytes;
    };
    static constexpr std::uint64_t kNoCut = ~std::uint64_t{0};

    [[nodiscard]] Result<void, StoreError> check_range(std::size_t offset, std::size_t length) const;
    [[nodiscard]] Result<void, StoreError> change(Change wanted);
    [[nodiscard]] bool cut_is_due();

    std::vector<std::byte> live_;     // what read() sees
    std::vector<std::byte> durable_;  // what a power cut cannot take
    std::vector<Change> unsynced_;
    std::uint64_t operation_count_ = 0;
    std::uint64_t cut_at_ = kNoCut;
    CutOutcome cut_outcome_ = CutOutcome::kNotDone;
    bool powered_ = true;
};

}  // namespace rig::sim
