// Whether cameras fit on their USB buses, before any of them streams: the kernel refuses the last one with a
// bare "no space", in whichever order they start.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hal/linux/v4l2/grey_conversion.hpp"

namespace rig {

struct CameraLoad {
    std::string_view name;
    int usb_bus = 0;   // 0: not on USB, never in the way
    int usb_mbps = 0;  // 12, 480, 5000, ... as the kernel tells
    PixelLayout layout = PixelLayout::kGrey;
    int width_px = 0;
    int height_px = 0;
    double rate_hz = 0.0;
};

// Bytes a second that a camera asks its bus to keep free. JPEG is taken at a quarter of a byte a pixel and
// three times that in reserve: cameras reserve for their worst picture.
[[nodiscard]] double reserved_bytes_per_s(const CameraLoad& load);

// What isochronous transfers get at most. One endpoint of a high-speed device: 3 x 1024 bytes in each of 8000
// microframes a second (USB 2.0, 5.6.3); all of a bus: 5 such packets (80 % of 7; 5.6.4, table 5-5).
[[nodiscard]] double endpoint_bytes_per_s(int usb_mbps);
[[nodiscard]] double bus_bytes_per_s(int usb_mbps);

// One sentence with the sums of the first endpoint or bus that is too narrow, and the remedy; none when all
// fit. Devices of different speeds on one controller have buses of their own.
[[nodiscard]] std::optional<std::string> bandwidth_fault(std::span<const CameraLoad> loads);

}  // namespace rig
