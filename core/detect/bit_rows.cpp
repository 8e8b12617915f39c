#include "core/detect/bit_rows.hpp"

#include <algorithm>
#include <cstring>

namespace rig {

namespace {

// Two rows at a time, in rows that have empty ones before and after them, so that no row is the first or the
// last. What grows over the window's border cannot come back as anything that would not be there without:
// steps reach as far when they go along the border.
using TwoRows = std::uint64_t __attribute__((vector_size(16)));

constexpr std::size_t kGuard = 2;

class GuardedRows {
  public:
    explicit GuardedRows(int height) : height_(static_cast<std::size_t>(height)) {
        std::fill_n(rows_.begin(), kGuard, std::uint64_t{0});
        std::fill_n(rows_.begin() + static_cast<std::ptrdiff_t>(kGuard + height_), kGuard + 2,
                    std::uint64_t{0});
    }
    GuardedRows(const BitRows& rows, int height) : GuardedRows(height) {
        for (int y = 0; y < height; y += 2) {
            TwoRows two;
            std::memcpy(&two, &rows[static_cast<std::size_t>(y)], sizeof(two));
            set(y, two);
        }
        clear_after_last();
    }
    // Rows y and y + 1; from kGuard before the first to kGuard after the last.
    [[nodiscard]] TwoRows at(int y) const {
        TwoRows two;
        std::memcpy(&two, &rows_[static_cast<std::size_t>(y + static_cast<int>(kGuard))], sizeof(two));
        return two;
    }
    void set(int y, TwoRows two) {
        std::memcpy(&rows_[static_cast<std::size_t>(y) + kGuard], &two, sizeof(two));
    }
    void clear_after_last() { rows_[kGuard + height_] = 0; }
    void copy_to(BitRows& rows) const {
        std::memcpy(rows.data(), &rows_[kGuard], height_ * sizeof(std::uint64_t));
    }

  private:
    std::array<std::uint64_t, kBlobWindowPx + 2 * kGuard + 2> rows_;
    std::size_t height_;
};

TwoRows cross_at(const GuardedRows& rows, int y) {
    const TwoRows here = rows.at(y);
    return rows.at(y - 1) | rows.at(y + 1) | here | here << 1 | here >> 1;
}

TwoRows square_at(const GuardedRows& rows, int y) {
    const TwoRows column = rows.at(y - 1) | rows.at(y) | rows.at(y + 1);
    return column | column << 1 | column >> 1;
}

TwoRows octagon_at(const GuardedRows& rows, int y) {
    const TwoRows near = rows.at(y - 1) | rows.at(y) | rows.at(y + 1);
    const TwoRows far = near | rows.at(y - 2) | rows.at(y + 2);
    return far | far << 1 | far >> 1 | near << 2 | near >> 2;
}

void store_rows(TwoRows two, int y, BitRows& rows) {
    std::memcpy(&rows[static_cast<std::size_t>(y)], &two, sizeof(two));
}

}  // namespace

int count_bits(const BitRows& rows, int top, int bottom) {
    int count = 0;
    for (int y = top; y < bottom; ++y) count += ones(rows[static_cast<std::size_t>(y)]);
    return count;
}

BitBox box_of(const BitRows& rows, int top, int bottom) {
    while (top < bottom && rows[static_cast<std::size_t>(top)] == 0) ++top;
    while (top < bottom && rows[static_cast<std::size_t>(bottom - 1)] == 0) --bottom;
    if (top == bottom) return {};
    std::uint64_t columns = 0;
    for (int y = top; y < bottom; ++y) columns |= rows[static_cast<std::size_t>(y)];
    return {std::countr_zero(columns), top, 64 - std::countl_zero(columns), bottom};
}

BitBox widened(const BitBox& box, int by, int width, int height) {
    return {std::max(0, box.left - by), std::max(0, box.top - by), std::min(width, box.right + by),
            std::min(height, box.bottom + by)};
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

void grow_octagon(BitRows& rows, int height) {
    const GuardedRows before(rows, height);
    for (int y = 0; y < height; y += 2) store_rows(octagon_at(before, y), y, rows);
}

void draw_surroundings(const BitRows& rows, int width, int height, BitRows& moat, BitRows& ring) {
    const TwoRows mask = TwoRows{} + row_mask(width);
    const GuardedRows set(rows, height);
    GuardedRows inner(height);
    GuardedRows middle(height);
    for (int y = 0; y < height; y += 2) inner.set(y, square_at(set, y));
    for (int y = 0; y < height; y += 2) {
        const TwoRows two = octagon_at(inner, y);
        middle.set(y, two);
        store_rows(two & ~inner.at(y) & mask, y, moat);
    }
    for (int y = 0; y < height; y += 2) {
        store_rows(octagon_at(middle, y) & ~middle.at(y) & mask, y, ring);
    }
}

void draw_moat(const BitRows& rows, int width, int height, BitRows& moat) {
    const TwoRows mask = TwoRows{} + row_mask(width);
    const GuardedRows set(rows, height);
    GuardedRows inner(height);
    for (int y = 0; y < height; y += 2) inner.set(y, square_at(set, y));
    for (int y = 0; y < height; y += 2) {
        store_rows(octagon_at(inner, y) & ~inner.at(y) & mask, y, moat);
    }
}

void share_out(const BitRows& own, BitRows& others, int steps, int width, int height) {
    const TwoRows mask = TwoRows{} + row_mask(width);
    GuardedRows mine[2] = {GuardedRows(own, height), GuardedRows(height)};
    GuardedRows theirs[2] = {GuardedRows(others, height), GuardedRows(height)};
    for (int step = 0; step < steps; ++step) {
        const int from = step % 2;
        GuardedRows& mine_next = mine[1 - from];
        GuardedRows& theirs_next = theirs[1 - from];
        const auto turn = [&](auto grown_at) {
            for (int y = 0; y < height; y += 2) {
                const TwoRows grown = grown_at(mine[from], y) & ~theirs[from].at(y) & mask;
                mine_next.set(y, grown);
                theirs_next.set(y, grown_at(theirs[from], y) & ~(mine[from].at(y) | grown) & mask);
            }
        };
        if (step % 2 == 0) {
            turn(cross_at);
        } else {
            turn(square_at);
        }
        mine_next.clear_after_last();  // of an odd height: nothing grows in from there
        theirs_next.clear_after_last();
    }
    theirs[steps % 2].copy_to(others);
}

bool is_one_stack(const BitRows& rows, int top, int bottom) {
    std::uint64_t before = ~std::uint64_t{0};
    std::uint64_t split = 0;
    for (int y = top; y < bottom; ++y) {
        const std::uint64_t row = rows[static_cast<std::size_t>(y)];
        split |= beyond_first_run(row);
        if ((row & (before | before << 1 | before >> 1)) == 0) return false;
        before = row;
    }
    return split == 0;
}

namespace {

// The runs of `allowed` that `some` of it touches, whole. Upwards by a carry through each run; downwards by
// doubled steps.
std::uint64_t whole_runs(std::uint64_t some, std::uint64_t allowed) {
    std::uint64_t row = (allowed & ~(allowed + some)) | some;
    if ((row >> 1 & allowed & ~row) == 0) return row;
    std::uint64_t way = allowed;
    for (int step = 1; step < 64; step *= 2) {
        row |= way & row >> step;
        way &= way >> step;
    }
    return row;
}

// One sweep in the given order; true if anything was added.
bool sweep(BitRows& seed, const BitRows& allowed, int first, int last, int step) {
    std::uint64_t previous = 0;
    std::uint64_t changed = 0;
    for (int y = first; y != last + step; y += step) {
        std::uint64_t& here = seed[static_cast<std::size_t>(y)];
        if ((here | previous) == 0) continue;
        const std::uint64_t may = allowed[static_cast<std::size_t>(y)];
        previous = whole_runs((here | previous | previous << 1 | previous >> 1) & may, may);
        changed |= previous ^ here;
        here = previous;
    }
    return changed != 0;
}

// Of the gaps between a row's bits, those that hang together with what is free in the row before are free
// too; true if there were any. open: what is not free yet.
bool open_gaps(const BitRows& rows, BitRows& gaps, int first, int last, int step, std::uint64_t& open) {
    std::uint64_t free = ~std::uint64_t{0};
    std::uint64_t changed = 0;
    open = 0;
    for (int y = first; y != last + step; y += step) {
        std::uint64_t& here = gaps[static_cast<std::size_t>(y)];
        if ((here & free) != 0) {
            const std::uint64_t freed = whole_runs(here & free, here);
            changed |= freed;
            here &= ~freed;
        }
        open |= here;
        free = ~(rows[static_cast<std::size_t>(y)] | here);
    }
    return changed != 0;
}

}  // namespace

void flood(BitRows& seed, const BitRows& allowed, int height) {
    flood(seed, allowed, 0, height);
}

void flood(BitRows& seed, const BitRows& allowed, int top, int bottom) {
    if (top >= bottom) return;
    bool again = sweep(seed, allowed, top, bottom - 1, 1);
    for (bool down = false;; down = !down) {
        again = down ? sweep(seed, allowed, top, bottom - 1, 1) : sweep(seed, allowed, bottom - 1, top, -1);
        if (!again) break;
    }
}

void fill_holes(BitRows& rows, int width, int height) {
    std::uint64_t split = 0;  // rows that are one run each have none
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        split |= beyond_first_run(rows[y]);
    }
    if (split == 0) return;
    // Left and right of its bits a row is free, as are rows on the rim; what lies between them is free when
    // it hangs together with that.
    const BitBox box = box_of(rows, 0, height);
    BitRows gaps;
    for (int y = box.top; y < box.bottom; ++y) {
        const std::uint64_t row = rows[static_cast<std::size_t>(y)];
        const bool rim = y == 0 || y + 1 == height;
        gaps[static_cast<std::size_t>(y)] =
            row == 0 || rim ? 0 : ~row & bit_span(std::countr_zero(row), 64 - std::countl_zero(row));
    }
    std::uint64_t open = 0;
    for (bool down = true;; down = !down) {
        const bool changed = down ? open_gaps(rows, gaps, box.top, box.bottom - 1, 1, open)
                                  : open_gaps(rows, gaps, box.bottom - 1, box.top, -1, open);
        if (open == 0 || (!changed && !down)) break;
    }
    if (open == 0) return;
    const std::uint64_t mask = row_mask(width);
    for (int y = box.top; y < box.bottom; ++y) {
        rows[static_cast<std::size_t>(y)] |= gaps[static_cast<std::size_t>(y)] & mask;
    }
}

}  // namespace rig
