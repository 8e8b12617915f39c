// One digital line: strobe, trigger, button, state LED.
#pragma once

#include <cstdint>

#include "core/base/result.hpp"

namespace rig {

enum class GpioError : std::uint8_t { kGone, kIo, kWrongDirection, kTimeout };

struct EdgeEvent {
    bool rising = false;
    std::int64_t time_us = 0;  // of the edge, on the Clock that belongs to the line
};

// Contract. `true` is active whatever the wiring's polarity. set() needs an output line, wait_edge() an input
// line, get() works on both. wait_edge() returns edges in order, each once, or kTimeout no later than
// deadline_us. The initial state of an output is given at construction. One thread uses a line.
class GpioLine {
  public:
    virtual ~GpioLine() = default;
    [[nodiscard]] virtual Result<bool, GpioError> get() = 0;
    [[nodiscard]] virtual Result<void, GpioError> set(bool active) = 0;
    [[nodiscard]] virtual Result<EdgeEvent, GpioError> wait_edge(std::int64_t deadline_us) = 0;
};

}  // namespace rig
