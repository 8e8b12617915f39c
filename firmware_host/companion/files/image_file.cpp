#include "firmware_host/companion/files/image_file.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string_view>

#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kMaxEncodedBytes = std::size_t{1} << 30;  // OpenCV counts in int

// Decoders fill what a cut file lacks with grey or keep silent, so the container is walked before one is
// asked.
struct Extent {
    std::int64_t width_px = 0;
    std::int64_t height_px = 0;
    bool whole = false;
};

std::uint32_t big_endian(ByteSpan bytes, std::size_t offset, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value = value << 8 | load<std::uint8_t>(bytes, offset + i);
    return value;
}

std::string_view as_text(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Chunks: length, type, data, CRC; the last one is IEND.
Extent png_extent(ByteSpan bytes) {
    constexpr std::size_t kSignatureBytes = 8;
    constexpr std::size_t kChunkFrameBytes = 12;
    Extent extent;
    std::size_t at = kSignatureBytes;
    while (bytes.size() - at >= kChunkFrameBytes) {
        const std::size_t length = big_endian(bytes, at, 4);
        const std::string_view type = as_text(bytes.subspan(at + 4, 4));
        if (length > bytes.size() - at - kChunkFrameBytes) return extent;
        if (type == "IHDR" && length >= 8) {
            extent.width_px = big_endian(bytes, at + 8, 4);
            extent.height_px = big_endian(bytes, at + 12, 4);
        }
        if (type == "IEND") {
            extent.whole = true;
            return extent;
        }
        at += kChunkFrameBytes + length;
    }
    return extent;
}

bool is_jpeg_frame_header(int marker) {
    return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// Segments up to the first scan, then the end marker somewhere behind it (a thumbnail's is in front).
Extent jpeg_extent(ByteSpan bytes) {
    constexpr int kStartOfScan = 0xDA;
    Extent extent;
    std::size_t at = 2;
    while (bytes.size() - at >= 4) {
        if (load<std::uint8_t>(bytes, at) != 0xFF) return extent;
        const int marker = load<std::uint8_t>(bytes, at + 1);
        if (marker == 0xFF) {  // fill byte
            ++at;
            continue;
        }
        const std::size_t length = big_endian(bytes, at + 2, 2);
        if (length < 2 || length > bytes.size() - at - 2) return extent;
        if (is_jpeg_frame_header(marker) && length >= 7) {
            extent.height_px = big_endian(bytes, at + 5, 2);
            extent.width_px = big_endian(bytes, at + 7, 2);
        }
        at += 2 + length;
        if (marker == kStartOfScan) {
            extent.whole = as_text(bytes).find("\xFF\xD9", at) != std::string_view::npos;
            return extent;
        }
    }
    return extent;
}

// The next number of a PNM header, past blanks and comments. Empty at anything else.
std::optional<std::int64_t> take_pnm_number(std::string_view& rest) {
    while (!rest.empty() && (std::string_view{" \t\r\n"}.find(rest.front()) != std::string_view::npos ||
                             rest.front() == '#')) {
        const std::size_t skip = rest.front() == '#' ? rest.find('\n') : 0;
        if (skip == std::string_view::npos) return std::nullopt;
        rest.remove_prefix(skip + 1);
    }
    std::int32_t value = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc{} || value <= 0) return std::nullopt;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return value;
}

// P5 and P6: binary grey and colour. The text forms P2 and P3 are not read.
Extent pnm_extent(ByteSpan bytes) {
    const std::string_view text = as_text(bytes);
    std::string_view rest = text.substr(2);
    const auto width = take_pnm_number(rest);
    const auto height = width ? take_pnm_number(rest) : std::nullopt;
    const auto largest = height ? take_pnm_number(rest) : std::nullopt;
    if (!largest || rest.empty() || *largest > 65535) return {};
    rest.remove_prefix(1);  // the one blank in front of the pixels
    const std::uint64_t pixel_bytes = (text[1] == '6' ? 3U : 1U) * (*largest > 255 ? 2U : 1U);
    Extent extent{.width_px = *width, .height_px = *height, .whole = false};
    const auto pixel_count = static_cast<std::uint64_t>(*width) * static_cast<std::uint64_t>(*height);
    extent.whole = rest.size() / pixel_bytes >= pixel_count;
    return extent;
}

std::optional<Extent> container_extent(ByteSpan bytes) {
    const std::string_view text = as_text(bytes);
    if (text.starts_with("\x89PNG\r\n\x1A\n")) return png_extent(bytes);
    if (text.starts_with("\xFF\xD8\xFF")) return jpeg_extent(bytes);
    if (text.starts_with("P5") || text.starts_with("P6")) return pnm_extent(bytes);
    return std::nullopt;
}

Result<void, FileError> write_mat(const std::filesystem::path& path, const cv::Mat& image,
                                  const char* extension) {
    std::vector<std::uint8_t> encoded;
    try {
        if (!cv::imencode(extension, image, encoded))
            return file_failure(path, "the image could not be encoded");
    } catch (const cv::Exception& error) {
        return file_failure(path, std::string{"the image could not be encoded: "} + error.what());
    }
    return write_whole_file(path, std::as_bytes(std::span{encoded}));
}

}  // namespace

Result<GreyImage, FileError> parse_grey_image(ByteSpan bytes, const std::filesystem::path& name) {
    if (bytes.empty()) return file_failure(name, "the file is empty");
    const std::optional<Extent> extent = container_extent(bytes);
    if (!extent) return file_failure(name, "not an image that is read here (PGM, PNG or JPEG)");
    if (extent->width_px > kMaxImagePixels || extent->height_px > kMaxImagePixels ||
        extent->width_px * extent->height_px > kMaxImagePixels || bytes.size() > kMaxEncodedBytes) {
        return file_failure(
            name, fmt::format("the image is too large: {} x {} px", extent->width_px, extent->height_px));
    }
    if (!extent->whole) return file_failure(name, "the image is cut short or its header is malformed");
    cv::Mat image;
    try {
        const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                              const_cast<std::byte*>(bytes.data()));  // OpenCV has no const view
        image = cv::imdecode(encoded, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception& error) {
        return file_failure(name, std::string{"the image cannot be decoded: "} + error.what());
    }
    if (image.empty()) return file_failure(name, "the image cannot be decoded (its data is damaged)");
    if (image.cols != extent->width_px || image.rows != extent->height_px) {
        return file_failure(name, "the decoded image is not of the size that its header states");
    }
    GreyImage grey{.width_px = image.cols, .height_px = image.rows, .pixels = {}};
    for (int y = 0; y < image.rows; ++y) {
        grey.pixels.insert(grey.pixels.end(), image.ptr<std::uint8_t>(y),
                           image.ptr<std::uint8_t>(y) + image.cols);
    }
    return grey;
}

Result<GreyImage, FileError> read_grey_image(const std::filesystem::path& path) {
    const auto bytes = read_whole_file(path);
    if (!bytes) return failure(bytes.error());
    return parse_grey_image(*bytes, path);
}

Result<void, FileError> write_grey_image(const std::filesystem::path& path, const ImageView& image) {
    const std::string extension = path.extension().string();
    if (extension != ".png" && extension != ".pgm") return file_failure(path, "name it .png or .pgm");
    if (image.empty()) return file_failure(path, "there is no image to write");
    const cv::Mat mat(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                      static_cast<std::size_t>(image.stride_bytes));
    return write_mat(path, mat, extension.c_str());
}

Result<void, FileError> write_rgb_image(const std::filesystem::path& path, int width_px, int height_px,
                                        const std::vector<std::uint8_t>& rgb) {
    if (path.extension() != ".png") return file_failure(path, "name it .png");
    if (width_px <= 0 || height_px <= 0 ||
        rgb.size() != 3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {
        return file_failure(path, "there is no image to write");
    }
    const cv::Mat view(height_px, width_px, CV_8UC3, const_cast<std::uint8_t*>(rgb.data()));
    cv::Mat bgr;
    cv::cvtColor(view, bgr, cv::COLOR_RGB2BGR);
    return write_mat(path, bgr, ".png");
}

std::vector<std::uint8_t> encode_jpeg(const GreyImage& image, int quality) {
    RIG_CHECK(!image.view().empty() && quality >= 1 && quality <= 100);
    const cv::Mat mat(image.height_px, image.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(image.pixels.data()));
    std::vector<std::uint8_t> encoded;
    RIG_CHECK(cv::imencode(".jpg", mat, encoded, {cv::IMWRITE_JPEG_QUALITY, quality}));
    return encoded;
}

std::vector<std::uint8_t> encode_rgba_png(int width_px, int height_px,
                                          const std::vector<std::uint8_t>& rgba) {
    RIG_CHECK(width_px > 0 && height_px > 0 &&
              rgba.size() == 4 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
    const cv::Mat view(height_px, width_px, CV_8UC4, const_cast<std::uint8_t*>(rgba.data()));
    cv::Mat bgra;
    cv::cvtColor(view, bgra, cv::COLOR_RGBA2BGRA);
    std::vector<std::uint8_t> encoded;
    RIG_CHECK(cv::imencode(".png", bgra, encoded));
    return encoded;
}

}  // namespace rig::host
