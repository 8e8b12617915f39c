// A .rec file: what a board said, frame by frame, with the host's time of reception. It can be read up to the
// last whole entry, however its writing ended. Not for images or observations: those are the board's
// recorder.
//
// Layout, little-endian: the eight bytes "RIGREC01"; then entries of u16 length n, i64 received (us, host's
// monotonic clock), n bytes (one frame of core/wire/PROTOCOL.md with its delimiters), u32 CRC-32C of the
// entry before it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/session_messages.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

class RecordingWriter {
  public:
    [[nodiscard]] static Result<RecordingWriter, FileError> create(const std::filesystem::path& path);

    // frame: at most kMaxWireFrameBytes. A disk that is full is reported by the next add() or close().
    [[nodiscard]] Result<void, FileError> add(ByteSpan frame, std::int64_t received_us);
    [[nodiscard]] Result<void, FileError> close();
    [[nodiscard]] std::uint64_t frame_count() const { return frame_count_; }

  private:
    explicit RecordingWriter(const std::filesystem::path& path)
        : path_(path), file_(path, std::ios::binary) {}

    std::filesystem::path path_;
    std::ofstream file_;
    std::uint64_t frame_count_ = 0;
};

struct RecordedFrame {
    std::int64_t received_us = 0;
    ByteSpan frame;  // borrowed from the reader
};

class RecordingReader {
  public:
    // Errors: missing, not a recording. A damaged or cut one opens and yields what is whole.
    [[nodiscard]] static Result<RecordingReader, FileError> open(const std::filesystem::path& path);
    // The same from bytes; `name` stands for the file in errors.
    [[nodiscard]] static Result<RecordingReader, FileError> parse(std::vector<std::byte> bytes,
                                                                  const std::filesystem::path& name);

    // The next entry; nothing at the end or at the first entry that is not whole.
    [[nodiscard]] std::optional<RecordedFrame> next();
    // After next() returned nothing: bytes that could not be read; 0 when the file ends well.
    [[nodiscard]] std::size_t unread_bytes() const { return bytes_.size() - position_; }

  private:
    explicit RecordingReader(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

    std::vector<std::byte> bytes_;
    std::size_t position_ = 0;
};

// What a recording holds.
struct RecordingSummary {
    std::optional<Hello> hello;
    std::vector<std::string> shape_names;
    std::vector<std::string> marker_names;
    std::map<MessageType, std::uint64_t> messages;
    std::uint64_t frames = 0;
    std::uint64_t states = 0;
    std::uint64_t states_missing = 0;
    std::uint64_t bad_frames = 0;  // entries that hold no good frame
    double seconds = 0.0;
    std::size_t unread_bytes = 0;
};
[[nodiscard]] RecordingSummary summarise(RecordingReader& reader);

}  // namespace rig::host
