#include "firmware_host/daemon/camera_feed.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace rig {

namespace {

constexpr std::int64_t kFirstBackOff_us = 250'000;
constexpr std::int64_t kLongestBackOff_us = 2'000'000;
constexpr std::int64_t kSilence_us = 40'000;
constexpr int kIoErrorsToRestart = 3;
constexpr int kDiscardsPerTake = 8;  // of frames in one call: bounded work whatever a camera does
constexpr int kThawFrames = 5;
constexpr int kHashedRows = 16;
constexpr std::uint8_t kBlack = 4;
constexpr std::uint8_t kWhite = 251;

struct PictureHash {
    std::uint64_t value = 0;
    bool telling = false;  // not all black or saturated: such pictures are equal without being frozen
};

// FNV-1a over eight bytes at a time of a few rows spread over the picture.
PictureHash hash_picture(const ImageView& image) {
    PictureHash hash{14695981039346656037ULL, false};
    const int rows = std::min(kHashedRows, image.height_px);
    for (int i = 0; i < rows; ++i) {
        const std::uint8_t* row = image.row((2 * i + 1) * image.height_px / (2 * rows));
        for (int x = 0; x + 8 <= image.width_px; x += 8) {
            std::uint64_t eight = 0;
            std::memcpy(&eight, row + x, sizeof(eight));
            hash.value = (hash.value ^ eight) * 1099511628211ULL;
            hash.telling = hash.telling || (row[x] > kBlack && row[x] < kWhite);
        }
    }
    return hash;
}

}  // namespace

Result<FrameFormat, FrameError> CameraFeed::open() {
    const auto format = source_.start();
    running_ = format.has_value();
    last_usable_us_ = clock_.now_us();
    passed_exposure_ = 0;
    counts_on_ = false;  // a camera counts anew from each start
    if (running_) {
        back_off_us_ = 0;
        set_status(CameraStatus::kMissing);
    } else {
        if (format.error() == FrameError::kIdentity) raise(Fault::kCameraIdentity);
        lose();
    }
    return format;
}

void CameraFeed::close() {
    source_.stop();
    running_ = false;
}

void CameraFeed::lose() {
    source_.stop();
    running_ = false;
    frozen_ = false;
    equal_pictures_ = 0;
    back_off_us_ = std::clamp(2 * back_off_us_, kFirstBackOff_us, kLongestBackOff_us);
    retry_us_ = clock_.now_us() + back_off_us_;
    set_status(CameraStatus::kGone);
}

bool CameraFeed::is_running() {
    if (!running_ && !ended() && clock_.now_us() >= retry_us_) static_cast<void>(open());
    return running_;
}

void CameraFeed::note_io_error() {
    raise(Fault::kCameraIo);
    const std::int64_t now_us = clock_.now_us();
    if (now_us - io_since_us_ > config_.io_window_us) {
        io_since_us_ = now_us;
        io_errors_ = 0;
    }
    if (++io_errors_ < kIoErrorsToRestart) return;
    io_errors_ = 0;
    source_.stop();
    static_cast<void>(open());
}

bool CameraFeed::go_on_after(FrameError error) {
    switch (error) {
        case FrameError::kIo:
            note_io_error();
            return running_;
        case FrameError::kShort:
            raise(Fault::kShortFrame);
            return true;
        case FrameError::kFormat:
            raise(Fault::kFormatChanged);
            return true;
        case FrameError::kDamaged:
            raise(Fault::kBufferError);
            return true;
        case FrameError::kCorrupt:
            raise(Fault::kCorruptJpeg);
            return true;
        case FrameError::kEnded:
            ended_.store(true, std::memory_order_relaxed);
            set_status(CameraStatus::kMissing);
            return false;
        case FrameError::kTimeout:
            if (clock_.now_us() - last_usable_us_ > kSilence_us && !frozen_)
                set_status(CameraStatus::kMissing);
            return false;
        default:
            lose();
            return false;
    }
}

bool CameraFeed::is_frozen(const CameraFrame& frame) {
    if (config_.frozen_frames <= 0) return false;
    const PictureHash hash = hash_picture(frame.image);
    const bool equal = hash.telling && hash.value == picture_hash_;
    picture_hash_ = hash.value;
    equal_pictures_ = equal ? equal_pictures_ + 1 : 0;
    changing_pictures_ = equal ? 0 : changing_pictures_ + 1;
    if (equal_pictures_ + 1 >= config_.frozen_frames) frozen_ = true;
    if (frozen_ && changing_pictures_ >= kThawFrames) frozen_ = false;
    return frozen_;
}

CameraFeed::Verdict CameraFeed::judge(const CameraFrame& frame) {
    if (any_frame_ && frame.capture_us <= last_capture_us_) {
        raise(Fault::kLateFrame);
        return Verdict::kSkip;
    }
    if (counts_on_ && frame.sequence - last_sequence_ != 1) raise(Fault::kSequenceGap);
    any_frame_ = counts_on_ = true;
    last_capture_us_ = frame.capture_us;
    last_sequence_ = frame.sequence;
    if (!is_frozen(frame)) return Verdict::kUse;
    set_status(CameraStatus::kFrozen);
    return Verdict::kSkip;
}

void CameraFeed::request_exposure(std::int32_t exposure_us, float gain_db) {
    const auto high = std::uint64_t{static_cast<std::uint32_t>(exposure_us)} << 32;
    wanted_exposure_.store(high | std::bit_cast<std::uint32_t>(gain_db), std::memory_order_relaxed);
}

void CameraFeed::pass_exposure_on() {
    const std::uint64_t wanted = wanted_exposure_.load(std::memory_order_relaxed);
    if (wanted == passed_exposure_) return;
    passed_exposure_ = wanted;
    const bool timed = source_.set_exposure_us(static_cast<std::int32_t>(wanted >> 32)).has_value();
    const bool gained =
        source_.set_gain_db(std::bit_cast<float>(static_cast<std::uint32_t>(wanted))).has_value();
    if (!timed || !gained) refusals_.fetch_add(1, std::memory_order_relaxed);
}

std::optional<CameraFrame> CameraFeed::take(std::int64_t deadline_us) {
    for (int attempt = 0; attempt < kDiscardsPerTake && is_running(); ++attempt) {
        pass_exposure_on();
        const auto frame = source_.wait_frame(deadline_us);
        if (!frame) {
            if (!go_on_after(frame.error())) return std::nullopt;
            continue;
        }
        if (judge(*frame) == Verdict::kSkip) {
            source_.release(frame->token);
            continue;
        }
        last_usable_us_ = clock_.now_us();
        set_status(CameraStatus::kGood);
        return *frame;
    }
    return std::nullopt;
}

}  // namespace rig
