// Motion JPEG to grey without a heap: libjpeg as it comes allocates for every picture, so it gets a memory
// manager that hands out parts of one block and takes them all back when a picture is done.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace rig {

class JpegGrey {
  public:
    enum class Outcome : std::uint8_t {
        kDone,
        kCorrupt,    // cut off, damaged anywhere, progressive, or nothing that libjpeg reads
        kOtherSize,  // a sound header of another size: nothing was decoded
    };

    // For pictures of this size alone. Allocates; nothing after it does.
    JpegGrey(int width_px, int height_px);
    ~JpegGrey();
    JpegGrey(const JpegGrey&) = delete;
    JpegGrey& operator=(const JpegGrey&) = delete;

    // Baseline and extended sequential pictures, Huffman tables in the picture or the usual ones. `to` holds
    // width x height bytes; after kCorrupt its contents mean nothing. A warning of the decoder is damage: a
    // picture whose lower half is grey would move markers.
    [[nodiscard]] Outcome decode(std::span<const std::uint8_t> jpeg, std::span<std::uint8_t> to);

    // Most bytes of the block that a picture has taken, for tests and for the size of the block.
    [[nodiscard]] std::size_t peak_bytes() const;

  private:
    struct Decoder;
    std::unique_ptr<Decoder> decoder_;
};

}  // namespace rig
