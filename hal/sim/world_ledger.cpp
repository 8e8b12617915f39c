#include "hal/sim/world_ledger.hpp"

#include <algorithm>
#include <utility>

namespace rig::sim {

namespace {

constexpr std::uint32_t kFastestRate_millihertz = 1'000'000;
constexpr std::int64_t kLatestTime_us = std::int64_t{1} << 61;  // deadlines a while later must not overflow

}  // namespace

bool hello_is_sound(const WorldHello& hello, std::uint64_t file_bytes) {
    const bool known = hello.magic == kWorldMagic && hello.version == kWorldVersion &&
                       (hello.pace == WorldPace::kLockstep || hello.pace == WorldPace::kRealTime);
    const bool sizes = hello.camera_count >= 1 && hello.camera_count <= kMaxCameras && hello.width_px >= 1 &&
                       hello.width_px <= kMaxImageWidth && hello.height_px >= 1 &&
                       hello.height_px <= kMaxImageHeight && hello.rate_millihertz >= 1 &&
                       hello.rate_millihertz <= kFastestRate_millihertz && hello.slot_count >= 1 &&
                       hello.slot_count <= kMaxWorldSlots && hello.memory_bytes <= kMaxWorldMemoryBytes;
    if (!known || !sizes) return false;
    const std::uint64_t image_bytes = std::uint64_t{hello.width_px} * hello.height_px;
    // At most 64 * 4 * 2^32: no overflow.
    const std::uint64_t images_bytes =
        std::uint64_t{hello.slot_count} * hello.camera_count * hello.image_stride_bytes;
    return hello.image_stride_bytes >= image_bytes && hello.image_offset <= hello.memory_bytes &&
           images_bytes <= hello.memory_bytes - hello.image_offset && hello.memory_bytes <= file_bytes;
}

const char* WorldLedger::accept(const WorldMessage& message) {
    if (ended_) return "a message after the end";
    switch (message.kind) {
        case WorldMessageKind::kFrameSet:
            return accept_frame_set(message);
        case WorldMessageKind::kLineEdge:
            return accept_edge(message);
        case WorldMessageKind::kAdvance:
            if (hello_.pace != WorldPace::kLockstep) return "an advance in real time";
            if (message.time_us < time_us_) return "an advance to a time that has passed";
            return accept_time(message.time_us);
        case WorldMessageKind::kEnd:
            ended_ = true;
            return nullptr;
        default:
            return "a message of a kind that the world does not send";
    }
}

const char* WorldLedger::accept_time(std::int64_t time_us) {
    if (time_us < 0 || time_us > kLatestTime_us) return "a time out of range";
    time_us_ = std::max(time_us_, time_us);
    return nullptr;
}

const char* WorldLedger::accept_frame_set(const WorldMessage& message) {
    if (message.slot >= hello_.slot_count) return "a frame in a slot that does not exist";
    if (ours_[message.slot]) return "a frame in a slot that is still in use";
    if ((message.camera_mask >> hello_.camera_count) != 0) return "a frame of a camera that does not exist";
    const bool lockstep = hello_.pace == WorldPace::kLockstep;
    if (lockstep && tick_outstanding_) return "a frame before the last tick was done";
    if (message.time_us <= last_frame_us_) return "a frame that is not later than the last one";
    if (const char* fault = accept_time(message.time_us)) return fault;
    last_frame_us_ = message.time_us;
    ours_[message.slot] = true;
    tick_outstanding_ = lockstep;
    tick_sequence_ = message.sequence;
    const QueuedFrame frame{message.slot, message.sequence, message.time_us, message.published_us};
    for (std::size_t camera = 0; camera < hello_.camera_count; ++camera) {
        if ((message.camera_mask >> camera & 1U) == 0 || !listening_[camera]) continue;
        if (queues_[camera].full()) {
            drop_holder(camera, queues_[camera].pop_front().slot);
            ++dropped_frames_;
        }
        static_cast<void>(queues_[camera].push_back(frame));
        holders_[message.slot] = static_cast<std::uint8_t>(holders_[message.slot] | 1U << camera);
    }
    if (holders_[message.slot] == 0) static_cast<void>(freed_.push_back(message.slot));
    return nullptr;
}

const char* WorldLedger::accept_edge(const WorldMessage& message) {
    const std::size_t line = message.camera_or_line;
    if (line >= kWorldLineCount) return "an edge of a line that does not exist";
    if (message.active > 1) return "an edge to neither 0 nor 1";
    if (const char* fault = accept_time(message.time_us)) return fault;
    const bool active = message.active == 1;
    if (lines_[line] == active) return nullptr;
    lines_[line] = active;
    if (edges_[line].full()) static_cast<void>(edges_[line].pop_front());
    static_cast<void>(edges_[line].push_back({active, message.time_us}));
    return nullptr;
}

void WorldLedger::drop_holder(std::size_t camera, std::uint32_t slot) {
    holders_[slot] = static_cast<std::uint8_t>(holders_[slot] & ~(1U << camera));
    // A slot is freed once and cannot come again before the list is taken, so the list always has room.
    if (holders_[slot] == 0) static_cast<void>(freed_.push_back(slot));
}

void WorldLedger::listen(std::size_t camera, bool listens) {
    listening_[camera] = listens;
    if (listens) return;
    queues_[camera].clear();
    for (std::uint32_t slot = 0; slot < hello_.slot_count; ++slot) {
        static_cast<void>(release(camera, slot));
    }
}

QueuedFrame WorldLedger::take_frame(std::size_t camera) {
    return queues_[camera].pop_front();
}

bool WorldLedger::release(std::size_t camera, std::uint32_t slot) {
    if (slot >= hello_.slot_count || (holders_[slot] >> camera & 1U) == 0) return false;
    drop_holder(camera, slot);
    return true;
}

WorldLedger::SlotList WorldLedger::take_freed_slots() {
    for (const std::uint32_t slot : freed_) ours_[slot] = false;
    return std::exchange(freed_, SlotList{});
}

}  // namespace rig::sim
