#include "tests/contract/hal/fake_camera.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace rig::test {
namespace {

namespace fs = std::filesystem;

FakeVideoMachine* machine = nullptr;

constexpr std::uint32_t kPage = 4096;
constexpr std::array<std::uint32_t, kPixelLayouts> kFourCharacters{V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16,
                                                                   V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};

int refused(int error_number) {
    errno = error_number;
    return -1;
}

void write_text(const fs::path& file, const std::string& text) {
    std::ofstream(file) << text << "\n";
}

std::uint32_t row_bytes(const FakeSensor& sensor, PixelLayout layout) {
    const auto least = static_cast<std::uint32_t>(sensor.width_px * bytes_per_pixel(layout));
    return layout == PixelLayout::kJpeg ? 0 : std::max(sensor.row_bytes, least);
}

std::uint32_t frame_bytes(const FakeSensor& sensor, PixelLayout layout) {
    if (layout == PixelLayout::kJpeg)
        return static_cast<std::uint32_t>(4096 + 2 * sensor.width_px * sensor.height_px);
    return row_bytes(sensor, layout) * static_cast<std::uint32_t>(sensor.height_px);
}

}  // namespace

FakeVideoMachine::FakeVideoMachine(sim::ManualClock& clock) : clock_(clock) {
    fs::create_directories(folder_ / "sys/class/video4linux");
    fs::create_directories(folder_ / "dev");
    machine = this;
}

FakeVideoMachine::~FakeVideoMachine() {
    machine = nullptr;
}

FakeVideoMachine* FakeVideoMachine::current() {
    return machine;
}

DeviceTree FakeVideoMachine::tree() const {
    return {(folder_ / "sys").string(), (folder_ / "dev").string()};
}

void FakeVideoMachine::plug_in(int node, const std::string& port, const std::string& serial,
                               FakeSensor sensor, int usb_mbps) {
    const fs::path device = folder_.path() / "sys/devices/usb" / port;
    const fs::path interface = device / (port + ":1.0");
    const fs::path entry = folder_.path() / "sys/class/video4linux" / ("video" + std::to_string(node));
    fs::create_directories(interface);
    fs::create_directories(entry);
    if (!serial.empty()) write_text(device / "serial", serial);
    write_text(device / "busnum", port.substr(0, port.find('-')));
    write_text(device / "speed", std::to_string(usb_mbps));
    fs::create_directory_symlink(interface, entry / "device");
    write_text(entry / "name", "USB Camera: USB Camera");
    write_text(entry / "index", "0");
    std::ofstream(folder_ / ("dev/video" + std::to_string(node)));
    Node made;
    made.sensor = std::move(sensor);
    nodes_[node] = std::move(made);
}

void FakeVideoMachine::unplug(int node) {
    nodes_.at(node).present = false;
    const fs::path entry = folder_.path() / "sys/class/video4linux" / ("video" + std::to_string(node));
    fs::remove_all(fs::weakly_canonical(entry / "device").parent_path());
    fs::remove_all(entry);
    fs::remove(folder_ / ("dev/video" + std::to_string(node)));
}

void FakeVideoMachine::fail_call(std::uint64_t nth, int error_number) {
    calls_ = 0;
    failing_call_ = nth;
    failing_errno_ = error_number;
    failed_ = false;
}

bool FakeVideoMachine::fails_now(int& result) {
    if (calls_++ != failing_call_) return false;
    failed_ = true;
    failing_call_ = ~std::uint64_t{0};
    result = refused(failing_errno_);
    return true;
}

std::int32_t FakeVideoMachine::control(int node, std::uint32_t id) const {
    const auto& values = nodes_.at(node).values;
    const auto found = values.find(id);
    return found == values.end() ? -1 : found->second;
}

std::size_t FakeVideoMachine::queued(int node) const {
    return nodes_.at(node).queue.size();
}

bool FakeVideoMachine::open(const std::string& path, int& result) {
    const std::string folder = tree().dev + "/video";
    if (!path.starts_with(folder)) return false;
    if (fails_now(result)) return true;
    const int number = std::stoi(path.substr(folder.size()));
    const auto found = nodes_.find(number);
    if (found == nodes_.end() || !found->second.present) {
        result = refused(ENOENT);
        return true;
    }
    // The memory of the buffers, so that mmap() and munmap() are real.
    result = memfd_create("fake camera", MFD_CLOEXEC);
    opened_[result] = number;
    return true;
}

bool FakeVideoMachine::close(int descriptor) {
    const auto found = opened_.find(descriptor);
    if (found == opened_.end()) return false;
    Node& node = nodes_.at(found->second);
    if (node.holder == descriptor) {
        node.streaming = false;
        node.holder = -1;
        node.buffer_count = 0;
    }
    opened_.erase(found);
    return true;
}

void FakeVideoMachine::note_mapping(int descriptor, int change) {
    if (change < 0 || opened_.contains(descriptor)) mappings_ += change;
}

std::int64_t FakeVideoMachine::due_us(const Node& node, std::uint32_t frame) const {
    return node.started_us + static_cast<std::int64_t>((frame + 1) * 1e6 / node.sensor.rate_hz);
}

bool FakeVideoMachine::poll(int descriptor, short& events, int timeout_ms, int& result) {
    const auto found = opened_.find(descriptor);
    if (found == opened_.end()) return false;
    if (fails_now(result)) return true;
    Node& node = nodes_.at(found->second);
    result = 1;
    if (!node.present || !node.streaming || node.queue.empty()) {
        events = POLLERR | POLLHUP;
        return true;
    }
    while (node.sensor.fates[node.next_frame] == FrameFate::kLost) ++node.next_frame;
    const std::int64_t until_us = clock_.now_us() + std::int64_t{1000} * timeout_ms;
    const std::int64_t due = due_us(node, node.next_frame);
    if (node.next_frame >= node.sensor.frame_total || due > until_us) {
        clock_.advance_to_us(until_us);
        result = 0;
        events = 0;
        return true;
    }
    clock_.advance_to_us(due);
    events = POLLIN;
    return true;
}

bool FakeVideoMachine::ioctl(int descriptor, unsigned long request, void* argument, int& result) {
    const auto found = opened_.find(descriptor);
    if (found == opened_.end()) return false;
    if (fails_now(result)) return true;
    Node& node = nodes_.at(found->second);
    result = node.present ? answer(node, descriptor, request, argument) : refused(ENODEV);
    return true;
}

int FakeVideoMachine::set_format(Node& node, void* argument) const {
    auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
    const auto wanted = std::ranges::find(kFourCharacters, pix.pixelformat);
    const auto layout = static_cast<PixelLayout>(wanted - kFourCharacters.begin());
    const bool known = std::ranges::find(node.sensor.layouts, layout) != node.sensor.layouts.end();
    node.layout = known ? layout : node.sensor.layouts.front();  // drivers answer with what they have
    pix.pixelformat = kFourCharacters[static_cast<std::size_t>(node.layout)];
    pix.width = static_cast<std::uint32_t>(node.sensor.width_px);
    pix.height = static_cast<std::uint32_t>(node.sensor.height_px);
    pix.bytesperline = row_bytes(node.sensor, node.layout);
    pix.sizeimage = frame_bytes(node.sensor, node.layout);
    return 0;
}

int FakeVideoMachine::request_buffers(Node& node, int descriptor, void* argument) const {
    auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
    if (node.holder >= 0 && node.holder != descriptor) return refused(EBUSY);
    node.queue.clear();
    node.buffer_count = wanted.count = std::min(wanted.count, node.sensor.buffers);
    node.holder = wanted.count > 0 ? descriptor : -1;
    node.buffer_bytes = (frame_bytes(node.sensor, node.layout) + kPage - 1) / kPage * kPage;
    return ftruncate(descriptor, off_t{node.buffer_count} * node.buffer_bytes);
}

int FakeVideoMachine::take_buffer(Node& node, int descriptor, void* argument) {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    if (!node.streaming || node.queue.empty()) return refused(EINVAL);
    if (node.next_frame >= node.sensor.frame_total || due_us(node, node.next_frame) > clock_.now_us())
        return refused(EAGAIN);
    const std::uint32_t frame = node.next_frame++;
    const FrameFate fate = node.sensor.fates[frame];
    if (fate == FrameFate::kTransferError) return refused(EIO);
    const std::vector<std::uint8_t> bytes = node.sensor.picture(frame);
    buffer.index = node.queue.front();
    node.queue.erase(node.queue.begin());
    if (pwrite(descriptor, bytes.data(), std::min<std::size_t>(bytes.size(), node.buffer_bytes),
               off_t{buffer.index} * node.buffer_bytes) < 0)
        return -1;
    buffer.bytesused = static_cast<std::uint32_t>(bytes.size());
    if (fate == FrameFate::kShort) buffer.bytesused -= 1;
    if (fate == FrameFate::kEmpty) buffer.bytesused = 0;
    if (fate == FrameFate::kOverLong) buffer.bytesused = node.buffer_bytes + 1;
    buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    if (fate == FrameFate::kDamaged) buffer.flags |= V4L2_BUF_FLAG_ERROR;
    if (node.sensor.stamps_start) buffer.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    const std::int64_t stamp_us = due_us(node, frame) + node.sensor.first_stamp_us;
    buffer.timestamp = {stamp_us / 1'000'000, stamp_us % 1'000'000};
    buffer.sequence = node.sensor.first_sequence + frame;
    return 0;
}

int FakeVideoMachine::set_control(Node& node, void* argument) const {
    const auto& wanted = *static_cast<v4l2_control*>(argument);
    const auto found = node.sensor.controls.find(wanted.id);
    if (found == node.sensor.controls.end()) return refused(EINVAL);
    const auto [lowest, highest] = found->second;
    if (wanted.value < lowest || wanted.value > highest) return refused(ERANGE);
    node.values[wanted.id] = wanted.value;
    return 0;
}

int FakeVideoMachine::answer(Node& node, int descriptor, unsigned long request, void* argument) {
    switch (request) {
        case VIDIOC_QUERYCAP: {
            auto& capability = *static_cast<v4l2_capability*>(argument);
            capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
            capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
            return 0;
        }
        case VIDIOC_S_FMT:
            return set_format(node, argument);
        case VIDIOC_S_PARM: {
            if (!node.sensor.tells_rate) return refused(ENOTTY);
            const auto milli = static_cast<std::uint32_t>(1000.0 * node.sensor.rate_hz);
            static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1000, milli};
            return 0;
        }
        case VIDIOC_REQBUFS:
            return request_buffers(node, descriptor, argument);
        case VIDIOC_QUERYBUF: {
            auto& buffer = *static_cast<v4l2_buffer*>(argument);
            if (buffer.index >= node.buffer_count) return refused(EINVAL);
            buffer.length = node.buffer_bytes;
            buffer.m.offset = buffer.index * node.buffer_bytes;
            return 0;
        }
        case VIDIOC_QBUF: {
            const std::uint32_t index = static_cast<v4l2_buffer*>(argument)->index;
            const bool twice = std::ranges::find(node.queue, index) != node.queue.end();
            if (index >= node.buffer_count || twice) return refused(EINVAL);
            node.queue.push_back(index);
            return 0;
        }
        case VIDIOC_DQBUF:
            return take_buffer(node, descriptor, argument);
        case VIDIOC_STREAMON:
            node.streaming = true;
            node.started_us = clock_.now_us();
            node.next_frame = 0;
            return 0;
        case VIDIOC_STREAMOFF:
            node.streaming = false;
            node.queue.clear();
            return 0;
        case VIDIOC_QUERYCTRL: {
            auto& query = *static_cast<v4l2_queryctrl*>(argument);
            const auto found = node.sensor.controls.find(query.id);
            if (found == node.sensor.controls.end()) return refused(EINVAL);
            query.minimum = found->second.first;
            query.maximum = found->second.second;
            query.step = 1;
            return 0;
        }
        case VIDIOC_S_CTRL:
            return set_control(node, argument);
        default:
            return refused(ENOTTY);
    }
}

}  // namespace rig::test

// The names are the linker's: --wrap=open sends calls of open() to __wrap_open().
// NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {

int __real_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    int result = -1;
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr && machine->open(path, result)) return result;
    return __real_open(path, flags, mode);
}

int __real_close(int descriptor);
int __wrap_close(int descriptor);
int __wrap_close(int descriptor) {
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr) machine->close(descriptor);
    return __real_close(descriptor);
}

int __real_ioctl(int descriptor, unsigned long request, void* argument);
int __wrap_ioctl(int descriptor, unsigned long request, ...);
int __wrap_ioctl(int descriptor, unsigned long request, ...) {
    va_list rest;
    va_start(rest, request);
    void* argument = va_arg(rest, void*);
    va_end(rest);
    int result = -1;
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr && machine->ioctl(descriptor, request, argument, result)) return result;
    return __real_ioctl(descriptor, request, argument);
}

int __real_poll(pollfd* watched, nfds_t count, int timeout_ms);
int __wrap_poll(pollfd* watched, nfds_t count, int timeout_ms);
int __wrap_poll(pollfd* watched, nfds_t count, int timeout_ms) {
    int result = -1;
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr && count == 1 && machine->poll(watched->fd, watched->revents, timeout_ms, result))
        return result;
    return __real_poll(watched, count, timeout_ms);
}

void* __real_mmap(void* address, size_t bytes, int protection, int flags, int descriptor, off_t offset);
void* __wrap_mmap(void* address, size_t bytes, int protection, int flags, int descriptor, off_t offset);
void* __wrap_mmap(void* address, size_t bytes, int protection, int flags, int descriptor, off_t offset) {
    void* mapped = __real_mmap(address, bytes, protection, flags, descriptor, offset);
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr && mapped != MAP_FAILED) machine->note_mapping(descriptor, 1);
    return mapped;
}

int __real_munmap(void* address, size_t bytes);
int __wrap_munmap(void* address, size_t bytes);
int __wrap_munmap(void* address, size_t bytes) {
    auto* machine = rig::test::FakeVideoMachine::current();
    if (machine != nullptr) machine->note_mapping(-1, -1);
    return __real_munmap(address, bytes);
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)
