// A window of up to 64 x 64 pixels as one machine word a row: growth, shrinking and flooding by shifts.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/limits.hpp"

namespace rig {

static_assert(kBlobWindowPx == 64);

using BitRows = std::array<std::uint64_t, kBlobWindowPx>;

// Pixel x of a row is bit x; pixels outside the window do not exist, so callers cut with their window's row
// mask.
[[nodiscard]] inline std::uint64_t row_mask(int width) {
    return width >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1;
}

[[nodiscard]] inline std::uint64_t bit_span(int begin, int end) {
    return row_mask(end) & ~row_mask(begin);
}

// Not std::popcount: without the instruction, which not every target has, that is a library call.
[[nodiscard]] constexpr int ones(std::uint64_t bits) {
    bits -= bits >> 1 & 0x5555555555555555ULL;
    bits = (bits & 0x3333333333333333ULL) + (bits >> 2 & 0x3333333333333333ULL);
    bits = (bits + (bits >> 4)) & 0x0F0F0F0F0F0F0F0FULL;
    return static_cast<int>((bits * 0x0101010101010101ULL) >> 56);
}

// Bits beyond the first run of a row; 0 for a row that is one run, or empty.
[[nodiscard]] inline std::uint64_t beyond_first_run(std::uint64_t row) {
    return row & (row + (row & (~row + 1)));
}

[[nodiscard]] int count_bits(const BitRows& rows, int top, int bottom);

// The first `height` rows; without a library's call for so few bytes.
inline void copy_rows(const BitRows& from, int height, BitRows& to) {
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) to[y] = from[y];
}

// Rows [top, bottom), columns [left, right).
struct BitBox {
    int left = 0;
    int top = 0;
    int right = 0;
    int bottom = 0;
};

// The least box around the bits from row `top` to `bottom` (exclusive); all zero without any.
[[nodiscard]] BitBox box_of(const BitRows& rows, int top, int bottom);

// By so many pixels on every side, as far as the window goes.
[[nodiscard]] BitBox widened(const BitBox& box, int by, int width, int height);

// One step into the four (eight) neighbours.
void grow_cross(BitRows& rows, int height);
void grow_square(BitRows& rows, int height);

// Into the eight neighbours and then into the four of each: a step of an octagon, nearly a disc of radius 2.
void grow_octagon(BitRows& rows, int height);

// moat: from one step outside the set to one octagon farther; ring: the next octagon. Rows and columns that
// the window does not have are left out.
void draw_surroundings(const BitRows& rows, int width, int height, BitRows& moat, BitRows& ring);
void draw_moat(const BitRows& rows, int width, int height, BitRows& moat);

// `own` and `others` grow towards each other, `steps` steps into the four and the eight neighbours by turns:
// what one has first the other does not get; what both reach at once is in `own` only. others: what they have
// at the end.
void share_out(const BitRows& own, BitRows& others, int steps, int width, int height);

// True if every row from top to bottom (exclusive) is one run that touches the row before: then the set is
// connected and has no holes.
[[nodiscard]] bool is_one_stack(const BitRows& rows, int top, int bottom);

// Keeps the part of `allowed` that is connected (eight neighbours) with `seed`; the result is in `seed`.
void flood(BitRows& seed, const BitRows& allowed, int height);
// The same among the rows from top to bottom (exclusive).
void flood(BitRows& seed, const BitRows& allowed, int top, int bottom);

// Fills every hole of `rows`: pixels that four-connected steps outside the set cannot reach from the border.
void fill_holes(BitRows& rows, int width, int height);

}  // namespace rig
