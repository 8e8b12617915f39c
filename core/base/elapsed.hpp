// The time between two stamps of any origin, without the overflow that a plain difference of wild stamps has.
#pragma once

#include <cstdint>
#include <limits>

namespace rig {

// later - earlier, held at the ends of the type's range.
[[nodiscard]] constexpr std::int64_t elapsed_us(std::int64_t earlier_us, std::int64_t later_us) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
    if (earlier_us < 0 && later_us > kMost + earlier_us) return kMost;
    if (earlier_us > 0 && later_us < kLeast + earlier_us) return kLeast;
    return later_us - earlier_us;
}

}  // namespace rig
