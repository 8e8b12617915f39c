// Wear and times, collected where they happen: fault counters, tick times. What is streamed of it is
// core/wire/health.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/faults.hpp"
#include "core/wire/health.hpp"

namespace rig {

// Counts how often each fault of a map was raised, from one look to the next.
class FaultBook {
  public:
    struct Change {
        FaultMap raised = 0;
        FaultMap cleared = 0;
    };
    Change look(FaultMap now);
    [[nodiscard]] FaultMap present() const { return present_; }
    [[nodiscard]] const std::array<std::uint16_t, 64>& counts() const { return counts_; }

  private:
    FaultMap present_ = 0;
    std::array<std::uint16_t, 64> counts_{};  // saturating
};

// A distribution of times in 16 classes per octave: what it reports is at most 4.5 % above the truth. 0 s to
// 2^32 us.
class TimeBook {
  public:
    void add(std::int64_t time_us);
    [[nodiscard]] TimeSpread spread() const;

  private:
    static constexpr std::size_t kPerOctave = 16;
    static constexpr std::size_t kClasses = 33 * kPerOctave;
    [[nodiscard]] std::uint32_t at_share(double share) const;

    std::array<std::uint32_t, kClasses> classes_{};
    std::uint64_t count_ = 0;
    std::uint32_t max_us_ = 0;
};

}  // namespace rig
