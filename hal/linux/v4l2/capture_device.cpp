#include "hal/linux/v4l2/capture_device.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>

namespace rig::os {

namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kMapped = V4L2_MEMORY_MMAP;
constexpr std::array<std::uint32_t, kPixelLayouts> kFourCharacters{V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16,
                                                                   V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};

template <class Argument>
SystemResult control(const Descriptor& node, unsigned long what, Argument& argument,
                     std::initializer_list<int> tolerated = {}) {
    return system_call([&] { return ::ioctl(node.get(), what, &argument); }, tolerated);
}

v4l2_buffer mapped_buffer(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = kCapture;
    buffer.memory = kMapped;
    buffer.index = index;
    return buffer;
}

// Of a driver that answers with zeros.
double rate_of(const v4l2_fract& period) {
    return period.numerator > 0 ? static_cast<double>(period.denominator) / period.numerator : 0.0;
}

SystemResult failed_with(int error_number) {
    return {Outcome::kFailed, -1, error_number};
}

}  // namespace

bool is_gone(const SystemResult& result) {
    const int number = result.error_number;
    return result.failed() && (number == ENODEV || number == ENXIO || number == ENOENT || number == EBADF ||
                               number == ESHUTDOWN);
}

SystemResult CaptureDevice::open(const char* path) {
    close();
    const auto opened = system_call([&] { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); });
    if (!opened.done()) return opened;
    node_ = Descriptor(static_cast<int>(opened.value));
    v4l2_capability capability{};
    const auto asked = control(node_, VIDIOC_QUERYCAP, capability);
    const bool told = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
    const std::uint32_t can = told ? capability.device_caps : capability.capabilities;
    const bool captures = (can & V4L2_CAP_VIDEO_CAPTURE) != 0 && (can & V4L2_CAP_STREAMING) != 0;
    if (asked.done() && captures) return opened;
    node_.reset();
    return asked.done() ? failed_with(ENOTTY) : asked;
}

void CaptureDevice::close() {
    if (streaming_) static_cast<void>(stream(false));
    for (Mapping& mapping : mappings_) {
        if (mapping.address != nullptr) static_cast<void>(::munmap(mapping.address, mapping.bytes));
        mapping = {};
    }
    if (buffer_count_ > 0) static_cast<void>(request(0));
    buffer_count_ = 0;
    streaming_ = false;
    node_.reset();
}

std::optional<CaptureMode> CaptureDevice::ask_for(PixelLayout layout, int width_px, int height_px,
                                                  double rate_hz) {
    v4l2_format format{};
    format.type = kCapture;
    format.fmt.pix.width = static_cast<std::uint32_t>(width_px);
    format.fmt.pix.height = static_cast<std::uint32_t>(height_px);
    format.fmt.pix.pixelformat = kFourCharacters[static_cast<std::size_t>(layout)];
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (!control(node_, VIDIOC_S_FMT, format).done()) return std::nullopt;
    const v4l2_pix_format& got = format.fmt.pix;
    const auto at = std::ranges::find(kFourCharacters, got.pixelformat);
    if (at == kFourCharacters.end() || got.width > 16384 || got.height > 16384) return std::nullopt;
    CaptureMode mode;
    mode.layout = static_cast<PixelLayout>(at - kFourCharacters.begin());
    mode.width_px = static_cast<int>(got.width);
    mode.height_px = static_cast<int>(got.height);
    mode.most_frame_bytes = got.sizeimage;
    if (mode.layout != PixelLayout::kJpeg) {
        const std::uint32_t least = got.width * static_cast<std::uint32_t>(bytes_per_pixel(mode.layout));
        mode.row_bytes = std::max(got.bytesperline, least);
    }
    v4l2_streamparm rate{};
    rate.type = kCapture;
    rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000.0 * rate_hz))};
    if (control(node_, VIDIOC_S_PARM, rate).done()) mode.rate_hz = rate_of(rate.parm.capture.timeperframe);
    return mode;
}

SystemResult CaptureDevice::request(std::uint32_t count) {
    v4l2_requestbuffers wanted{};
    wanted.count = count;
    wanted.type = kCapture;
    wanted.memory = kMapped;
    const auto asked = control(node_, VIDIOC_REQBUFS, wanted);
    if (asked.done()) buffer_count_ = std::min(wanted.count, kBuffers);
    return asked;
}

SystemResult CaptureDevice::map(std::uint32_t index) {
    v4l2_buffer buffer = mapped_buffer(index);
    const auto asked = control(node_, VIDIOC_QUERYBUF, buffer);
    if (!asked.done()) return asked;
    const std::size_t bytes = buffer.length;
    if (bytes == 0) return failed_with(EINVAL);
    // Writable: some drivers refuse a mapping that is not, although nothing is ever written.
    const auto mapped = system_call([&] {
        void* address = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, node_.get(),
                               static_cast<off_t>(buffer.m.offset));
        if (address == MAP_FAILED) return -1;
        mappings_[index] = {address, bytes};
        return 0;
    });
    return mapped.done() ? give_back(index) : mapped;
}

SystemResult CaptureDevice::start() {
    const auto asked = request(kBuffers);
    if (!asked.done()) return asked;
    if (buffer_count_ < 3) return failed_with(ENOMEM);
    for (std::uint32_t i = 0; i < buffer_count_; ++i) {
        const auto mapped = map(i);
        if (!mapped.done()) return mapped;
    }
    const auto started = stream(true);
    streaming_ = started.done();
    return started;
}

SystemResult CaptureDevice::stream(bool on) {
    int type = kCapture;
    return control(node_, on ? VIDIOC_STREAMON : VIDIOC_STREAMOFF, type);
}

SystemResult CaptureDevice::wait(int timeout_ms) {
    pollfd watched{node_.get(), POLLIN, 0};
    const auto polled = system_call([&] { return ::poll(&watched, 1, timeout_ms); });
    if (polled.done() && polled.value > 0 && (watched.revents & POLLIN) == 0) return failed_with(ENODEV);
    return polled;
}

SystemResult CaptureDevice::take(FilledBuffer& buffer) {
    v4l2_buffer raw = mapped_buffer(0);
    auto taken = control(node_, VIDIOC_DQBUF, raw, {EAGAIN});
    if (!taken.done()) return taken;
    if (raw.index >= buffer_count_) return failed_with(EINVAL);
    const Mapping& mapping = mappings_[raw.index];
    buffer = {};
    buffer.index = raw.index;
    buffer.over_long = raw.bytesused > mapping.bytes;
    buffer.bytes = {static_cast<const std::uint8_t*>(mapping.address),
                    std::min<std::size_t>(raw.bytesused, mapping.bytes)};
    buffer.damaged = (raw.flags & V4L2_BUF_FLAG_ERROR) != 0;
    buffer.sequence = raw.sequence;
    if ((raw.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
        buffer.stamp_us = std::int64_t{raw.timestamp.tv_sec} * 1'000'000 + raw.timestamp.tv_usec;
    }
    buffer.stamp_at_start = (raw.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    return taken;
}

SystemResult CaptureDevice::give_back(std::uint32_t index) {
    v4l2_buffer buffer = mapped_buffer(index);
    return control(node_, VIDIOC_QBUF, buffer);
}

std::optional<ControlRange> CaptureDevice::range_of(std::uint32_t id) {
    v4l2_queryctrl query{};
    query.id = id;
    const bool there = control(node_, VIDIOC_QUERYCTRL, query).done() &&
                       (query.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) == 0;
    if (!there || query.minimum > query.maximum) return std::nullopt;
    return ControlRange{query.minimum, query.maximum, std::max(query.step, 1)};
}

SystemResult CaptureDevice::set_control(std::uint32_t id, std::int32_t value) {
    v4l2_control set{id, value};
    return control(node_, VIDIOC_S_CTRL, set);
}

}  // namespace rig::os
