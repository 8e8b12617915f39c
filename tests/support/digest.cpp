#include "tests/support/digest.hpp"

namespace rig::test {

Digest& Digest::add_bytes(std::span<const std::byte> bytes) {
    constexpr std::uint64_t kPrime = 1099511628211ULL;
    for (const std::byte byte : bytes) {
        value_ = (value_ ^ static_cast<std::uint64_t>(byte)) * kPrime;
    }
    return *this;
}

}  // namespace rig::test
