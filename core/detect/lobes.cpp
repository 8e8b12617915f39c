#include "core/detect/lobes.hpp"

#include <algorithm>

#include "core/detect/blob_shape.hpp"
#include "core/detect/detector.hpp"

namespace rig {

namespace {

constexpr double kWideRadius = 0.65;  // of an area that no marker is as wide as, in its sizes
constexpr double kThinRadius = 0.22;  // of a line that is thinner than most markers
constexpr double kRegrown = 0.1;      // of a lobe's root, into what it sticks out of; in sizes
constexpr double kLongest = 1.5;      // of a lobe, in sizes
constexpr double kLeastLength = 0.8;  // of what is completed from one
constexpr double kLeastArea = 0.25;   // of it, in squares of sizes
constexpr int kTile = static_cast<int>(kBlobWindowPx);
constexpr std::size_t kMostTiles = 400;  // of an image or one of its windows: hair is as large as the image

void grow(BitRows& rows, int steps, int height) {
    for (int step = 0; step < steps; ++step)
        step % 2 == 0 ? grow_square(rows, height) : grow_cross(rows, height);
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

// Hands the connected pieces of `rest` on that are short enough; the longer ones remain in it.
void gather_short(BitRows& rest, int width, int height, double size_px, Lobes& lobes) {
    BitRows longer{};
    const auto bottom = static_cast<std::size_t>(height);
    for (std::size_t y = 0; y < bottom; ++y) {
        while (rest[y] != 0) {
            BitRows piece{};
            piece[y] = rest[y] & (~rest[y] + 1);
            flood(piece, rest, height);
            for (std::size_t k = y; k < bottom; ++k) rest[k] &= ~piece[k];
            const BitBox box = box_of(piece, static_cast<int>(y), height);
            if (count_bits(piece, box.top, box.bottom) < kLeastArea * size_px * size_px) continue;
            const bool cut = box.left == 0 || box.top == 0 || box.right == width || box.bottom == height;
            const double length = std::max(box.right - box.left, box.bottom - box.top);
            if (length > kLongest * size_px) {
                for (std::size_t k = y; k < bottom; ++k) longer[k] |= piece[k];
            } else if (!cut && !lobes.push_back(piece)) {
                return;
            }
        }
    }
    rest = longer;
}

}  // namespace

void find_lobes(const BitRows& area, int width, int height, double size_px, Lobes& lobes) {
    lobes.clear();
    BitRows opened{};
    BitRows rest{};
    open(area, steps_of(kWideRadius * size_px), 0, width, height, opened);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) rest[y] = area[y] & ~opened[y];
    gather_short(rest, width, height, size_px, lobes);
    const int thin = steps_of(kThinRadius * size_px);
    open(rest, thin, 0, width, height, opened);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) rest[y] &= opened[y];
    gather_short(rest, width, height, size_px, lobes);
}

// In tiles that overlap by more than a lobe is long; each lobe belongs to the tile that has its middle.
void Detector::examine_lobes(const Search& search, const Component& component, std::span<const Run> runs,
                             SideResult& result) {
    const double size = search.usual_size_px;
    const int overlap = std::min(kTile / 2 - 8, static_cast<int>(kLongest * size) + 2);
    const int step = kTile - 2 * overlap;
    for (int top = component.top - overlap; top + overlap <= component.bottom; top += step) {
        for (int left = component.left - overlap; left + overlap <= component.right; left += step) {
            examine_tile(search, runs, left, top, overlap, result);
        }
    }
}

void Detector::examine_tile(const Search& search, std::span<const Run> runs, int left, int top, int overlap,
                            SideResult& result) {
    Workspace& w = workspace_;
    const double size = search.usual_size_px;
    const BitBox own{left + overlap, top + overlap, left + kTile - overlap, top + kTile - overlap};
    left = std::clamp(left, search.left, std::max(search.left, search.right - kTile));
    top = std::clamp(top, search.top, std::max(search.top, search.bottom - kTile));
    const int width = std::min(kTile, search.right - left);
    const int height = std::min(kTile, search.bottom - top);
    BitRows area{};
    const auto above = [](const Run& run, int y) { return run.y < y; };
    int marked = 0;
    for (auto run = std::lower_bound(runs.begin(), runs.end(), top, above);
         run != runs.end() && run->y < top + height; ++run) {
        const int begin = std::max(0, run->begin - left);
        const int end = std::min(width, run->end - left);
        if (begin >= end) continue;
        area[static_cast<std::size_t>(run->y - top)] |= bit_span(begin, end);
        marked += end - begin;
    }
    if (marked < kLeastArea * size * size || marked == width * height || result.tiles == kMostTiles) return;
    ++result.tiles;
    Lobes lobes;
    find_lobes(area, width, height, size, lobes);
    for (const BitRows& lobe : lobes) {
        const BitBox box = box_of(lobe, 0, height);
        const int x = left + (box.left + box.right) / 2;
        const int y = top + (box.top + box.bottom) / 2;
        if (x < own.left || x >= own.right || y < own.top || y >= own.bottom) continue;
        BitRows whole = lobe;
        BitRows rest = area;
        grow(whole, steps_of(kRegrown * size), height);
        for (std::size_t row = 0; row < static_cast<std::size_t>(height); ++row) {
            whole[row] &= area[row];
            rest[row] &= ~whole[row];
        }
        std::array<Component, 2> parts;
        const std::span<Run> room(w.lobe_runs);
        if (!component_of(whole, height, left, top, room, parts[0])) continue;
        if (!component_of(rest, height, left, top, room.subspan(parts[0].count), parts[1])) continue;
        parts[1].first = parts[0].count;
        examine_lobe(search, parts, result);
    }
}

// lobe: and what it sticks out of.
void Detector::examine_lobe(const Search& search, const std::array<Component, 2>& lobe, SideResult& result) {
    Workspace& w = workspace_;
    const std::span<const Run> runs(w.lobe_runs);
    if (result.second_looks >= kMostSecondLooks || !has_core(search, members_of(lobe[0], runs))) return;
    ++result.second_looks;
    BlobLimits limits = config_.blob;
    limits.usual_size_px = search.usual_size_px;
    limits.usual_depth = search.usual_depth;
    limits.min_contrast = least_contrast(search.side);
    limits.is_lobe = true;
    const Blob blob = measure_blob(search.image, search.side, lobe[0], members_of(lobe[0], runs),
                                   {lobe, runs}, limits, w.blob);
    ++result.report.candidates;
    if (!blob.completed || blob.long_axis_px < kLeastLength * limits.usual_size_px) return;
    if (!result.blobs.push_back(blob)) result.report.blobs_full = true;
}

}  // namespace rig
