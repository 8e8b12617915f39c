// A take as detection saw it, for solving it again on the desk: `headrigd --log-observations FILE`, `headrig
// replay`. Little-endian. Header, 320 bytes:
//   0  4  "RGO1"
//   4  2  u16 version, 3. Version 2 is read too: its observations lack sigma_px, 0. So is version 1: besides,
//         its header ends at byte 64, and every shape had One Euro
//   6  1  u8 camera count, 1..4
//   7  1  u8 reserved, 0
//   8  4  u32 ticks per 1000 s
//  12  1  u8 bit 0: smoothing was on; bit 1: stabilising was on; bits 2-3: loss policy; bit 4: the cameras
//         were not on the head
//  13  3  zero
//  16 32  SHA-256 of the manifest of the pack
//  48  1  u8 delay of the smoothing, frames
//  49 15  zero
//  64 256 per shape u8: how it was smoothed: 0 not, 1 One Euro, 3..61 Savitzky-Golay with that window
// Then one record per tick:
//   0  4  u32 length of the record in bytes, this field included
//   4  4  u32 tick number, +1 each; a gap is a tick that the recorder had to drop
//   8  8  i64 capture time of the tick, us
//  16  1  u8 bit 0: tracking was reset just before this tick; bit 1: so were controls set; bit 2:
//         a neutral was begun to be taken; bit 3: the neutral was forgotten; others 0
//  17  4  u8 status of each camera, 0 for cameras beyond the count
//  21  3  zero
//  24     per camera: u16 count, then count times 6 x f32 (x_px, y_px, diameter_px, contrast, score,
//         sigma_px)
//         with bit 1 then all controls (core/solve/controls.hpp): 256 times 7 x f32 (sparsity, ridge,
//         temporal, multiplier, offset, low, high); u16 count of symmetry pairs, then count times 2 x u16 and
//         f32; u16 count of cancel pairs, then count times 2 x u16
// and at the end CRC-32C of the record before it, u32. A file that ends inside a record was cut; all before
// it is good.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/face_state.hpp"
#include "core/base/result.hpp"
#include "core/detect/observation.hpp"
#include "core/filter/smoothing.hpp"
#include "core/solve/controls.hpp"

namespace rig {

inline constexpr std::size_t kObservationLogHeaderBytes = 64 + kMaxShapes;
inline constexpr std::size_t kObservationRecordHeadBytes = 24;
inline constexpr std::size_t kObservationBytes = 24;
inline constexpr std::size_t kMaxObservationRecordBytes =
    kObservationRecordHeadBytes + kMaxCameras * (2 + kMaxObservations * kObservationBytes) + kMaxShapes * 28 +
    2 + kMaxControlPairs * 8 + 2 + kMaxControlPairs * 4 + 4;

struct ObservationLogHeader {
    std::uint8_t camera_count = 0;
    std::uint32_t rate_millihertz = 0;
    bool filter = true;
    bool stabilise = true;
    bool camera_on_head = true;
    FilterChoice smoothing;        // when `filter` is set
    std::uint8_t loss_policy = 0;  // of core/pipeline
    std::array<std::byte, 32> pack_hash{};
    bool operator==(const ObservationLogHeader&) const = default;
};

// One tick. The spans are the caller's.
struct ObservationTick {
    std::uint32_t number = 0;
    std::int64_t capture_us = 0;
    bool reset_before = false;
    bool neutral_before = false;  // a neutral is taken from this tick on
    bool neutral_forgotten_before = false;
    const ControlSet* new_controls = nullptr;  // from this tick on; nullptr: as before
    std::array<CameraStatus, kMaxCameras> status{};
    std::array<std::span<const Observation>, kMaxCameras> cameras{};
};

enum class ObservationLogError : std::uint8_t {
    kOpen,     // the file cannot be written, or read
    kFormat,   // not such a log, or another version
    kCut,      // the bytes end inside a record
    kDamaged,  // a record whose check sum or fields are wrong
};

// The tick loop appends, something else drains: append() never waits for a disk. One thread for each of the
// two.
class ObservationLogWriter {
  public:
    // kOpen. Allocates the buffer, several seconds of ticks.
    [[nodiscard]] static Result<std::unique_ptr<ObservationLogWriter>, ObservationLogError> create(
        const std::string& path, const ObservationLogHeader& header);
    ~ObservationLogWriter();
    ObservationLogWriter(const ObservationLogWriter&) = delete;
    ObservationLogWriter& operator=(const ObservationLogWriter&) = delete;

    // A tick for which the buffer has no room is dropped and counted; so is everything after a failed write.
    void append(const ObservationTick& tick);
    // Writes what was appended. False once the file has failed.
    bool drain();
    [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

  private:
    struct FileCloser {
        void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
    };
    static constexpr std::size_t kBufferBytes = std::size_t{8} << 20;
    ObservationLogWriter(std::unique_ptr<std::FILE, FileCloser> file, std::uint8_t camera_count);

    std::unique_ptr<std::FILE, FileCloser> file_;
    std::uint8_t camera_count_;
    std::vector<std::byte> buffer_;
    std::vector<std::byte> record_;
    std::atomic<std::uint64_t> written_{0};  // bytes ever appended
    std::atomic<std::uint64_t> drained_{0};  // bytes ever handed to the file
    std::atomic<std::uint64_t> dropped_{0};
    std::atomic<bool> failed_{false};
};

// Reads a log from memory. Any bytes are safe; nothing is allocated after construction.
class ObservationLogReader {
  public:
    // kFormat, kCut. `bytes` outlive the reader.
    [[nodiscard]] static Result<ObservationLogReader, ObservationLogError> open(ByteSpan bytes);
    [[nodiscard]] const ObservationLogHeader& header() const { return header_; }
    [[nodiscard]] bool at_end() const { return position_ == bytes_.size(); }
    // Of the bytes, 0..1: for progress.
    [[nodiscard]] double share_read() const {
        return static_cast<double>(position_) / static_cast<double>(bytes_.size());
    }
    // The next tick; its spans are valid until the next call. kCut and kDamaged are final.
    // Precondition: !at_end().
    [[nodiscard]] Result<ObservationTick, ObservationLogError> next();

  private:
    explicit ObservationLogReader(ByteSpan bytes)
        : bytes_(bytes), observations_(kMaxCameras * kMaxObservations) {}
    [[nodiscard]] bool read_observations(ByteReader& reader, ObservationTick& tick);
    [[nodiscard]] bool read_controls(ByteReader& reader, ObservationTick& tick);

    ByteSpan bytes_;
    bool has_sigma_ = true;  // of observations: since version 3
    std::size_t position_ = kObservationLogHeaderBytes;
    ObservationLogHeader header_;
    std::vector<Observation> observations_;
    ControlSet controls_;
};

}  // namespace rig
