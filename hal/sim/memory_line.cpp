#include "hal/sim/memory_line.hpp"

namespace rig::sim {

Result<bool, GpioError> MemoryLine::get() {
    const std::scoped_lock lock(mutex_);
    if (gone_) return failure(GpioError::kGone);
    return active_;
}

Result<void, GpioError> MemoryLine::set(bool active) {
    const std::scoped_lock lock(mutex_);
    if (gone_) return failure(GpioError::kGone);
    if (direction_ != LineDirection::kOutput) return failure(GpioError::kWrongDirection);
    active_ = active;
    return {};
}

bool MemoryLine::take_edge(EdgeEvent& edge) {
    if (edges_.empty()) return false;
    edge = edges_.pop_front();
    return true;
}

Result<EdgeEvent, GpioError> MemoryLine::wait_edge(std::int64_t deadline_us) {
    if (direction_ != LineDirection::kInput) return failure(GpioError::kWrongDirection);
    EdgeEvent edge;
    for (int attempt = 0; attempt < 2; ++attempt) {
        {
            const std::scoped_lock lock(mutex_);
            if (gone_) return failure(GpioError::kGone);
            if (take_edge(edge)) return edge;
        }
        if (attempt == 0 && clock_.now_us() < deadline_us) clock_.sleep_until_us(deadline_us);
    }
    return failure(GpioError::kTimeout);
}

void MemoryLine::drive(bool active) {
    {
        const std::scoped_lock lock(mutex_);
        if (active == active_) return;
        active_ = active;
        if (edges_.full()) {
            static_cast<void>(edges_.pop_front());
            ++lost_edges_;
        }
        static_cast<void>(edges_.push_back({active, clock_.now_us()}));
    }
    clock_.interrupt();
}

void MemoryLine::unplug() {
    {
        const std::scoped_lock lock(mutex_);
        gone_ = true;
    }
    clock_.interrupt();
}

bool MemoryLine::level() const {
    const std::scoped_lock lock(mutex_);
    return active_;
}

std::uint64_t MemoryLine::lost_edges() const {
    const std::scoped_lock lock(mutex_);
    return lost_edges_;
}

}  // namespace rig::sim
