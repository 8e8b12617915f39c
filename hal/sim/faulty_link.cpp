#include "hal/sim/faulty_link.hpp"

#include <algorithm>

namespace rig::sim {

FaultyLink::FaultyLink(ByteLink& inner, const Clock& clock, const FaultPlan& plan, std::uint8_t target)
    : inner_(inner),
      clock_(clock),
      plan_(plan),
      target_(target),
      started_us_(clock.now_us()),
      random_(plan.seed + target) {}

const FaultEvent* FaultyLink::active(FaultKind what) const {
    return plan_.active(what, target_, clock_.now_us() - started_us_);
}

bool FaultyLink::is_reset() {
    if (active(FaultKind::kLinkReset) == nullptr) return false;
    inner_.close();
    return true;
}

Result<void, LinkError> FaultyLink::open() {
    if (is_reset()) return failure(LinkError::kOpen);
    return inner_.open();
}

void FaultyLink::flip_bits(MutableByteSpan bytes) {
    const FaultEvent* event = active(FaultKind::kLinkBitErrors);
    if (event == nullptr) return;
    for (std::byte& b : bytes) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            if (!random_.chance(event->magnitude)) continue;
            b ^= std::byte{1} << bit;
            ++flipped_bits_;
        }
    }
}

std::size_t FaultyLink::lose_bytes(MutableByteSpan bytes, double loss) {
    std::size_t kept = 0;
    for (const std::byte b : bytes) {
        if (random_.chance(loss)) {
            ++lost_bytes_;
        } else {
            bytes[kept++] = b;
        }
    }
    return kept;
}

// Byte by byte, so that what the inner link does not take is not counted as taken.
Result<std::size_t, LinkError> FaultyLink::write_lossy(ByteSpan bytes, double loss) {
    std::size_t taken = 0;
    for (; taken < bytes.size(); ++taken) {
        if (random_.chance(loss)) {
            ++lost_bytes_;
            continue;
        }
        scratch_[0] = bytes[taken];
        flip_bits(MutableByteSpan(scratch_).first(1));
        const auto written = inner_.write(ByteSpan(scratch_).first(1));
        if (!written) return taken == 0 ? written : taken;
        if (*written == 0) break;
    }
    return taken;
}

Result<std::size_t, LinkError> FaultyLink::write(ByteSpan bytes) {
    if (is_reset()) return failure(LinkError::kClosed);
    if (active(FaultKind::kLinkStall) != nullptr) return std::size_t{0};
    if (const FaultEvent* event = active(FaultKind::kLinkPartial); event != nullptr && !is_datagram()) {
        bytes =
            bytes.first(std::min(bytes.size(), static_cast<std::size_t>(std::max(event->magnitude, 0.0))));
    }
    const FaultEvent* loss = active(FaultKind::kLinkByteLoss);
    if (loss != nullptr && is_datagram()) {
        if (!random_.chance(loss->magnitude)) return inner_.write(bytes);
        lost_bytes_ += bytes.size();
        return bytes.size();
    }
    if (loss != nullptr) return write_lossy(bytes, loss->magnitude);
    if (active(FaultKind::kLinkBitErrors) == nullptr || bytes.size() > scratch_.size())
        return inner_.write(bytes);
    std::copy(bytes.begin(), bytes.end(), scratch_.begin());
    const MutableByteSpan damaged = MutableByteSpan(scratch_).first(bytes.size());
    flip_bits(damaged);
    return inner_.write(damaged);
}

Result<std::size_t, LinkError> FaultyLink::read(MutableByteSpan into) {
    if (is_reset()) return failure(LinkError::kClosed);
    if (active(FaultKind::kLinkStall) != nullptr) return std::size_t{0};
    const auto got = inner_.read(into);
    if (!got) return got;
    flip_bits(into.first(*got));
    const FaultEvent* loss = active(FaultKind::kLinkByteLoss);
    if (loss == nullptr) return got;
    if (!is_datagram()) return lose_bytes(into.first(*got), loss->magnitude);
    if (!random_.chance(loss->magnitude)) return got;
    lost_bytes_ += *got;
    return std::size_t{0};
}

}  // namespace rig::sim
