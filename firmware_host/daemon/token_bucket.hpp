// So many per second on average, and so many at once.
#pragma once

#include <algorithm>
#include <cstdint>

namespace rig {

class TokenBucket {
  public:
    TokenBucket(std::int64_t per_second, std::int64_t at_once)
        : interval_us_(1'000'000 / per_second), at_once_(at_once), tokens_(at_once) {}

    // False: too many; do without.
    [[nodiscard]] bool take(std::int64_t now_us) {
        const std::int64_t earned = std::min((now_us - filled_us_) / interval_us_, at_once_);
        if (earned > 0) {
            tokens_ = std::min(at_once_, tokens_ + earned);
            filled_us_ = now_us;
        }
        if (tokens_ == 0) return false;
        --tokens_;
        return true;
    }

  private:
    std::int64_t interval_us_;
    std::int64_t at_once_;
    std::int64_t tokens_;
    std::int64_t filled_us_ = 0;
};

}  // namespace rig
