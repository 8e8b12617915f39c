#include "hal/linux/v4l2/grey_conversion.hpp"

#include "core/base/check.hpp"

namespace rig {

std::string_view pixel_layout_name(PixelLayout layout) {
    switch (layout) {
        case PixelLayout::kGrey:
            return "GREY";
        case PixelLayout::kY16:
            return "Y16";
        case PixelLayout::kYuyv:
            return "YUYV";
        case PixelLayout::kJpeg:
            return "MJPEG";
    }
    return "?";
}

int bytes_per_pixel(PixelLayout layout) {
    if (layout == PixelLayout::kJpeg) return 0;
    return layout == PixelLayout::kGrey ? 1 : 2;
}

void convert_to_grey(PixelLayout layout, std::span<const std::uint8_t> from, std::ptrdiff_t stride_bytes,
                     int width_px, int height_px, std::span<std::uint8_t> to) {
    RIG_CHECK(layout == PixelLayout::kY16 || layout == PixelLayout::kYuyv);
    RIG_CHECK(width_px > 0 && height_px > 0 && stride_bytes >= 2 * width_px);
    const auto width = static_cast<std::size_t>(width_px);
    const auto stride = static_cast<std::size_t>(stride_bytes);
    const auto rows = static_cast<std::size_t>(height_px);
    RIG_CHECK(from.size() >= (rows - 1) * stride + 2 * width && to.size() >= rows * width);
    const std::size_t offset = layout == PixelLayout::kY16 ? 1 : 0;
    for (std::size_t y = 0; y < rows; ++y) {
        const std::uint8_t* source = from.data() + y * stride + offset;
        std::uint8_t* target = to.data() + y * width;
        for (std::size_t x = 0; x < width; ++x) target[x] = source[2 * x];
    }
}

}  // namespace rig
