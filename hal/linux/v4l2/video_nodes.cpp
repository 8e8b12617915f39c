#include "hal/linux/v4l2/video_nodes.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>

#include "hal/linux/descriptor.hpp"
#include "hal/linux/system_call.hpp"

namespace rig {

namespace {

using Path = std::array<char, 512>;

template <class... Parts>
[[nodiscard]] bool join(Path& path, const char* format, Parts... parts) {
    const int length = std::snprintf(path.data(), path.size(), format, parts...);
    return length > 0 && static_cast<std::size_t>(length) < path.size();
}

// The first line of a file of sysfs, without its end; empty when there is none.
template <std::size_t kBytes>
void read_line(const Path& path, ShortText<kBytes>& into) {
    into.set({});
    const auto opened = os::system_call([&] { return ::open(path.data(), O_RDONLY | O_CLOEXEC); });
    if (!opened.done()) return;
    const os::Descriptor file(static_cast<int>(opened.value));
    std::array<char, kBytes> text{};
    const auto got = os::system_call([&] { return ::read(file.get(), text.data(), text.size() - 1); });
    if (!got.done()) return;
    const std::string_view all(text.data(), static_cast<std::size_t>(got.value));
    into.set(all.substr(0, all.find('\n')));
}

int read_number(const Path& path) {
    ShortText<16> text;
    read_line(path, text);
    int number = 0;
    std::from_chars(text.view().data(), text.view().data() + text.view().size(), number);
    return number;
}

// The last part of what a link points at.
[[nodiscard]] bool link_target(const Path& path, Path& target) {
    target = {};
    const auto got =
        os::system_call([&] { return ::readlink(path.data(), target.data(), target.size() - 1); });
    return got.done() && got.value > 0;
}

std::string_view last_part(std::string_view path) {
    return path.substr(path.find_last_of('/') + 1);
}

// A USB interface is "1-2.1:1.0", its device "1-2.1".
std::string_view usb_device_of(std::string_view interface) {
    const std::size_t colon = interface.find(':');
    const bool looks_right = colon != std::string_view::npos && interface.find('-') < colon;
    return looks_right ? interface.substr(0, colon) : std::string_view{};
}

bool describe(const DeviceTree& tree, int number, VideoNode& node) {
    node = {};
    Path path{};
    Path target{};
    const char* sysfs = tree.sysfs.c_str();
    if (!join(path, "%s/class/video4linux/video%d/name", sysfs, number)) return false;
    read_line(path, node.name);
    if (node.name.view().empty()) return false;
    if (!join(path, "%s/video%d", tree.dev.c_str(), number)) return false;
    node.device.set(path.data());
    static_cast<void>(join(path, "%s/class/video4linux/video%d/index", sysfs, number));
    node.index = read_number(path);
    const bool has_device =
        join(path, "%s/class/video4linux/video%d/device", sysfs, number) && link_target(path, target);
    if (!has_device) {
        node.path.set(node.name.view());
        return true;
    }
    const std::string_view owner = last_part(target.data());
    const std::string_view usb = usb_device_of(owner);
    if (usb.empty()) {
        node.path.set(owner);
        return true;
    }
    std::array<char, 64> port{};
    std::snprintf(port.data(), port.size(), "usb-%.*s", static_cast<int>(usb.size()), usb.data());
    node.path.set(port.data());
    const auto of_device = [&](const char* file) {
        return join(path, "%s/class/video4linux/video%d/device/../%s", sysfs, number, file);
    };
    if (of_device("serial")) read_line(path, node.serial);
    if (of_device("busnum")) node.usb_bus = read_number(path);
    if (of_device("speed")) node.usb_mbps = read_number(path);
    return true;
}

}  // namespace

std::size_t list_video_nodes(const DeviceTree& tree, std::span<VideoNode> into) {
    std::size_t count = 0;
    for (int number = 0; number < kMostVideoNodes && count < into.size(); ++number) {
        if (describe(tree, number, into[count])) ++count;
    }
    return count;
}

CameraMatch find_camera(std::span<const VideoNode> nodes, const CameraIdentity& wanted, std::size_t& found) {
    std::size_t matches = 0;
    bool half = false;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].index != 0) continue;
        const bool path = wanted.path.empty() || nodes[i].path.view() == wanted.path;
        const bool serial = wanted.serial.empty() || nodes[i].serial.view() == wanted.serial;
        half = half || path || serial;
        if (!path || !serial) continue;
        if (matches++ == 0) found = i;
    }
    if (matches == 1) return CameraMatch::kFound;
    if (matches > 1) return CameraMatch::kAmbiguous;
    const bool both = !wanted.path.empty() && !wanted.serial.empty();
    return half && both ? CameraMatch::kOther : CameraMatch::kAbsent;
}

}  // namespace rig
