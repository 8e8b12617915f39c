// Grey images on disk: PGM, PNG and JPEG in, PNG and PGM out. Not for video or colour.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/image/view.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// Rows without gaps; integers are pixel centres, origin at the top left.
struct GreyImage {
    int width_px = 0;
    int height_px = 0;
    std::vector<std::uint8_t> pixels;

    [[nodiscard]] ImageView view() const {
        return {
            .pixels = pixels.data(), .width_px = width_px, .height_px = height_px, .stride_bytes = width_px};
    }
};

inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1}
                                                << 26;  // 67 Mpx: beyond any camera, below any harm

// The format is told by the content, never by the name. Colour becomes grey, deeper pixels become 8 bit, a
// turn that EXIF asks for is not made: pixels stay where the sensor has them. Errors:
// missing, empty, not an image, cut short (also where decoders would fill in grey), more than
// kMaxImagePixels.
[[nodiscard]] Result<GreyImage, FileError> read_grey_image(const std::filesystem::path& path);
[[nodiscard]] Result<GreyImage, FileError> parse_grey_image(ByteSpan bytes,
                                                            const std::filesystem::path& name);

// .png or .pgm by the name; anything else is an error.
[[nodiscard]] Result<void, FileError> write_grey_image(const std::filesystem::path& path,
                                                       const ImageView& image);

// rgb: 3 bytes a pixel, red first, rows without gaps; .png only.
[[nodiscard]] Result<void, FileError> write_rgb_image(const std::filesystem::path& path, int width_px,
                                                      int height_px, const std::vector<std::uint8_t>& rgb);

// For pictures inside a page. jpeg quality: 1..100. rgba: 4 bytes a pixel, rows without gaps.
// Precondition: the image is not empty and has as many pixels as it says.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const GreyImage& image, int quality);
[[nodiscard]] std::vector<std::uint8_t> encode_rgba_png(int width_px, int height_px,
                                                        const std::vector<std::uint8_t>& rgba);

}  // namespace rig::host
