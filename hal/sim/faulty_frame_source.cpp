#include "hal/sim/faulty_frame_source.hpp"

#include <algorithm>
#include <cstring>

#include "core/base/check.hpp"

namespace rig::sim {

FaultyFrameSource::FaultyFrameSource(FrameSource& inner, Clock& clock, const FaultPlan& plan,
                                     std::uint8_t target)
    : inner_(inner), clock_(clock), plan_(plan), target_(target), started_us_(clock.now_us()) {}

const FaultEvent* FaultyFrameSource::active(FaultKind what, std::int64_t time_us) const {
    return plan_.active(what, target_, time_us - started_us_);
}

Result<FrameFormat, FrameError> FaultyFrameSource::start() {
    stop();
    if (active(FaultKind::kCameraGone, clock_.now_us()) != nullptr) return failure(FrameError::kGone);
    const auto format = inner_.start();
    if (!format) return format;
    const auto bytes =
        static_cast<std::size_t>(format->width_px) * static_cast<std::size_t>(format->height_px);
    own_images_.resize(static_cast<std::size_t>(borrow_limit()));
    for (OwnImage& image : own_images_) image.pixels.resize(bytes);
    frozen_pixels_.resize(bytes);
    running_ = true;
    return format;
}

void FaultyFrameSource::stop() {
    inner_.stop();
    for (OwnImage& image : own_images_) image.borrowed = false;
    kept_ = KeptBack::kNothing;
    frozen_by_ = nullptr;
    running_ = false;
    gone_ = false;
}

// One of the inner source's frames may be kept back.
int FaultyFrameSource::borrow_limit() const {
    return std::max(1, inner_.borrow_limit() - 1);
}

std::optional<FrameError> FaultyFrameSource::discard_by_plan(const CameraFrame& frame) {
    std::optional<FrameError> error;
    if (active(FaultKind::kCameraIo, frame.capture_us) != nullptr) error = FrameError::kIo;
    if (active(FaultKind::kCameraShort, frame.capture_us) != nullptr) error = FrameError::kShort;
    if (error) inner_.release(frame.token);
    return error;
}

bool FaultyFrameSource::keep_back(const CameraFrame& frame) {
    if (kept_ != KeptBack::kNothing) return false;
    if (const FaultEvent* late = active(FaultKind::kCameraLate, frame.capture_us); late != nullptr) {
        kept_ = KeptBack::kUntilTime;
        kept_until_us_ = frame.capture_us + static_cast<std::int64_t>(late->magnitude);
    } else if (active(FaultKind::kCameraReorder, frame.capture_us) != nullptr) {
        kept_ = KeptBack::kUntilNewer;
    }
    if (kept_ == KeptBack::kNothing) return false;
    kept_back_ = frame;
    return true;
}

bool FaultyFrameSource::kept_frame_is_due(std::int64_t deadline_us) {
    if (kept_ == KeptBack::kNext) return true;
    if (clock_.now_us() < kept_until_us_) clock_.sleep_until_us(std::min(kept_until_us_, deadline_us));
    return clock_.now_us() >= kept_until_us_;
}

Result<CameraFrame, FrameError> FaultyFrameSource::wait_frame(std::int64_t deadline_us) {
    if (!running_) return failure(FrameError::kNotStarted);
    while (true) {
        gone_ = gone_ || active(FaultKind::kCameraGone, clock_.now_us()) != nullptr;
        if (gone_) return failure(FrameError::kGone);
        if (kept_ == KeptBack::kUntilTime || kept_ == KeptBack::kNext) {
            if (!kept_frame_is_due(deadline_us)) return failure(FrameError::kTimeout);
            kept_ = KeptBack::kNothing;
            return repainted(kept_back_);
        }
        const auto frame = inner_.wait_frame(deadline_us);
        if (!frame) return frame;
        if (const auto error = discard_by_plan(*frame)) return failure(*error);
        if (active(FaultKind::kCameraSilent, frame->capture_us) != nullptr) {
            inner_.release(frame->token);
            continue;
        }
        if (keep_back(*frame)) continue;
        if (kept_ == KeptBack::kUntilNewer) kept_ = KeptBack::kNext;
        return repainted(*frame);
    }
}

CameraFrame FaultyFrameSource::copied(const CameraFrame& frame) {
    const auto free =
        std::find_if(own_images_.begin(), own_images_.end(), [](const OwnImage& i) { return !i.borrowed; });
    RIG_CHECK(free != own_images_.end());
    const auto width = static_cast<std::size_t>(frame.image.width_px);
    for (int y = 0; y < frame.image.height_px; ++y) {
        std::memcpy(free->pixels.data() + static_cast<std::size_t>(y) * width, frame.image.row(y), width);
    }
    free->borrowed = true;
    CameraFrame copy = frame;
    copy.image.pixels = free->pixels.data();
    copy.image.stride_bytes = frame.image.width_px;
    copy.token = kOwnToken | static_cast<std::uint32_t>(free - own_images_.begin());
    inner_.release(frame.token);
    return copy;
}

CameraFrame FaultyFrameSource::repainted(CameraFrame frame) {
    const FaultEvent* frozen = active(FaultKind::kCameraFrozen, frame.capture_us);
    const FaultEvent* flash = active(FaultKind::kExposureFlash, frame.capture_us);
    const FaultEvent* dark = active(FaultKind::kExposureDark, frame.capture_us);
    if (frozen == nullptr && flash == nullptr && dark == nullptr) return frame;
    frame = copied(frame);
    std::vector<std::uint8_t>& pixels = own_images_[frame.token & ~kOwnToken].pixels;
    if (frozen != nullptr && frozen != frozen_by_) {
        frozen_pixels_ = pixels;
        frozen_by_ = frozen;
    }
    if (frozen != nullptr) pixels = frozen_pixels_;
    for (std::uint8_t& pixel : pixels) {
        if (flash != nullptr)
            pixel = static_cast<std::uint8_t>(std::clamp(pixel + flash->magnitude, 0.0, 255.0));
        if (dark != nullptr) pixel = static_cast<std::uint8_t>(pixel / std::max(dark->magnitude, 1.0));
    }
    return frame;
}

void FaultyFrameSource::release(std::uint32_t token) {
    if ((token & kOwnToken) == 0) {
        inner_.release(token);
        return;
    }
    OwnImage& image = own_images_[token & ~kOwnToken];
    image.borrowed = false;
}

Result<void, FrameError> FaultyFrameSource::set_exposure_us(std::int32_t exposure_us) {
    if (gone_) return failure(FrameError::kGone);
    return inner_.set_exposure_us(exposure_us);
}

Result<void, FrameError> FaultyFrameSource::set_gain_db(float gain_db) {
    if (gone_) return failure(FrameError::kGone);
    return inner_.set_gain_db(gain_db);
}

}  // namespace rig::sim
