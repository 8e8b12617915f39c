#include "hal/sim/memory_store.hpp"

#include <algorithm>
#include <utility>

namespace rig::sim {

MemoryStore::MemoryStore(std::size_t size_bytes)
    : live_(size_bytes, std::byte{0xFF}), durable_(size_bytes, std::byte{0xFF}) {}

Result<void, StoreError> MemoryStore::check_range(std::size_t offset, std::size_t length) const {
    if (!powered_) return failure(StoreError::kIo);
    if (offset > live_.size() || length > live_.size() - offset) return failure(StoreError::kOutOfRange);
    return {};
}

Result<void, StoreError> MemoryStore::read(std::size_t offset, MutableByteSpan into) {
    if (auto checked = check_range(offset, into.size()); !checked) return checked;
    std::copy_n(live_.begin() + static_cast<std::ptrdiff_t>(offset), into.size(), into.begin());
    return {};
}

Result<void, StoreError> MemoryStore::erase(std::size_t offset, std::size_t length) {
    if (auto checked = check_range(offset, length); !checked) return checked;
    return change({offset, std::vector<std::byte>(length, std::byte{0xFF})});
}

Result<void, StoreError> MemoryStore::program(std::size_t offset, ByteSpan bytes) {
    if (auto checked = check_range(offset, bytes.size()); !checked) return checked;
    return change({offset, std::vector<std::byte>(bytes.begin(), bytes.end())});
}

bool MemoryStore::cut_is_due() {
    return operation_count_++ == cut_at_;
}

Result<void, StoreError> MemoryStore::change(Change wanted) {
    std::copy(wanted.bytes.begin(), wanted.bytes.end(),
              live_.begin() + static_cast<std::ptrdiff_t>(wanted.offset));
    unsynced_.push_back(std::move(wanted));
    if (!cut_is_due()) return {};
    cut_power_now(cut_outcome_);
    return failure(StoreError::kIo);
}

Result<void, StoreError> MemoryStore::sync() {
    if (!powered_) return failure(StoreError::kIo);
    if (cut_is_due()) {
        cut_power_now(cut_outcome_);
        return failure(StoreError::kIo);
    }
    durable_ = live_;
    unsynced_.clear();
    return {};
}

void MemoryStore::cut_power_at(std::uint64_t operation, CutOutcome outcome) {
    cut_at_ = operation;
    cut_outcome_ = outcome;
}

void MemoryStore::cut_power_now(CutOutcome outcome) {
    for (const Change& each : unsynced_) {
        const std::size_t survived = outcome == CutOutcome::kDone   ? each.bytes.size()
                                     : outcome == CutOutcome::kHalf ? each.bytes.size() / 2
                                                                    : 0;
        std::copy_n(each.bytes.begin(), survived,
                    durable_.begin() + static_cast<std::ptrdiff_t>(each.offset));
    }
    unsynced_.clear();
    powered_ = false;
}

void MemoryStore::power_on() {
    live_ = durable_;
    unsynced_.clear();
    cut_at_ = kNoCut;
    powered_ = true;
}

}  // namespace rig::sim
