#include <algorithm>
#include <bit>

#include "core/base/math.hpp"
#include "core/detect/bit_rows.hpp"
#include "core/detect/components.hpp"
#include "core/detect/detector.hpp"
#include "core/image/kernels.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr double kSurroundingsPx = 8;        // of skin about a marker, for its background and its moat
constexpr std::size_t kMaxWindowParts = 48;  // that reach into one square; with more, windows save nothing
constexpr int kBlock = static_cast<int>(kBlockPx);

// Part of an image, in its pixels; whole blocks of it, so that their means are those of the whole image, and
// whole vectors of pixels where the image is wide enough.
struct Window {
    int left = 0;
    int top = 0;
    int right = 0;  // exclusive
    int bottom = 0;
};

int clamped(double at, int limit) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(limit)));
}

double reach_of(const ExpectedMarker& expected) {
    return static_cast<double>(std::min(expected.reach_px, kMaxReachPx));
}

Window window_about(const ImageView& image, const ExpectedMarker& expected, double size_px) {
    const double half =
        std::min(0.5 * kBlobWindowPx - kBlock, 0.5 * size_px + reach_of(expected) + kSurroundingsPx);
    const auto x = static_cast<double>(expected.x_px);
    const auto y = static_cast<double>(expected.y_px);
    const auto whole = [](int length, int unit) {
        return std::min((length + unit - 1) / unit * unit, static_cast<int>(kBlobWindowPx));
    };
    Window window;
    window.left = clamped(x - half, image.width_px) / kBlock * kBlock;
    window.top = clamped(y - half, image.height_px) / kBlock * kBlock;
    window.right = window.left + whole(clamped(x + half + 1.0, image.width_px) - window.left, kByteLanes);
    window.bottom = window.top + whole(clamped(y + half + 1.0, image.height_px) - window.top, kBlock);
    window.right = std::min(window.right, image.width_px);
    window.bottom = std::min(window.bottom, image.height_px);
    return window;
}

bool is_usable(const ExpectedMarker& expected) {
    const auto within = [](float v) { return v > -1e4F && v < 1e4F; };  // false for NaN
    return within(expected.x_px) && within(expected.y_px) && expected.reach_px >= 0.0F;
}

bool is_within_reach(double x_px, double y_px, const ExpectedMarker& expected) {
    const double dx = x_px - static_cast<double>(expected.x_px);
    const double dy = y_px - static_cast<double>(expected.y_px);
    const double reach = reach_of(expected);
    return dx * dx + dy * dy <= reach * reach;
}

// The square about the expected place; parts of what reaches into it may be the marker.
void mark_reach(const ExpectedMarker& expected, const Detector::Search& search, BitRows& rows) {
    const double reach = reach_of(expected);
    const int width = search.right - search.left;
    const int height = search.bottom - search.top;
    const double x = static_cast<double>(expected.x_px) - search.left;
    const double y = static_cast<double>(expected.y_px) - search.top;
    const std::uint64_t span = bit_span(clamped(x - reach, width), clamped(x + reach + 1.0, width));
    const int last = clamped(y + reach + 1.0, height);
    std::fill_n(rows.begin(), height, std::uint64_t{0});
    for (int row = clamped(y - reach, height); row < last; ++row) rows[static_cast<std::size_t>(row)] = span;
}

bool are_one(const Blob& a, const Blob& b) {
    const double dx = a.x_px - b.x_px;
    const double dy = a.y_px - b.y_px;
    const double apart = 0.5 * std::min(a.short_axis_px, b.short_axis_px);
    return dx * dx + dy * dy < apart * apart;
}

bool is_same(const Component& a, const Component& b) {
    return a.left == b.left && a.top == b.top && a.right == b.right && a.bottom == b.bottom;
}

}  // namespace

// As detect_side(), of a part of the image. False when it holds more parts than are looked at.
bool Detector::search_window(const ImageView& image, Side side, const ExpectedMarker& expected,
                             SideResult& result) {
    Workspace& w = workspace_;
    const Window window = window_about(image, expected, state_.usual_size_px);
    if (window.right - window.left < kBlock || window.bottom - window.top < kBlock) return true;
    const ImageView part{image.row(window.top) + window.left, window.right - window.left,
                         window.bottom - window.top, image.stride_bytes};
    const BlockGrid means = block_means(part, w.means);
    const BlockGrid thresholds{std::span(w.background).first(means.values.size()), means.width, means.height};
    const double largest = largest_marker(state_.usual_size_px);
    set_thresholds(means, thresholds, side, largest);
    threshold_bits(part, thresholds, side, w.window);
    const Search search{.image = image,
                        .thresholds = thresholds,
                        .side = side,
                        .largest_px = largest,
                        .usual_size_px = state_.usual_size_px,
                        .usual_depth = state_.usual_depth,
                        .left = window.left,
                        .top = window.top,
                        .right = window.right,
                        .bottom = window.bottom};
    const std::size_t before = result.blobs.size();
    if (!examine_window(search, expected, result)) return false;
    if (is_met(expected, result)) drop_cut_off(search);
    split_failed(search, means, result);
    drop_repeats(before, result);
    return true;
}

bool Detector::is_met(const ExpectedMarker& expected, const SideResult& result) {
    return std::any_of(result.blobs.begin(), result.blobs.end(),
                       [&](const Blob& blob) { return is_within_reach(blob.x_px, blob.y_px, expected); });
}

// What only reaches into the window is left to the window it belongs to, unless the marker may be in it.
void Detector::drop_cut_off(const Search& search) {
    Workspace& w = workspace_;
    std::size_t kept = 0;
    for (const std::uint16_t c : w.failed) {
        if (!search.cuts_off(w.components[c])) w.failed[kept++] = c;
    }
    w.failed.resize(kept);
}

// Two windows may both have measured a marker, one of them as a part of something else: the rounder one
// counts.
void Detector::drop_repeats(std::size_t first, SideResult& result) {
    std::size_t kept = first;
    for (std::size_t i = first; i < result.blobs.size(); ++i) {
        const Blob& blob = result.blobs[i];
        const auto before = std::span(result.blobs.span()).first(first);
        const auto same = std::find_if(before.begin(), before.end(),
                                       [&](const Blob& other) { return are_one(other, blob); });
        if (same == before.end()) {
            result.blobs[kept++] = blob;
        } else if (blob.badness < same->badness) {
            *same = blob;
        }
    }
    result.blobs.resize(kept);
}

// Measures what reaches into the square about the expected place. False when there are too many parts.
bool Detector::examine_window(const Search& search, const ExpectedMarker& expected, SideResult& result) {
    Workspace& w = workspace_;
    const auto height = static_cast<std::size_t>(search.bottom - search.top);
    w.failed.clear();
    mark_reach(expected, search, w.reach);
    std::size_t floods = 0;
    std::size_t parts = 0;
    std::size_t used = 0;
    for (std::size_t y = 0; y < height; ++y) {
        for (std::uint64_t within = 0; (within = w.reach[y] & w.window[y]) != 0;) {
            if (++floods > kMaxWindowParts) return false;
            std::fill_n(w.part.begin(), height, std::uint64_t{0});
            w.part[y] = within & (~within + 1);
            flood(w.part, w.window, static_cast<int>(height));
            for (std::size_t k = 0; k < height; ++k) w.window[k] &= ~w.part[k];
            Component& component = w.components[parts];
            const std::span<Run> room = std::span(w.grouped).subspan(used);
            if (!component_of(w.part, static_cast<int>(height), search.left, search.top, room, component)) {
                return false;
            }
            if (component.area_px < least_area_px(config_.blob)) continue;
            component.first = static_cast<std::uint32_t>(used);
            used += component.count;
            examine_part(search, parts++, result);
        }
    }
    result.report.runs += static_cast<std::uint32_t>(used);
    return true;
}

void Detector::examine_part(const Search& search, std::size_t number, SideResult& result) {
    Workspace& w = workspace_;
    const Component& component = w.components[number];
    const auto same = [&](const Component& other) { return is_same(component, other); };
    if (std::any_of(w.examined.begin(), w.examined.end(), same)) return;
    const bool whole = !search.cuts_off(component);
    if (whole && !w.examined.push_back(component)) result.report.blobs_full = true;
    if (!whole || !examine(search, component, members_of(component, w.grouped), {}, result)) {
        result.report.blobs_full |= !w.failed.push_back(static_cast<std::uint16_t>(number));
    }
}

bool Detector::search_windows(const ImageView& image, Side side, std::span<const ExpectedMarker> expected,
                              SideResult& result) {
    result.blobs.clear();
    result.report = DetectorReport{};
    result.second_looks = 0;
    result.tiles = 0;
    workspace_.examined.clear();
    set_core_steps(side);
    for (const ExpectedMarker& marker : expected) {
        if (is_usable(marker) && !search_window(image, side, marker, result)) return false;
    }
    apply_population(image, side, result);
    std::size_t sure = 0;
    std::size_t met = 0;
    for (const ExpectedMarker& marker : expected) {
        if (!is_usable(marker) || !marker.surely) continue;
        ++sure;
        met += std::any_of(result.blobs.begin(), result.blobs.end(), [&](const Blob& blob) {
            return blob.score >= config_.min_score && is_within_reach(blob.x_px, blob.y_px, marker);
        });
    }
    return sure > 0 && static_cast<double>(met) >= kWindowShare * static_cast<double>(sure);
}

void Detector::detect_around(const ImageView& image, std::span<const ExpectedMarker> expected,
                             Observations& observations, DetectorReport& report) {
    const bool knows = is_processable(image) && is_settled() && state_.usual_size_px > 0.0;
    if (!knows) {
        detect(image, observations, report);
        return;
    }
    observations.clear();
    report = DetectorReport{};
    measure_exposure(image, report);  // first: the least contrast is that of this frame's light
    const std::size_t side = likely_side();
    if (!search_windows(image, kSides[side], expected, workspace_.sides[side])) {
        detect_whole(image, observations, report);
        return;
    }
    add_counts(report, workspace_.sides[side].report);
    finish(side, observations, report);
}

}  // namespace rig
