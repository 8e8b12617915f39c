#include "core/detect/lobes.hpp"

#include <algorithm>

#include "core/detect/blob_shape.hpp"
#include "core/detect/detector.hpp"

namespace rig {

namespace {

constexpr double kWideRadius = 0.65;     // of an area that no marker is as wide as, in its sizes
constexpr double kThinRadius = 0.22;     // of a line that is thinner than most markers
constexpr double kRegrown = 0.1;         // of a lobe's root, into what it sticks out of; in sizes
constexpr double kLongest = 1.5;         // of a lobe, in sizes
constexpr double kLeastLength = 0.8;     // of what is completed from one
constexpr double kLeastArea = 0.25;      // of it, in squares of sizes
constexpr double kLeastLobed = 2.2;      // of what it sticks out of, with it: its length in sizes
constexpr double kLeastLobedArea = 1.0;  // in squares of them
constexpr double kLeastLobeEnds = 0.9;
constexpr double kLeastEnds = 1.2;  // of runs, in sizes, where the image falls off as at a marker's rim:
constexpr int kIntoPx = 3;          // from so far inside
constexpr int kBeyondPx = 2;        // to so far outside
constexpr double kLeastInkDepth = 0.74;
constexpr double kLeastRetroDepth = 0.45;
constexpr int kTile = static_cast<int>(kBlobWindowPx);
constexpr std::size_t kMostTiles = 400;  // of an image or one of its windows: hair is as large as the image

// Into the eight and the four neighbours by turns.
void grow(BitRows& rows, int steps, int height) {
    for (; steps > 1; steps -= 2) grow_octagon(rows, height);
    if (steps > 0) grow_square(rows, height);
}

// Where a disc of so many steps fits in, and `beyond` steps around that.
void open(const BitRows& area, int steps, int beyond, int width, int height, BitRows& opened) {
    const std::uint64_t mask = row_mask(width);
    const auto turn = [&] {
        for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) opened[y] = ~opened[y] & mask;
    };
    copy_rows(area, height, opened);
    turn();
    grow(opened, steps, height);
    turn();
    grow(opened, steps + beyond, height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) opened[y] &= mask;
}

int steps_of(double radius_px) {
    return static_cast<int>(radius_px + 0.5);
}

// Hands the connected pieces of `rest` on that have a mark and are short enough; the longer ones remain in
// it.
void gather_short(BitRows& rest, const BitRows& marks, int width, int height, double size_px, Lobes& lobes) {
    BitRows longer;
    const auto bottom = static_cast<std::size_t>(height);
    std::fill_n(longer.begin(), bottom, std::uint64_t{0});
    for (std::size_t y = 0; y < bottom; ++y) {
        for (std::uint64_t left = 0; (left = rest[y] & marks[y]) != 0;) {
            BitRows piece{};
            piece[y] = left & (~left + 1);
            flood(piece, rest, height);
            for (std::size_t k = 0; k < bottom; ++k) rest[k] &= ~piece[k];
            const BitBox box = box_of(piece, 0, height);
            if (count_bits(piece, box.top, box.bottom) < kLeastArea * size_px * size_px) continue;
            const bool cut = box.left == 0 || box.top == 0 || box.right == width || box.bottom == height;
            const double length = std::max(box.right - box.left, box.bottom - box.top);
            if (length > kLongest * size_px) {
                for (std::size_t k = 0; k < bottom; ++k) longer[k] |= piece[k];
            } else if (!cut && !lobes.push_back(piece)) {
                return;
            }
        }
    }
    copy_rows(longer, height, rest);
}

// Finds ends of runs at which the image falls off as at a marker's rim: beyond it is skin.
void find_steep_ends(const Detector::Search& search, std::span<const Run> runs, RunEnds& ends) {
    const bool dark = search.side == Side::kBelow;
    const double depth = (dark ? kLeastInkDepth : kLeastRetroDepth) * search.usual_depth;
    const int part = static_cast<int>(256.0 * (dark ? 1.0 - depth : 1.0 + depth));
    ends.clear();
    for (const Run& run : runs) {
        const std::uint8_t* pixels = search.image.row(run.y);
        const int into = std::min(kIntoPx, (run.end - run.begin - 1) / 2);
        const auto is_steep = [&](int inside, int outside) {
            if (outside < 0 || outside >= search.image.width_px) return false;
            return dark ? 256 * pixels[inside] <= part * pixels[outside]
                        : 256 * pixels[inside] >= part * pixels[outside];
        };
        if (is_steep(run.begin + into, run.begin - kBeyondPx) && !ends.push_back({run.begin, run.y})) return;
        const int last = run.end - 1;
        if (is_steep(last - into, last + kBeyondPx) && !ends.push_back({last, run.y})) return;
    }
}

bool is_in(const BitBox& box, double x, double y) {
    return x >= box.left && x < box.right && y >= box.top && y < box.bottom;
}

int count_in(const RunEnds& ends, const BitBox& box) {
    return static_cast<int>(
        std::count_if(ends.begin(), ends.end(), [&](const RunEnd& end) { return is_in(box, end.x, end.y); }));
}

void drop_out_of_reach(const ExpectedMarker& expected, double size_px, RunEnds& ends) {
    const auto x = static_cast<double>(expected.x_px);
    const auto y = static_cast<double>(expected.y_px);
    const double reach = static_cast<double>(std::min(expected.reach_px, kMaxReachPx)) + 0.6 * size_px;
    const BitBox box{static_cast<int>(x - reach), static_cast<int>(y - reach),
                     static_cast<int>(x + reach) + 1, static_cast<int>(y + reach) + 1};
    std::size_t kept = 0;
    for (const RunEnd& end : ends) {
        if (is_in(box, end.x, end.y)) ends[kept++] = end;
    }
    ends.resize(kept);
}

// Leaves those that are not of a marker that nothing is wrong with.
void drop_explained(std::span<const Blob> blobs, const BitBox& box, RunEnds& ends) {
    for (const Blob& blob : blobs) {
        if (ends.empty()) return;
        if (blob.badness > kSureBadness || !is_in(box, blob.x_px, blob.y_px)) continue;
        const double reach = 0.5 * blob.long_axis_px + kBeyondPx;
        std::size_t kept = 0;
        for (const RunEnd& end : ends) {
            const double dx = end.x - blob.x_px;
            const double dy = end.y - blob.y_px;
            if (dx * dx + dy * dy > reach * reach) ends[kept++] = end;
        }
        ends.resize(kept);
    }
}

}  // namespace

void find_lobes(const BitRows& area, const BitRows& marks, int width, int height, double size_px,
                Lobes& lobes) {
    lobes.clear();
    const auto bottom = static_cast<std::size_t>(height);
    BitRows opened;
    BitRows rest;
    open(area, steps_of(kWideRadius * size_px), 0, width, height, opened);
    for (std::size_t y = 0; y < bottom; ++y) rest[y] = area[y] & ~opened[y];
    gather_short(rest, marks, width, height, size_px, lobes);
    open(rest, steps_of(kThinRadius * size_px), 0, width, height, opened);
    for (std::size_t y = 0; y < bottom; ++y) rest[y] &= opened[y];
    gather_short(rest, marks, width, height, size_px, lobes);
}

// In tiles that overlap by more than a lobe is long; each lobe belongs to the tile that has its middle.
void Detector::examine_lobes(const Search& search, const Component& component, std::span<const Run> runs,
                             double most_sizes, SideResult& result) {
    const double size = search.usual_size_px;
    const int length = length_of(component);
    if (length < kLeastLobed * size || length > most_sizes * size ||
        component.area_px < kLeastLobedArea * size * size ||
        (search.expected != nullptr && is_met(*search.expected, result))) {
        return;
    }
    const BitBox box{std::max(search.left, component.left - 1), std::max(search.top, component.top - 1),
                     std::min(search.right, component.right + 2),
                     std::min(search.bottom, component.bottom + 2)};
    RunEnds ends;
    find_steep_ends(search, runs, ends);
    const int least_ends = static_cast<int>(kLeastEnds * size);
    if (static_cast<int>(ends.size()) < least_ends) return;
    if (search.expected != nullptr) drop_out_of_reach(*search.expected, size, ends);
    drop_explained(result.blobs.span(), box, ends);
    if (static_cast<int>(ends.size()) < least_ends) return;
    const int reach = std::min(kTile / 2 - 8, static_cast<int>(kLongest * size) + 2);
    // A tile ends where the next one's own part still has `reach` before it.
    const auto end_of = [&](int begin, int first, int last) {
        const int before = begin == first ? 0 : reach;
        return last - begin + before <= kTile ? last : begin + kTile - before - reach;
    };
    for (BitBox own = box; own.top < box.bottom; own.top = own.bottom) {
        own.bottom = end_of(own.top, box.top, box.bottom);
        for (own.left = box.left; own.left < box.right; own.left = own.right) {
            own.right = end_of(own.left, box.left, box.right);
            const BitBox tile{std::max(box.left, own.left - reach), std::max(box.top, own.top - reach),
                              std::min(box.right, own.right + reach),
                              std::min(box.bottom, own.bottom + reach)};
            if (count_in(ends, tile) >= least_ends) examine_tile(search, runs, ends, tile, own, result);
        }
    }
}

void Detector::examine_tile(const Search& search, std::span<const Run> runs, const RunEnds& ends,
                            const BitBox& tile, const BitBox& own, SideResult& result) {
    const double size = search.usual_size_px;
    const int width = tile.right - tile.left;
    const int height = tile.bottom - tile.top;
    BitRows area{};
    const auto above = [](const Run& run, int y) { return run.y < y; };
    int marked = 0;
    for (auto run = std::lower_bound(runs.begin(), runs.end(), tile.top, above);
         run != runs.end() && run->y < tile.bottom; ++run) {
        const int begin = std::max(0, run->begin - tile.left);
        const int end = std::min(width, run->end - tile.left);
        if (begin >= end) continue;
        area[static_cast<std::size_t>(run->y - tile.top)] |= bit_span(begin, end);
        marked += end - begin;
    }
    if (marked < kLeastArea * size * size || marked == width * height || result.tiles == kMostTiles) return;
    ++result.tiles;
    BitRows marks{};
    for (const RunEnd& end : ends) {
        if (is_in(tile, end.x, end.y)) {
            marks[static_cast<std::size_t>(end.y - tile.top)] |= std::uint64_t{1} << (end.x - tile.left);
        }
    }
    Lobes lobes;
    find_lobes(area, marks, width, height, size, lobes);
    for (const BitRows& lobe : lobes) {
        const BitBox box = box_of(lobe, 0, height);
        const int x = tile.left + (box.left + box.right) / 2;
        const int y = tile.top + (box.top + box.bottom) / 2;
        if (!is_in(own, x, y)) continue;
        const int by = 1 + steps_of(kRegrown * size);
        const BitBox about{tile.left + box.left - by, tile.top + box.top - by, tile.left + box.right + by,
                           tile.top + box.bottom + by};
        if (count_in(ends, about) < static_cast<int>(kLeastLobeEnds * size)) continue;
        examine_lobe(search, area, lobe, tile, result);
    }
}

void Detector::examine_lobe(const Search& search, const BitRows& area, const BitRows& lobe,
                            const BitBox& tile, SideResult& result) {
    Workspace& w = workspace_;
    const double size = search.usual_size_px;
    const int height = tile.bottom - tile.top;
    BitRows whole;
    BitRows rest;
    copy_rows(lobe, height, whole);
    grow(whole, steps_of(kRegrown * size), height);
    for (std::size_t row = 0; row < static_cast<std::size_t>(height); ++row) {
        whole[row] &= area[row];
        rest[row] = area[row] & ~whole[row];
    }
    std::array<Component, 2> parts;  // it, and what it sticks out of
    const std::span<Run> room(w.lobe_runs);
    if (!component_of(whole, height, tile.left, tile.top, room, parts[0])) return;
    const std::span<const Run> runs = members_of(parts[0], room);
    if (result.second_looks >= kMostSecondLooks || !has_core(search, runs)) return;
    if (!component_of(rest, height, tile.left, tile.top, room.subspan(parts[0].count), parts[1])) return;
    parts[1].first = parts[0].count;
    ++result.second_looks;
    BlobLimits limits = config_.blob;
    limits.usual_size_px = size;
    limits.usual_depth = search.usual_depth;
    limits.min_contrast = least_contrast(search.side);
    limits.is_lobe = true;
    const Blob blob = measure_blob(search.image, search.side, parts[0], runs, {parts, room}, limits, w.blob);
    ++result.report.candidates;
    if (!blob.completed || blob.long_axis_px < kLeastLength * limits.usual_size_px) return;
    if (!result.blobs.push_back(blob)) result.report.blobs_full = true;
}

}  // namespace rig
