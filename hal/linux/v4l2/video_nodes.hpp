// Which cameras are plugged in, told by what stays the same when they are plugged in again: the USB port and
// the serial number, never the number of the node. Without a heap, because a camera that comes back is looked
// for in a running daemon.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace rig {

// A zero-ended text in place.
template <std::size_t kBytes>
struct ShortText {
    std::array<char, kBytes> bytes{};

    [[nodiscard]] std::string_view view() const { return {bytes.data()}; }
    [[nodiscard]] const char* c_str() const { return bytes.data(); }
    void set(std::string_view text) {
        const std::size_t size = text.size() < kBytes ? text.size() : kBytes - 1;
        bytes = {};
        for (std::size_t i = 0; i < size; ++i) bytes[i] = text[i];
    }
};

struct VideoNode {
    ShortText<64> device;  // "/dev/video2"
    ShortText<64> name;    // as the driver calls it: "USB Camera: USB Camera"
    // Of the port, "usb-1-2.1" for port 1 of the hub in port 2 of bus 1; otherwise the device's own name,
    // "vivid.0"; of a node without a device its driver's name for it.
    ShortText<64> path;
    ShortText<64> serial;  // of the USB device; empty when it tells none
    int index = 0;         // of the nodes of one device: UVC cameras have a second one without pictures
    int usb_bus = 0;       // 0: not on USB
    int usb_mbps = 0;      // speed at which it was plugged in: 480, 5000, ...
};

inline constexpr int kMostVideoNodes = 64;

// Where the kernel shows itself; tests have a folder of their own.
struct DeviceTree {
    std::string sysfs = "/sys";
    std::string dev = "/dev";
};

// In the order of the nodes' numbers; as many as fit, up to kMostVideoNodes looked at.
[[nodiscard]] std::size_t list_video_nodes(const DeviceTree& tree, std::span<VideoNode> into);

// What a camera has to be. An empty part is not asked for.
struct CameraIdentity {
    std::string path;
    std::string serial;
};

enum class CameraMatch : std::uint8_t {
    kFound,
    kAbsent,
    kOther,  // on that path is a camera with another serial number, or the serial is on another path (F02)
    kAmbiguous,  // nothing was asked for and several are there
};

// Nodes of index 0 only. With neither path nor serial: the only camera, if there is one.
[[nodiscard]] CameraMatch find_camera(std::span<const VideoNode> nodes, const CameraIdentity& wanted,
                                      std::size_t& found);

}  // namespace rig
