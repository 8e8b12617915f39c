#include "firmware_host/daemon/wear.hpp"

#include <algorithm>
#include <bit>

namespace rig {

namespace {

constexpr std::size_t kPerOctave = 16;

// Times under 16 us have a class each; above, the four bits after the leading one tell classes of an octave
// apart.
std::size_t class_of(std::uint32_t time_us) {
    if (time_us < kPerOctave) return time_us;
    const auto octave = static_cast<std::size_t>(std::bit_width(time_us)) - 1;
    return (octave - 3) * kPerOctave + ((time_us >> (octave - 4)) & (kPerOctave - 1));
}

std::uint32_t longest_of(std::size_t index) {
    if (index < kPerOctave) return static_cast<std::uint32_t>(index);
    const std::size_t octave = index / kPerOctave + 3;
    const std::uint64_t steps = kPerOctave + index % kPerOctave + 1;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>((steps << (octave - 4)) - 1, 0xFFFF'FFFFU));
}

}  // namespace

FaultBook::Change FaultBook::look(FaultMap now) {
    const Change change{now & ~present_, present_ & ~now};
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        const bool raised = (change.raised >> i & 1U) != 0;
        if (raised && counts_[i] < 0xFFFF) ++counts_[i];
    }
    present_ = now;
    return change;
}

void TimeBook::add(std::int64_t time_us) {
    const auto bounded = static_cast<std::uint32_t>(std::clamp<std::int64_t>(time_us, 0, 0xFFFF'FFFF));
    ++classes_[class_of(bounded)];
    ++count_;
    max_us_ = std::max(max_us_, bounded);
}

std::uint32_t TimeBook::at_share(double share) const {
    if (count_ == 0) return 0;
    const auto wanted = static_cast<std::uint64_t>(share * static_cast<double>(count_ - 1)) + 1;
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < classes_.size(); ++i) {
        seen += classes_[i];
        if (seen >= wanted) return std::min(longest_of(i), max_us_);
    }
    return max_us_;
}

TimeSpread TimeBook::spread() const {
    return {at_share(0.5), at_share(0.99), max_us_};
}

}  // namespace rig
