// A digital line whose other end is the test.
#pragma once

#include <cstdint>
#include <mutex>

#include "core/base/ring.hpp"
#include "hal/clock.hpp"
#include "hal/gpio_line.hpp"

namespace rig::sim {

enum class LineDirection : std::uint8_t { kInput, kOutput };

class MemoryLine final : public GpioLine {
  public:
    static constexpr std::size_t kEdgeCapacity =
        64;  // beyond it the oldest edge is lost and counted, as in gpiod

    MemoryLine(Clock& clock, LineDirection direction, bool initially_active = false)
        : clock_(clock), direction_(direction), active_(initially_active) {}
    [[nodiscard]] Result<bool, GpioError> get() override;
    [[nodiscard]] Result<void, GpioError> set(bool active) override;
    [[nodiscard]] Result<EdgeEvent, GpioError> wait_edge(std::int64_t deadline_us) override;

    // The other end; any thread. A level that is already there is no edge.
    void drive(bool active);
    void unplug();
    [[nodiscard]] bool level() const;
    [[nodiscard]] std::uint64_t lost_edges() const;

  private:
    [[nodiscard]] bool take_edge(EdgeEvent& edge);

    Clock& clock_;
    LineDirection direction_;
    mutable std::mutex mutex_;
    bool active_;
    bool gone_ = false;
    std::uint64_t lost_edges_ = 0;
    Ring<EdgeEvent, kEdgeCapacity> edges_;
};

}  // namespace rig::sim
