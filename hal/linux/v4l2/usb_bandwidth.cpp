#include "hal/linux/v4l2/usb_bandwidth.hpp"

#include <array>
#include <cstdio>
#include <utility>

namespace rig {

namespace {

constexpr double kJpegBytesPerPixel = 0.25 * 3.0;
constexpr double kUvcOverhead = 1.02;  // 12 bytes of header in each packet of up to 1024
constexpr double kMega = 1e6;

struct UsbSpeed {
    int mbps;
    double endpoint_bytes_per_s;
    double bus_bytes_per_s;
};

// Full speed: 1023 bytes a frame. High speed: of the 7 packets of 1024 bytes that fit into a microframe
// (USB 2.0, table 5-5) 80 % may be periodic (5.6.4): 5 whole ones. SuperSpeed: 48 packets of 1024 bytes in a
// bus interval of 125 us for one endpoint (USB 3.2, 8.12.6), nine tenths of the link for all; faster ones
// likewise.
constexpr std::array kSpeeds{
    UsbSpeed{12, 1023.0 * 1000.0, 1023.0 * 1000.0}, UsbSpeed{480, 3072.0 * 8000.0, 5120.0 * 8000.0},
    UsbSpeed{5000, 49152.0 * 8000.0, 0.9 * 500e6}, UsbSpeed{10000, 98304.0 * 8000.0, 0.9 * 1200e6}};

const UsbSpeed& speed_of(int usb_mbps) {
    const UsbSpeed* best = kSpeeds.data();
    for (const UsbSpeed& speed : kSpeeds) {
        if (speed.mbps <= usb_mbps) best = &speed;
    }
    return *best;
}

std::string sentence(std::string_view subject, const char* verb, double asked, double free) {
    std::array<char, 400> text{};
    std::snprintf(text.data(), text.size(),
                  "%.*s %s %.1f MB/s where %.1f MB/s fit: lower the rate or the size, use MJPEG, or plug a "
                  "camera into another controller",
                  static_cast<int>(subject.size()), subject.data(), verb, asked / kMega, free / kMega);
    return text.data();
}

}  // namespace

double reserved_bytes_per_s(const CameraLoad& load) {
    const double pixels = static_cast<double>(load.width_px) * load.height_px;
    const bool compressed = load.layout == PixelLayout::kJpeg;
    const double bytes = compressed ? kJpegBytesPerPixel : static_cast<double>(bytes_per_pixel(load.layout));
    return pixels * bytes * load.rate_hz * kUvcOverhead;
}

double endpoint_bytes_per_s(int usb_mbps) {
    return speed_of(usb_mbps).endpoint_bytes_per_s;
}

double bus_bytes_per_s(int usb_mbps) {
    return speed_of(usb_mbps).bus_bytes_per_s;
}

std::optional<std::string> bandwidth_fault(std::span<const CameraLoad> loads) {
    for (const CameraLoad& load : loads) {
        const double asked = reserved_bytes_per_s(load);
        if (load.usb_bus != 0 && asked > endpoint_bytes_per_s(load.usb_mbps))
            return sentence(load.name, "needs", asked, endpoint_bytes_per_s(load.usb_mbps));
    }
    for (const CameraLoad& first : loads) {
        if (first.usb_bus == 0) continue;
        double asked = 0.0;
        std::string names;
        for (const CameraLoad& load : loads) {
            if (load.usb_bus != first.usb_bus) continue;
            asked += reserved_bytes_per_s(load);
            names += (names.empty() ? "" : " and ") + std::string(load.name);
        }
        const double free = bus_bytes_per_s(first.usb_mbps);
        if (asked > free) {
            return sentence(names + " on USB bus " + std::to_string(first.usb_bus), "need", asked, free);
        }
    }
    return std::nullopt;
}

}  // namespace rig
