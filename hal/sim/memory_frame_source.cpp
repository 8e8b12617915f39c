#include "hal/sim/memory_frame_source.hpp"

#include <algorithm>
#include <utility>

#include "core/base/check.hpp"

namespace rig::sim {

namespace {

constexpr double kMicrosPerSecond = 1e6;
constexpr std::int32_t kShortestExposure_us = 10;
constexpr float kLargestGain_db = 48.0F;

}  // namespace

PacedFrameSource::PacedFrameSource(Clock& clock, int width_px, int height_px, FramePacing pacing)
    : clock_(clock), format_{width_px, height_px, pacing.rate_hz}, pacing_(pacing) {
    RIG_CHECK(width_px > 0 && height_px > 0 && pacing.rate_hz > 0.0);
}

std::size_t PacedFrameSource::pixel_count() const {
    return static_cast<std::size_t>(format_.width_px) * static_cast<std::size_t>(format_.height_px);
}

std::int64_t PacedFrameSource::capture_of(std::uint32_t frame) const {
    return started_us_ + static_cast<std::int64_t>((frame + 1.0) * kMicrosPerSecond / pacing_.rate_hz);
}

Result<FrameFormat, FrameError> PacedFrameSource::start() {
    stop();
    if (!ever_started_) started_us_ = clock_.now_us();
    ever_started_ = true;
    while (capture_of(next_frame_) <= clock_.now_us()) ++next_frame_;
    running_ = true;
    return format_;
}

void PacedFrameSource::stop() {
    running_ = false;
    borrowed_ = {};
}

void PacedFrameSource::skip_missed(std::int64_t now_us) {
    while (capture_of(next_frame_ + 1) + pacing_.delivery_us <= now_us) ++next_frame_;
}

Result<CameraFrame, FrameError> PacedFrameSource::wait_frame(std::int64_t deadline_us) {
    if (!running_) return failure(FrameError::kNotStarted);
    if (pacing_.drops_when_late) skip_missed(clock_.now_us());
    if (pacing_.frame_total != 0 && next_frame_ >= pacing_.frame_total) return failure(FrameError::kEnded);
    const std::int64_t due_us = capture_of(next_frame_) + pacing_.delivery_us;
    if (clock_.now_us() < due_us) clock_.sleep_until_us(std::min(due_us, deadline_us));
    if (clock_.now_us() < due_us) return failure(FrameError::kTimeout);
    const auto free = std::find(borrowed_.begin(), borrowed_.end(), false);
    if (free == borrowed_.end())
        return failure(FrameError::kTimeout);  // starved, as a driver without buffers is
    *free = true;
    const auto slot = static_cast<std::size_t>(free - borrowed_.begin());
    CameraFrame frame;
    frame.image = {pixels_of(next_frame_, slot), format_.width_px, format_.height_px, format_.width_px};
    frame.capture_us = capture_of(next_frame_);
    frame.sequence = next_frame_;
    frame.token = static_cast<std::uint32_t>(slot);
    ++next_frame_;
    return frame;
}

void PacedFrameSource::release(std::uint32_t token) {
    if (!running_) return;  // stop() has taken everything back
    RIG_CHECK(token < borrowed_.size() && borrowed_[token]);
    borrowed_[token] = false;
}

Result<void, FrameError> PacedFrameSource::set_exposure_us(std::int32_t exposure_us) {
    if (exposure_us < kShortestExposure_us || exposure_us > kMicrosPerSecond / pacing_.rate_hz) {
        return failure(FrameError::kRefused);
    }
    return {};
}

Result<void, FrameError> PacedFrameSource::set_gain_db(float gain_db) {
    if (!(gain_db >= 0.0F && gain_db <= kLargestGain_db)) return failure(FrameError::kRefused);
    return {};
}

ReplayFrameSource::ReplayFrameSource(Clock& clock, int width_px, int height_px,
                                     std::vector<std::vector<std::uint8_t>> images, FramePacing pacing)
    : PacedFrameSource(clock, width_px, height_px, pacing), images_(std::move(images)) {
    RIG_CHECK(!images_.empty());
    for (const auto& image : images_) RIG_CHECK(image.size() == pixel_count());
}

const std::uint8_t* ReplayFrameSource::pixels_of(std::uint32_t frame, std::size_t) {
    return images_[frame % images_.size()].data();
}

SyntheticFrameSource::SyntheticFrameSource(Clock& clock, int width_px, int height_px, FramePainter painter,
                                           FramePacing pacing)
    : PacedFrameSource(clock, width_px, height_px, pacing), painter_(std::move(painter)) {
    for (auto& slot : slots_) slot.resize(pixel_count());
}

const std::uint8_t* SyntheticFrameSource::pixels_of(std::uint32_t frame, std::size_t slot) {
    painter_(frame, slots_[slot]);
    return slots_[slot].data();
}

}  // namespace rig::sim
