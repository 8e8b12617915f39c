// A hello and any messages after it, against the books that the daemon keeps of a world: whatever a world
// says, frames lie inside the memory that it announced, and every slot is freed at most once.
#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/check.hpp"
#include "hal/sim/world_ledger.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace rig;
    using namespace rig::sim;
    const ByteSpan bytes = std::as_bytes(std::span(data, size));
    if (bytes.size() < sizeof(WorldHello)) return 0;
    const auto hello = rig::load<WorldHello>(bytes, 0);
    const std::uint64_t file_bytes = std::uint64_t{1} << 20;
    if (!hello_is_sound(hello, file_bytes)) return 0;
    WorldLedger ledger(hello);
    for (std::size_t c = 0; c < hello.camera_count; ++c) ledger.listen(c, true);
    std::size_t at = sizeof(WorldHello);
    for (; bytes.size() - at >= sizeof(WorldMessage); at += sizeof(WorldMessage)) {
        const auto message = rig::load<WorldMessage>(bytes, at);
        if (ledger.accept(message) != nullptr) return 0;
        for (std::size_t c = 0; c < hello.camera_count; ++c) {
            if (!ledger.has_frame(c) || (message.sequence & 1) != 0) continue;
            const QueuedFrame frame = ledger.take_frame(c);
            const std::uint64_t index = std::uint64_t{frame.slot} * hello.camera_count + c;
            const std::uint64_t end = hello.image_offset + index * hello.image_stride_bytes +
                                      std::uint64_t{hello.width_px} * hello.height_px;
            RIG_CHECK(end <= file_bytes);
            const bool held = ledger.release(c, frame.slot);
            RIG_CHECK(held && !ledger.release(c, frame.slot));
        }
        RIG_CHECK(ledger.take_freed_slots().size() <= hello.slot_count);
        if ((message.sequence & 2) == 0) ledger.finish_tick();
    }
    return 0;
}
