#include "hal/linux/v4l2/v4l2_frame_source.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>

namespace rig {

namespace {

constexpr double kRateTolerance = 0.02;  // share of the rate: drivers round periods to their clock
constexpr double kPerDecade_db = 20.0;
constexpr std::int32_t kExposureUnit_us = 100;  // of V4L2_CID_EXPOSURE_ABSOLUTE
constexpr std::array kOfPreference{PixelLayout::kGrey, PixelLayout::kY16, PixelLayout::kYuyv,
                                   PixelLayout::kJpeg};

std::size_t pixels(const V4l2CameraConfig& config) {
    return static_cast<std::size_t>(config.width_px) * static_cast<std::size_t>(config.height_px);
}

std::int32_t on_a_step(double value, const os::ControlRange& range) {
    const double steps = std::round((value - range.lowest) / range.step);
    return range.lowest + static_cast<std::int32_t>(steps) * range.step;
}

}  // namespace

V4l2FrameSource::V4l2FrameSource(const Clock& clock, V4l2CameraConfig config)
    : clock_(clock), config_(std::move(config)) {
    const PixelLayout only = config_.layout.value_or(PixelLayout::kJpeg);
    if (config_.layout != PixelLayout::kGrey)
        converted_.resize(os::CaptureDevice::kBuffers * pixels(config_));
    if (only == PixelLayout::kJpeg) jpeg_ = std::make_unique<JpegGrey>(config_.width_px, config_.height_px);
}

template <class... Parts>
FrameError V4l2FrameSource::explain(FrameError error, const char* format, Parts... parts) {
    std::snprintf(trouble_.bytes.data(), trouble_.bytes.size(), format, parts...);
    return error;
}

Result<VideoNode, FrameError> V4l2FrameSource::find_node() {
    std::array<VideoNode, 16> nodes;
    const std::size_t count = list_video_nodes(config_.tree, nodes);
    std::size_t found = 0;
    const auto& [path, serial] = config_.camera;
    switch (find_camera(std::span(nodes).first(count), config_.camera, found)) {
        case CameraMatch::kFound:
            return nodes[found];
        case CameraMatch::kOther:
            return failure(explain(FrameError::kIdentity,
                                   "another camera is plugged in at %s than the one with serial %s: exchange "
                                   "them, or change the board file",
                                   path.c_str(), serial.c_str()));
        case CameraMatch::kAmbiguous:
            return failure(
                explain(FrameError::kIdentity,
                        "%zu cameras are plugged in and several are meant: name one by its path or "
                        "serial number in the board file",
                        count));
        default:
            return failure(explain(FrameError::kGone, "no camera is plugged in at %s (serial %s)",
                                   path.empty() ? "any port" : path.c_str(),
                                   serial.empty() ? "any" : serial.c_str()));
    }
}

bool V4l2FrameSource::fits(const os::CaptureMode& mode) const {
    const bool rate =
        mode.rate_hz <= 0.0 || std::abs(mode.rate_hz - config_.rate_hz) <= kRateTolerance * config_.rate_hz;
    return mode.width_px == config_.width_px && mode.height_px == config_.height_px && rate;
}

Result<void, FrameError> V4l2FrameSource::choose_mode(const VideoNode& node) {
    os::CaptureMode nearest;
    for (const PixelLayout layout : kOfPreference) {
        if (config_.layout && layout != *config_.layout) continue;
        const auto mode = device_.ask_for(layout, config_.width_px, config_.height_px, config_.rate_hz);
        if (!mode || mode->layout != layout) continue;
        if (fits(*mode)) {
            mode_ = *mode;
            return {};
        }
        nearest = *mode;
    }
    if (nearest.width_px == 0) {
        return failure(explain(FrameError::kRefused, "%s (%s) gives none of GREY, Y16, YUYV and MJPEG",
                               node.path.c_str(), node.name.c_str()));
    }
    return failure(explain(
        FrameError::kRefused, "%s (%s) does not give %d x %d at %.3g Hz; it offers %d x %d at %.3g Hz as %s",
        node.path.c_str(), node.name.c_str(), config_.width_px, config_.height_px, config_.rate_hz,
        nearest.width_px, nearest.height_px, nearest.rate_hz, pixel_layout_name(nearest.layout).data()));
}

Result<void, FrameError> V4l2FrameSource::set_controls(const VideoNode& node) {
    // Frames of equal light: a camera that sets its own exposure works against the rig's.
    static_cast<void>(device_.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL));
    static_cast<void>(device_.set_control(V4L2_CID_AUTOGAIN, 0));
    for (const CameraControl& control : config_.controls) {
        if (device_.set_control(control.id, control.value).done()) continue;
        return failure(explain(FrameError::kRefused, "%s (%s) refuses control 0x%08x = %d of the board file",
                               node.path.c_str(), node.name.c_str(), control.id, control.value));
    }
    return {};
}

Result<FrameFormat, FrameError> V4l2FrameSource::start() {
    stop();
    trouble_.set({});
    const auto node = find_node();
    if (!node) return failure(node.error());
    const os::SystemResult opened = device_.open(node->device.c_str());
    if (opened.error_number == ENOTTY) {
        return failure(explain(FrameError::kRefused,
                               "%s (%s) gives no pictures: it is an output, a second node of a camera, or a "
                               "virtual camera that nobody plays into yet",
                               node->device.c_str(), node->path.c_str()));
    }
    if (!opened.done()) {
        return failure(explain(fault_of_call(opened),
                               "%s cannot be opened (error %d): another program has it, or the permission is "
                               "missing (group video)",
                               node->device.c_str(), opened.error_number));
    }
    auto ready = choose_mode(*node);
    if (ready) ready = set_controls(*node);
    if (ready) {
        if (const os::SystemResult started = device_.start(); !started.done()) {
            ready = failure(explain(fault_of_call(started),
                                    "%s (%s) does not start (error %d): too little bandwidth left on its USB "
                                    "bus, or another program streams from it",
                                    node->path.c_str(), node->name.c_str(), started.error_number));
        }
    }
    if (!ready) {
        device_.close();
        return failure(ready.error());
    }
    ++generation_;
    borrowed_ = {};
    running_ = true;
    return FrameFormat{mode_.width_px, mode_.height_px,
                       mode_.rate_hz > 0.0 ? mode_.rate_hz : config_.rate_hz};
}

void V4l2FrameSource::stop() {
    device_.close();
    running_ = false;
}

FrameError V4l2FrameSource::fault_of_call(const os::SystemResult& result) const {
    return os::is_gone(result) ? FrameError::kGone : FrameError::kIo;
}

Result<CameraFrame, FrameError> V4l2FrameSource::wait_frame(std::int64_t deadline_us) {
    if (!running_) return failure(FrameError::kNotStarted);
    while (true) {
        // Rounded down, so that the deadline is kept; the last millisecond is one look without waiting.
        const std::int64_t left_us = std::clamp<std::int64_t>(deadline_us - clock_.now_us(), 0, 1'000'000);
        const os::SystemResult waited = device_.wait(static_cast<int>(left_us / 1000));
        if (waited.failed()) return failure(fault_of_call(waited));
        if (waited.value == 0) {
            if (left_us < 1000) return failure(FrameError::kTimeout);
            continue;
        }
        os::FilledBuffer buffer;
        const os::SystemResult taken = device_.take(buffer);
        if (taken.failed()) return failure(fault_of_call(taken));
        if (taken.done()) return frame_of(buffer);
        if (left_us < 1000) return failure(FrameError::kTimeout);
    }
}

std::optional<FrameError> V4l2FrameSource::fault_of(const os::FilledBuffer& buffer) const {
    if (buffer.damaged) return FrameError::kDamaged;
    if (buffer.over_long || buffer.bytes.empty()) return FrameError::kShort;
    if (mode_.layout == PixelLayout::kJpeg) return std::nullopt;
    const std::size_t rows = static_cast<std::size_t>(mode_.height_px) * mode_.row_bytes;
    const std::size_t longest = std::max<std::size_t>(rows, mode_.most_frame_bytes);
    if (buffer.bytes.size() < rows || buffer.bytes.size() > longest) return FrameError::kShort;
    return std::nullopt;
}

Result<ImageView, FrameError> V4l2FrameSource::image_of(const os::FilledBuffer& buffer, std::size_t slot) {
    ImageView view{buffer.bytes.data(), mode_.width_px, mode_.height_px, mode_.row_bytes};
    if (mode_.layout == PixelLayout::kGrey) return view;
    const std::span<std::uint8_t> into =
        std::span(converted_).subspan(slot * pixels(config_), pixels(config_));
    view.pixels = into.data();
    view.stride_bytes = mode_.width_px;
    if (mode_.layout != PixelLayout::kJpeg) {
        convert_to_grey(mode_.layout, buffer.bytes, mode_.row_bytes, mode_.width_px, mode_.height_px, into);
        return view;
    }
    switch (jpeg_->decode(buffer.bytes, into)) {
        case JpegGrey::Outcome::kDone:
            return view;
        case JpegGrey::Outcome::kOtherSize:
            return failure(FrameError::kFormat);
        default:
            return failure(FrameError::kCorrupt);
    }
}

std::int64_t V4l2FrameSource::capture_us(const os::FilledBuffer& buffer) const {
    if (!buffer.stamp_us) return clock_.now_us();
    const std::int64_t half_us = exposure_us_ / 2;
    return *buffer.stamp_us + (buffer.stamp_at_start ? half_us : -half_us - config_.readout_us);
}

// What cannot be used goes back to the driver at once.
Result<CameraFrame, FrameError> V4l2FrameSource::frame_of(const os::FilledBuffer& buffer) {
    std::optional<FrameError> fault = fault_of(buffer);
    CameraFrame frame;
    if (!fault) {
        const auto image = image_of(buffer, buffer.index);
        if (image) {
            frame.image = *image;
        } else {
            fault = image.error();
        }
    }
    if (fault) {
        const os::SystemResult back = device_.give_back(buffer.index);
        return failure(os::is_gone(back) ? FrameError::kGone : *fault);
    }
    frame.capture_us = capture_us(buffer);
    frame.sequence = buffer.sequence;
    frame.token = generation_ << 8 | buffer.index;
    borrowed_[buffer.index] = true;
    return frame;
}

void V4l2FrameSource::release(std::uint32_t token) {
    const std::uint32_t index = token & 0xFFU;
    const bool ours = running_ && token >> 8 == (generation_ & 0xFFFFFFU) && index < borrowed_.size();
    if (!ours || !borrowed_[index]) return;
    borrowed_[index] = false;
    static_cast<void>(device_.give_back(index));  // a camera that went away is met by the next wait
}

Result<void, FrameError> V4l2FrameSource::set_exposure_us(std::int32_t exposure_us) {
    if (!running_) return failure(FrameError::kNotStarted);
    const bool sensible = exposure_us > 0 && exposure_us <= 1e6 / config_.rate_hz;
    const auto range = device_.range_of(V4L2_CID_EXPOSURE_ABSOLUTE);
    if (!sensible || !range) return failure(FrameError::kRefused);
    const double wanted = static_cast<double>(exposure_us) / kExposureUnit_us;
    if (std::round(wanted) < range->lowest || std::round(wanted) > range->highest)
        return failure(FrameError::kRefused);
    const std::int32_t value = std::clamp(on_a_step(wanted, *range), range->lowest, range->highest);
    const os::SystemResult set = device_.set_control(V4L2_CID_EXPOSURE_ABSOLUTE, value);
    if (!set.done()) return failure(os::is_gone(set) ? FrameError::kGone : FrameError::kRefused);
    exposure_us_ = value * kExposureUnit_us;
    return {};
}

Result<void, FrameError> V4l2FrameSource::set_gain_db(float gain_db) {
    if (!running_) return failure(FrameError::kNotStarted);
    const auto range = device_.range_of(V4L2_CID_GAIN);
    if (!range || !config_.gain.known() || !(gain_db >= 0.0F)) return failure(FrameError::kRefused);
    const double wanted =
        config_.gain.unit_db > 0.0
            ? range->lowest + static_cast<double>(gain_db) / config_.gain.unit_db
            : config_.gain.unity * std::pow(10.0, static_cast<double>(gain_db) / kPerDecade_db);
    if (wanted < range->lowest - 0.5 || wanted > range->highest + 0.5) return failure(FrameError::kRefused);
    const std::int32_t value = std::clamp(on_a_step(wanted, *range), range->lowest, range->highest);
    const os::SystemResult set = device_.set_control(V4L2_CID_GAIN, value);
    if (!set.done()) return failure(os::is_gone(set) ? FrameError::kGone : FrameError::kRefused);
    return {};
}

}  // namespace rig
