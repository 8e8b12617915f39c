#include "core/detect/bit_rows.hpp"

namespace rig {

int count_bits(const BitRows& rows, int height) {
    int count = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) count += ones(rows[y]);
    return count;
}

void grow_cross(BitRows& rows, int height) {
    std::uint64_t above = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        const std::uint64_t here = rows[y];
        const std::uint64_t below = y + 1 < static_cast<std::size_t>(height) ? rows[y + 1] : 0;
        rows[y] = here | here << 1 | here >> 1 | above | below;
        above = here;
    }
}

void grow_square(BitRows& rows, int height) {
    std::uint64_t above = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        const std::uint64_t here = rows[y];
        const std::uint64_t below = y + 1 < static_cast<std::size_t>(height) ? rows[y + 1] : 0;
        const std::uint64_t column = here | above | below;
        rows[y] = column | column << 1 | column >> 1;
        above = here;
    }
}

namespace {

// One sweep in the given order; true if anything was added.
template <bool kDiagonal>
bool sweep(BitRows& seed, const BitRows& allowed, int height, bool down) {
    std::uint64_t previous = 0;
    std::uint64_t changed = 0;
    for (int i = 0; i < height; ++i) {
        const auto y = static_cast<std::size_t>(down ? i : height - 1 - i);
        if ((seed[y] | previous) == 0) continue;
        std::uint64_t row = seed[y] | (kDiagonal ? previous | previous << 1 | previous >> 1 : previous);
        row &= allowed[y];
        for (std::uint64_t wider = row;; row = wider) {
            wider = (row | row << 1 | row >> 1) & allowed[y];
            if (wider == row) break;
        }
        changed |= row ^ seed[y];
        seed[y] = row;
        previous = row;
    }
    return changed != 0;
}

}  // namespace

void flood(BitRows& seed, const BitRows& allowed, int height) {
    for (bool down = true;; down = !down) {
        const bool changed = sweep<true>(seed, allowed, height, down);
        if (!changed && !down) break;
    }
}

void fill_holes(BitRows& rows, int width, int height) {
    std::uint64_t split = 0;  // rows that are one run each have none
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        split |= beyond_first_run(rows[y]);
    }
    if (split == 0) return;
    const std::uint64_t mask = row_mask(width);
    BitRows outside{};
    BitRows reached{};
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        outside[y] = ~rows[y] & mask;
        const bool rim = y == 0 || y + 1 == static_cast<std::size_t>(height);
        reached[y] = outside[y] & (rim ? mask : (std::uint64_t{1} | std::uint64_t{1} << (width - 1)));
    }
    for (bool down = true;; down = !down) {
        const bool changed = sweep<false>(reached, outside, height, down);
        if (!changed && !down) break;
    }
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) rows[y] = ~reached[y] & mask;
}

}  // namespace rig
