#include "hal/linux/v4l2/jpeg_grey.hpp"

#include <csetjmp>
#include <cstdio>
#include <vector>
// After cstdio: it uses FILE without saying so.
#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>

#include "core/base/check.hpp"

namespace rig {

namespace {

// libjpeg-turbo's vector kernels read and write whole vectors: rows start at multiples of this and are padded
// to twice as much.
constexpr std::size_t kAlign = 32;

constexpr std::size_t rounded_up(std::size_t bytes, std::size_t to) {
    return (bytes + to - 1) / to * to;
}

}  // namespace

struct JpegGrey::Decoder {
    struct Memory {
        jpeg_memory_mgr calls{};  // first: libjpeg holds its address
        Decoder* owner = nullptr;
    };
    struct Errors {
        jpeg_error_mgr calls{};  // first, likewise
        std::jmp_buf back{};
    };

    Decoder(int width, int height) : width_px(width), height_px(height) {
        // What grows with the picture is a few rows of samples, at most 44 bytes a column with 16 rows of
        // blocks; tables take 12 KiB.
        block.resize(32 * 1024 + 64 * (static_cast<std::size_t>(width) + 64));
        info.err = jpeg_std_error(&errors.calls);
        errors.calls.error_exit = [](j_common_ptr common) {
            std::longjmp(reinterpret_cast<Errors*>(common->err)->back, 1);
        };
        errors.calls.output_message = [](j_common_ptr) {};
        errors.calls.emit_message = [](j_common_ptr common, int level) {
            if (level < 0) ++common->err->num_warnings;
        };
        if (setjmp(errors.back) != 0) RIG_CHECK(false);  // a libjpeg of another version than its header
        jpeg_create_decompress(&info);
        library_memory = info.mem;
        memory.calls = *library_memory;
        memory.owner = this;
        memory.calls.alloc_small = [](j_common_ptr common, int pool, std::size_t bytes) {
            return owner_of(common).take(common, pool, bytes);
        };
        memory.calls.alloc_large = memory.calls.alloc_small;
        memory.calls.alloc_sarray = [](j_common_ptr common, int pool, JDIMENSION samples, JDIMENSION rows) {
            const std::size_t bytes = rounded_up(samples * sizeof(JSAMPLE), 2 * kAlign);
            return owner_of(common).take_rows<JSAMPLE>(common, pool, bytes, rows);
        };
        memory.calls.alloc_barray = [](j_common_ptr common, int pool, JDIMENSION blocks, JDIMENSION rows) {
            return owner_of(common).take_rows<JBLOCK>(common, pool, blocks * sizeof(JBLOCK), rows);
        };
        // Whole pictures of coefficients: progressive files, which cameras do not send.
        memory.calls.request_virt_sarray = [](j_common_ptr common, int, boolean, JDIMENSION, JDIMENSION,
                                              JDIMENSION) -> jvirt_sarray_ptr {
            refuse(common);
            return nullptr;
        };
        memory.calls.request_virt_barray = [](j_common_ptr common, int, boolean, JDIMENSION, JDIMENSION,
                                              JDIMENSION) -> jvirt_barray_ptr {
            refuse(common);
            return nullptr;
        };
        memory.calls.realize_virt_arrays = [](j_common_ptr) {};
        memory.calls.free_pool = [](j_common_ptr common, int pool) {
            if (pool == JPOOL_IMAGE) owner_of(common).back_to_tables();
        };
        info.mem = &memory.calls;
    }
    ~Decoder() {
        info.mem = library_memory;
        jpeg_destroy_decompress(&info);
    }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;

    static Decoder& owner_of(j_common_ptr common) { return *reinterpret_cast<Memory*>(common->mem)->owner; }

    static void refuse(j_common_ptr common) {
        common->err->msg_code = JERR_OUT_OF_MEMORY;
        common->err->error_exit(common);
    }

    // Tables, which outlive a picture, from the front; what is a picture's own, from the back.
    void* take(j_common_ptr common, int pool, std::size_t bytes) {
        const std::size_t size = rounded_up(bytes, kAlign);
        if (size > block.size() - skew() - tables - picture) refuse(common);
        std::uint8_t* base = block.data() + skew();
        if (pool == JPOOL_PERMANENT) {
            tables += size;
            peak = std::max(peak, tables + picture);
            return base + tables - size;
        }
        picture += size;
        peak = std::max(peak, tables + picture);
        return base + rounded_down() - picture;
    }
    template <class Element>
    Element** take_rows(j_common_ptr common, int pool, std::size_t row_bytes, JDIMENSION rows) {
        auto** list = static_cast<Element**>(take(common, pool, rows * sizeof(Element*)));
        for (JDIMENSION r = 0; r < rows; ++r) list[r] = static_cast<Element*>(take(common, pool, row_bytes));
        return list;
    }
    void back_to_tables() { picture = 0; }

    [[nodiscard]] std::size_t skew() const {
        const auto address = reinterpret_cast<std::uintptr_t>(block.data());
        return rounded_up(address, kAlign) - address;
    }
    [[nodiscard]] std::size_t rounded_down() const { return (block.size() - skew()) / kAlign * kAlign; }

    // No object with a destructor lives here: errors of libjpeg jump back over it.
    Outcome decode(const std::uint8_t* bytes, std::size_t count, std::uint8_t* to) {
        errors.calls.num_warnings = 0;
        if (setjmp(errors.back) != 0) {
            jpeg_abort_decompress(&info);
            return Outcome::kCorrupt;
        }
        jpeg_mem_src(&info, bytes, static_cast<unsigned long>(count));
        static_cast<void>(jpeg_read_header(&info, TRUE));
        if (static_cast<int>(info.image_width) != width_px ||
            static_cast<int>(info.image_height) != height_px) {
            jpeg_abort_decompress(&info);
            return Outcome::kOtherSize;
        }
        info.out_color_space = JCS_GRAYSCALE;
        info.dct_method = JDCT_ISLOW;  // the same bits with and without vector instructions
        static_cast<void>(jpeg_start_decompress(&info));
        while (info.output_scanline < info.output_height) {
            JSAMPROW row = to + static_cast<std::size_t>(info.output_scanline) * info.output_width;
            if (jpeg_read_scanlines(&info, &row, 1) != 1) break;
        }
        static_cast<void>(jpeg_finish_decompress(&info));
        return errors.calls.num_warnings == 0 ? Outcome::kDone : Outcome::kCorrupt;
    }

    int width_px;
    int height_px;
    jpeg_decompress_struct info{};
    Errors errors;
    Memory memory;
    jpeg_memory_mgr* library_memory = nullptr;
    std::vector<std::uint8_t> block;
    std::size_t tables = 0;   // bytes from the front
    std::size_t picture = 0;  // bytes from the back
    std::size_t peak = 0;
};

JpegGrey::JpegGrey(int width_px, int height_px) : decoder_(std::make_unique<Decoder>(width_px, height_px)) {}

JpegGrey::~JpegGrey() = default;

JpegGrey::Outcome JpegGrey::decode(std::span<const std::uint8_t> jpeg, std::span<std::uint8_t> to) {
    RIG_CHECK(to.size() >=
              static_cast<std::size_t>(decoder_->width_px) * static_cast<std::size_t>(decoder_->height_px));
    if (jpeg.empty()) return Outcome::kCorrupt;
    return decoder_->decode(jpeg.data(), jpeg.size(), to.data());
}

std::size_t JpegGrey::peak_bytes() const {
    return decoder_->peak;
}

}  // namespace rig
