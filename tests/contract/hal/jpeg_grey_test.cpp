// Pictures of an encoder come back as libjpeg itself decodes them, without the heap; damage is told.
#include "hal/linux/v4l2/jpeg_grey.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <vector>
// After cstdio: it uses FILE without saying so.
#include <jpeglib.h>

#include "firmware_host/daemon/heap_guard.hpp"
#include "tests/support/random.hpp"

namespace rig::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Encoding {
    int quality = 80;
    int restart_interval = 0;
    bool colour = true;
    bool progressive = false;
    bool optimal_tables = false;
    int chroma = 2;  // 4:2:2 or 4:2:0 by rows
};

// Soft blobs over a gradient, as grey or as YCbCr with coloured noise.
Bytes scene(int width, int height, int channels, SeededRandom& random) {
    Bytes pixels(static_cast<std::size_t>(width * height * channels));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < channels; ++c) {
                const double wave = 90.0 + 0.2 * x + ((x / 9 + y / 7) % 2 == 0 ? 60.0 : 0.0);
                pixels[static_cast<std::size_t>((y * width + x) * channels + c)] =
                    static_cast<std::uint8_t>(std::min(255.0, wave + random.uniform(0.0, 8.0)));
            }
        }
    }
    return pixels;
}

Bytes encoded(int width, int height, const Encoding& how, SeededRandom& random) {
    const int channels = how.colour ? 3 : 1;
    Bytes pixels = scene(width, height, channels, random);
    jpeg_compress_struct info{};
    jpeg_error_mgr errors{};
    info.err = jpeg_std_error(&errors);
    jpeg_create_compress(&info);
    unsigned char* out = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&info, &out, &size);
    info.image_width = static_cast<JDIMENSION>(width);
    info.image_height = static_cast<JDIMENSION>(height);
    info.input_components = channels;
    info.in_color_space = how.colour ? JCS_YCbCr : JCS_GRAYSCALE;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, how.quality, TRUE);
    if (how.colour) info.comp_info[0].h_samp_factor = 2;
    if (how.colour) info.comp_info[0].v_samp_factor = how.chroma;
    if (how.progressive) jpeg_simple_progression(&info);
    info.optimize_coding = how.optimal_tables ? TRUE : FALSE;
    info.restart_interval = static_cast<unsigned>(how.restart_interval);
    jpeg_start_compress(&info, TRUE);
    while (info.next_scanline < info.image_height) {
        JSAMPROW row = &pixels[info.next_scanline * static_cast<std::size_t>(width * channels)];
        jpeg_write_scanlines(&info, &row, 1);
    }
    jpeg_finish_compress(&info);
    jpeg_destroy_compress(&info);
    Bytes result(out, out + size);
    std::free(out);
    return result;
}

// libjpeg as it comes.
Bytes reference(const Bytes& jpeg) {
    jpeg_decompress_struct info{};
    jpeg_error_mgr errors{};
    info.err = jpeg_std_error(&errors);
    jpeg_create_decompress(&info);
    jpeg_mem_src(&info, jpeg.data(), static_cast<unsigned long>(jpeg.size()));
    jpeg_read_header(&info, TRUE);
    info.out_color_space = JCS_GRAYSCALE;
    info.dct_method = JDCT_ISLOW;
    jpeg_start_decompress(&info);
    Bytes pixels(std::size_t{info.output_width} * info.output_height);
    while (info.output_scanline < info.output_height) {
        JSAMPROW row = &pixels[std::size_t{info.output_scanline} * info.output_width];
        jpeg_read_scanlines(&info, &row, 1);
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    return pixels;
}

// Motion JPEG of many cameras leaves the usual Huffman tables out.
Bytes without_tables(Bytes jpeg) {
    for (std::size_t i = 2; i + 4 < jpeg.size() && jpeg[i] == 0xFF && jpeg[i + 1] != 0xDA;) {
        const std::size_t length = 2U + (std::size_t{jpeg[i + 2]} << 8 | jpeg[i + 3]);
        const auto at = jpeg.begin() + static_cast<std::ptrdiff_t>(i);
        if (jpeg[i + 1] == 0xC4) {
            jpeg.erase(at, at + static_cast<std::ptrdiff_t>(length));
        } else {
            i += length;
        }
    }
    return jpeg;
}

TEST(JpegGrey, DecodesAsTheLibraryDoesWithoutTheHeap) {
    SeededRandom random(20260);
    for (const auto& [width, height] : {std::pair{640, 480}, {8, 6}, {1, 1}, {1280, 800}, {333, 217}}) {
        JpegGrey decoder(width, height);
        Bytes pixels(static_cast<std::size_t>(width * height));
        for (const Encoding& how :
             {Encoding{}, Encoding{.quality = 100}, Encoding{.quality = 10, .chroma = 1},
              Encoding{.colour = false}, Encoding{.restart_interval = 4}, Encoding{.optimal_tables = true}}) {
            const Bytes jpeg = encoded(width, height, how, random);
            const Bytes expected = reference(jpeg);
            const std::uint32_t before = heap_calls_after_seal();
            seal_heap();
            const auto outcome = decoder.decode(jpeg, pixels);
            unseal_heap();
            EXPECT_EQ(heap_calls_after_seal(), before);
            ASSERT_EQ(outcome, JpegGrey::Outcome::kDone) << width << " x " << height;
            EXPECT_EQ(pixels, expected) << width << " x " << height << ", quality " << how.quality;
        }
    }
}

TEST(JpegGrey, TheUsualTablesMayBeLeftOut) {
    SeededRandom random(7);
    const Bytes whole = encoded(64, 48, {}, random);
    const Bytes bare = without_tables(whole);
    ASSERT_LT(bare.size(), whole.size());
    JpegGrey decoder(64, 48);
    Bytes pixels(64 * 48);
    ASSERT_EQ(decoder.decode(bare, pixels), JpegGrey::Outcome::kDone);
    EXPECT_EQ(pixels, reference(whole));
}

TEST(JpegGrey, AnotherSizeIsNotDecoded) {
    SeededRandom random(8);
    JpegGrey decoder(64, 48);
    Bytes pixels(64 * 48, 0x55);
    for (const auto& [width, height] : {std::pair{48, 64}, {64, 47}, {65, 48}, {4000, 4000}}) {
        EXPECT_EQ(decoder.decode(encoded(width, height, {}, random), pixels), JpegGrey::Outcome::kOtherSize);
    }
    EXPECT_EQ(pixels, Bytes(64 * 48, 0x55));
    Bytes bomb = encoded(64, 48, {}, random);
    for (std::size_t i = 0; i + 9 < bomb.size(); ++i) {
        if (bomb[i] == 0xFF && bomb[i + 1] == 0xC0)
            bomb[i + 5] = bomb[i + 6] = bomb[i + 7] = bomb[i + 8] = 0xFF;
    }
    EXPECT_NE(decoder.decode(bomb, pixels), JpegGrey::Outcome::kDone);
}

// Cut anywhere, and with any byte changed: an answer, never a crash; and a good picture after each is whole.
TEST(JpegGrey, DamageIsToldOrHarmless) {
    SeededRandom random(9);
    const Bytes good = encoded(64, 48, {}, random);
    const Bytes expected = reference(good);
    JpegGrey decoder(64, 48);
    Bytes pixels(64 * 48);
    for (std::size_t length = 0; length + 2 < good.size(); ++length) {
        const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length));
        ASSERT_EQ(decoder.decode(cut, pixels), JpegGrey::Outcome::kCorrupt) << "cut after " << length;
    }
    int told = 0;
    for (int round = 0; round < 4000; ++round) {
        Bytes bad = good;
        for (int i = 0; i < 3; ++i) {
            bad[random.below(bad.size())] = static_cast<std::uint8_t>(random.below(256));
        }
        told += decoder.decode(bad, pixels) != JpegGrey::Outcome::kDone ? 1 : 0;
        if (round % 100 == 0) {
            ASSERT_EQ(decoder.decode(good, pixels), JpegGrey::Outcome::kDone);
            ASSERT_EQ(pixels, expected);
        }
    }
    EXPECT_GT(told, 1000);
}

TEST(JpegGrey, ProgressivePicturesAreRefused) {
    SeededRandom random(10);
    JpegGrey decoder(64, 48);
    Bytes pixels(64 * 48);
    EXPECT_EQ(decoder.decode(encoded(64, 48, {.progressive = true}, random), pixels),
              JpegGrey::Outcome::kCorrupt);
    EXPECT_EQ(decoder.decode(encoded(64, 48, {}, random), pixels), JpegGrey::Outcome::kDone);
}

// Tall sampling factors take the most rows at once.
TEST(JpegGrey, TheBlockHoldsAnyWidthWithRoomToSpare) {
    SeededRandom random(11);
    for (const int width : {1, 64, 640, 1280, 1920, 4096}) {
        JpegGrey decoder(width, 40);
        Bytes pixels(static_cast<std::size_t>(width) * 40);
        for (const int chroma : {1, 2, 4}) {
            ASSERT_EQ(decoder.decode(encoded(width, 40, {.chroma = chroma}, random), pixels),
                      JpegGrey::Outcome::kDone)
                << width;
        }
        EXPECT_LT(decoder.peak_bytes(), 16 * 1024 + 60 * (static_cast<std::size_t>(width) + 64));
    }
}

}  // namespace
}  // namespace rig::test
