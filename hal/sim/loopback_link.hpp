// Two link ends joined in memory: what one writes the other reads.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "hal/byte_link.hpp"

namespace rig::sim {

enum class LoopbackKind : std::uint8_t { kStream, kDatagram };

// Like two serial ports and a cable: an end that is closed or does not read only makes the other end's writes
// take 0 bytes once `capacity_bytes` are waiting. The two ends may be used by two threads.
class LoopbackPair {
  public:
    LoopbackPair(std::size_t capacity_bytes, LoopbackKind kind);
    ~LoopbackPair();
    LoopbackPair(const LoopbackPair&) = delete;
    LoopbackPair& operator=(const LoopbackPair&) = delete;

    [[nodiscard]] ByteLink& near_end();
    [[nodiscard]] ByteLink& far_end();

    // The cable: unplugging it loses what is under way, makes both ends kClosed and keeps open() at kOpen.
    void unplug();
    void plug_in();

  private:
    struct Cable;
    class End;
    std::unique_ptr<Cable> cable_;
    std::unique_ptr<End> near_;
    std::unique_ptr<End> far_;
};

}  // namespace rig::sim
