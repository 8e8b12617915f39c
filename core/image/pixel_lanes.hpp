// Sixteen pixels at a time as bytes, eight as 16-bit lanes, four as floats. The width is fixed, whatever the
// machine has, and every operation stands alone in its lane or adds integers, so the bits are those of a
// plain loop. A few operations that compilers do not find by themselves are spelt with x86's names where it
// is x86; elsewhere a vector expression gives the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rig {

inline constexpr int kPixelLanes = 8;

using PixelLanes = std::int16_t __attribute__((vector_size(16)));
using FourFloats = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));

inline constexpr int kByteLanes = 16;

using SixteenBytes = std::uint8_t __attribute__((vector_size(16)));
using SixteenChars = char __attribute__((vector_size(16)));  // as x86's operations have them
using EightSums = std::uint16_t __attribute__((vector_size(16)));

[[nodiscard]] inline PixelLanes all_lanes(int value) {
    return PixelLanes{} + static_cast<std::int16_t>(value);
}

[[nodiscard]] inline FourFloats all_four(float value) {
    return FourFloats{} + value;
}

[[nodiscard]] inline FourFloats load_floats(const float* from) {
    FourFloats four;
    std::memcpy(&four, from, sizeof(four));
    return four;
}

// `first`, `first` + 1, ... in the eight lanes.
[[nodiscard]] inline PixelLanes counting_lanes(int first) {
    return PixelLanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<std::int16_t>(first);
}

[[nodiscard]] inline SixteenBytes load_bytes(const std::uint8_t* from) {
    SixteenBytes bytes;
    std::memcpy(&bytes, from, sizeof(bytes));
    return bytes;
}

inline void store_bytes(SixteenBytes bytes, std::uint8_t* to) {
    std::memcpy(to, &bytes, sizeof(bytes));
}

// Of all sixteen.
[[nodiscard]] inline std::uint32_t sum_of_bytes(SixteenBytes bytes) {
#if defined(__SSE2__)
    const auto halves = __builtin_ia32_psadbw128(reinterpret_cast<SixteenChars>(bytes), SixteenChars{});
    return static_cast<std::uint32_t>(halves[0]) + static_cast<std::uint32_t>(halves[1]);
#else
    std::uint32_t sum = 0;
    for (int i = 0; i < kByteLanes; ++i) sum += bytes[i];
    return sum;
#endif
}

// The byte that `rank` others are no greater than; 0 <= rank < 16. Without branches that depend on them.
[[nodiscard]] inline std::uint8_t ranked_byte(SixteenBytes bytes, std::uint32_t rank) {
    std::uint32_t level = 0;
    for (std::uint32_t bit = 128; bit > 0; bit /= 2) {
        const SixteenBytes most = SixteenBytes{} + static_cast<std::uint8_t>(level + bit - 1);
        const SixteenBytes lesser = bytes < most ? bytes : most;
        const std::uint32_t within = sum_of_bytes(reinterpret_cast<SixteenBytes>(lesser == bytes) & 1);
        level += within <= rank ? bit : 0;
    }
    return static_cast<std::uint8_t>(level);
}

// Sums of neighbours: byte 2i + byte 2i + 1 in lane i.
[[nodiscard]] inline EightSums sums_of_pairs(SixteenBytes bytes) {
    const auto pairs = reinterpret_cast<EightSums>(bytes);
    return (pairs & 0xFF) + (pairs >> 8);
}

// One bit per byte of a word of bytes that are zero or odd, lowest address first.
[[nodiscard]] constexpr std::uint32_t packed_bytes(std::uint64_t word) {
    return static_cast<std::uint32_t>(((word & 0x0101010101010101ULL) * 0x0102040810204080ULL) >> 56);
}

// One bit for each byte of 0xFF, none for those of 0.
[[nodiscard]] inline std::uint32_t bits_of_bytes(SixteenBytes mask) {
#if defined(__SSE2__)
    return static_cast<std::uint32_t>(__builtin_ia32_pmovmskb128(reinterpret_cast<SixteenChars>(mask)));
#else
    std::uint64_t words[2];
    std::memcpy(words, &mask, sizeof(words));
    return packed_bytes(words[0]) | packed_bytes(words[1]) << 8;
#endif
}

// 0xFF in the bytes whose bit is set, lowest bit first; sixteen bits count.
[[nodiscard]] inline SixteenBytes bytes_of_bits(std::uint64_t bits) {
    using Words = std::uint64_t __attribute__((vector_size(16)));
    constexpr std::uint64_t kEachByte = 0x0101010101010101ULL;
    const Words spread{(bits & 0xFFU) * kEachByte, (bits >> 8 & 0xFFU) * kEachByte};
    const SixteenBytes weights{1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    return reinterpret_cast<SixteenBytes>((reinterpret_cast<SixteenBytes>(spread) & weights) == weights);
}

[[nodiscard]] inline bool any_bit(SixteenBytes bytes) {
    std::uint64_t words[2];
    std::memcpy(words, &bytes, sizeof(words));
    return (words[0] | words[1]) != 0;
}

// Spelt as interleaving with zeros, which every machine has as one instruction; a conversion of the vector
// would be taken apart into its lanes.
[[nodiscard]] inline PixelLanes load_pixels(const std::uint8_t* from, std::uint8_t turn) {
    std::uint64_t word = 0;
    std::memcpy(&word, from, sizeof(word));
    using Words = std::uint64_t __attribute__((vector_size(16)));
    const auto bytes = reinterpret_cast<SixteenBytes>(Words{word, 0});
    const SixteenBytes wide = __builtin_shufflevector(bytes, SixteenBytes{}, 0, 16, 1, 17, 2, 18, 3, 19, 4,
                                                      20, 5, 21, 6, 22, 7, 23);
    return reinterpret_cast<PixelLanes>(wide) ^ static_cast<std::int16_t>(turn);
}

// -1 in the lanes whose bit is set, lowest bit first.
[[nodiscard]] inline PixelLanes lanes_of_bits(std::uint64_t bits) {
    const PixelLanes weights{1, 2, 4, 8, 16, 32, 64, 128};
    return (all_lanes(static_cast<int>(bits & 0xFFU)) & weights) == weights;
}

// Lanes of -1 and 0 as bytes: those of `low`, then those of `high`.
[[nodiscard]] inline SixteenBytes bytes_of_masks(PixelLanes low, PixelLanes high) {
#if defined(__SSE2__)
    return reinterpret_cast<SixteenBytes>(__builtin_ia32_packsswb128(low, high));
#else
    const auto a = reinterpret_cast<SixteenBytes>(low);
    const auto b = reinterpret_cast<SixteenBytes>(high);
    return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
#endif
}

// Numbers of 0 to 255 as bytes: those of `low`, then those of `high`.
[[nodiscard]] inline SixteenBytes bytes_of_lanes(PixelLanes low, PixelLanes high) {
#if defined(__SSE2__)
    return reinterpret_cast<SixteenBytes>(__builtin_ia32_packuswb128(low, high));
#else
    const auto a = reinterpret_cast<SixteenBytes>(low);
    const auto b = reinterpret_cast<SixteenBytes>(high);
    return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
#endif
}

// Each of four bytes four times.
[[nodiscard]] inline SixteenBytes load_four_times_each(const std::uint8_t* from) {
    std::uint32_t word = 0;
    std::memcpy(&word, from, sizeof(word));
    using Words = std::uint32_t __attribute__((vector_size(16)));
    const auto four = reinterpret_cast<SixteenBytes>(Words{word, 0, 0, 0});
    const SixteenBytes twice =
        __builtin_shufflevector(four, four, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
    const auto pairs = reinterpret_cast<EightSums>(twice);
    return reinterpret_cast<SixteenBytes>(__builtin_shufflevector(pairs, pairs, 0, 0, 1, 1, 2, 2, 3, 3));
}

// One bit for each lane of -1, none for those of 0.
[[nodiscard]] inline std::uint64_t bits_of_lanes(PixelLanes mask) {
    return bits_of_bytes(bytes_of_masks(mask, PixelLanes{}));
}

struct EightFloats {
    FourFloats low;
    FourFloats high;
};

struct EightInts {
    FourInts low;
    FourInts high;
};

[[nodiscard]] inline EightInts ints_of_lanes(PixelLanes lanes) {
    const PixelLanes low = __builtin_shufflevector(lanes, lanes, 0, 0, 1, 1, 2, 2, 3, 3);
    const PixelLanes high = __builtin_shufflevector(lanes, lanes, 4, 4, 5, 5, 6, 6, 7, 7);
    return {reinterpret_cast<FourInts>(low) >> 16, reinterpret_cast<FourInts>(high) >> 16};
}

[[nodiscard]] inline EightFloats floats_of_lanes(PixelLanes lanes) {
    const EightInts whole = ints_of_lanes(lanes);
    return {__builtin_convertvector(whole.low, FourFloats), __builtin_convertvector(whole.high, FourFloats)};
}

// a > b ? a : b and a < b ? a : b, b also where one of them is no number.
[[nodiscard]] inline FourFloats greater_of(FourFloats a, FourFloats b) {
#if defined(__SSE2__)
    return __builtin_ia32_maxps(a, b);
#else
    return a > b ? a : b;
#endif
}
[[nodiscard]] inline FourFloats less_of(FourFloats a, FourFloats b) {
#if defined(__SSE2__)
    return __builtin_ia32_minps(a, b);
#else
    return a < b ? a : b;
#endif
}

// Correctly rounded, as scalar roots are.
[[nodiscard]] inline FourFloats roots_of(FourFloats v) {
#if defined(__SSE2__)
    return __builtin_ia32_sqrtps(v);
#else
    return FourFloats{__builtin_sqrtf(v[0]), __builtin_sqrtf(v[1]), __builtin_sqrtf(v[2]),
                      __builtin_sqrtf(v[3])};
#endif
}

// Whole numbers within 16 bits, as lanes.
[[nodiscard]] inline PixelLanes lanes_of_ints(const EightInts& v) {
#if defined(__SSE2__)
    return __builtin_ia32_packssdw128(v.low, v.high);
#else
    const auto low = reinterpret_cast<PixelLanes>(v.low);
    const auto high = reinterpret_cast<PixelLanes>(v.high);
    return __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
#endif
}

// Towards zero; |v| < 2^15.
[[nodiscard]] inline PixelLanes truncated_lanes(const EightFloats& v) {
    return lanes_of_ints(
        {__builtin_convertvector(v.low, FourInts), __builtin_convertvector(v.high, FourInts)});
}

// To nearest; |v| < 2^15.
[[nodiscard]] inline PixelLanes rounded_lanes(const EightFloats& v) {
    const auto nearest = [](FourFloats f) { return __builtin_convertvector(f + 32768.5F, FourInts) - 32768; };
    return lanes_of_ints({nearest(v.low), nearest(v.high)});
}

[[nodiscard]] inline int sum_of_ints(FourInts v) {
    const FourInts pairs = v + __builtin_shufflevector(v, v, 2, 3, 0, 1);
    return pairs[0] + pairs[1];
}

[[nodiscard]] inline int sum_of_lanes(PixelLanes lanes) {
    const auto both = reinterpret_cast<FourInts>(lanes);
    return sum_of_ints((both << 16 >> 16) + (both >> 16));
}

// a[2i] b[2i] + a[2i + 1] b[2i + 1] in 32 bits each.
[[nodiscard]] inline FourInts products_of_pairs(PixelLanes a, PixelLanes b) {
#if defined(__SSE2__)
    return __builtin_ia32_pmaddwd128(a, b);
#else
    const auto x = reinterpret_cast<FourInts>(a);
    const auto y = reinterpret_cast<FourInts>(b);
    return (x << 16 >> 16) * (y << 16 >> 16) + (x >> 16) * (y >> 16);
#endif
}

// Sum of a[i] b[i], each product in 32 bits.
[[nodiscard]] inline int sum_of_products(PixelLanes a, PixelLanes b) {
    return sum_of_ints(products_of_pairs(a, b));
}

}  // namespace rig
