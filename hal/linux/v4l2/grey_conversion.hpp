// From what cameras send to 8-bit grey.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace rig {

// In the order in which a camera's modes are preferred: the first needs no work at all.
enum class PixelLayout : std::uint8_t {
    kGrey,  // V4L2_PIX_FMT_GREY
    kY16,   // 16 bits, little-endian; the high byte counts
    kYuyv,  // 4:2:2, luma in every second byte
    kJpeg,  // Motion JPEG, one picture a frame
};
inline constexpr std::size_t kPixelLayouts = 4;

// "GREY", "Y16", "YUYV", "MJPEG"
[[nodiscard]] std::string_view pixel_layout_name(PixelLayout layout);

// Bytes of a pixel on the wire; 0 for JPEG, whose pictures differ in length.
[[nodiscard]] int bytes_per_pixel(PixelLayout layout);

// Rows of kY16 or kYuyv to grey. Preconditions: from holds `stride_bytes` x height_px bytes, the last row
// may lack what lies behind its pixels; to holds width_px x height_px.
void convert_to_grey(PixelLayout layout, std::span<const std::uint8_t> from, std::ptrdiff_t stride_bytes,
                     int width_px, int height_px, std::span<std::uint8_t> to);

}  // namespace rig
