#include "firmware_host/companion/experiments/marker_dropout.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kLeastBurst = 4;  // frames
constexpr std::size_t kMostBurst = 30;
constexpr std::size_t kSetPeriod = 60;
constexpr std::size_t kSetHidden = 30;

std::size_t below(WhiteNoise& random, std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}

// The nearest `count` markers to one on the neutral face, itself first.
std::vector<std::size_t> neighbours(const MarkerLayout& layout, std::size_t marker, std::size_t count) {
    std::vector<std::size_t> order(layout.markers.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto gap = [&](std::size_t k) {
        double sum = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double d = static_cast<double>(layout.markers[k].neutral_mm[axis]) -
                             static_cast<double>(layout.markers[marker].neutral_mm[axis]);
            sum += d * d;
        }
        return sum;
    };
    std::ranges::stable_sort(order, {}, gap);
    order.resize(std::min(count, order.size()));
    return order;
}

DropoutMask nothing_hidden(std::size_t frame_count, std::size_t marker_count) {
    return {frame_count, marker_count, std::vector<char>(frame_count * marker_count, 0)};
}

}  // namespace

double DropoutMask::share() const {
    const auto count = std::ranges::count_if(hidden, [](char c) { return c != 0; });
    return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, hidden.size()));
}

DropoutMask burst_dropout(const MarkerLayout& layout, std::size_t frame_count, double share,
                          std::uint64_t seed) {
    const std::size_t m = layout.markers.size();
    DropoutMask mask = nothing_hidden(frame_count, m);
    WhiteNoise random(seed);
    const auto wanted = static_cast<std::size_t>(share * static_cast<double>(mask.hidden.size()));
    std::size_t count = 0;
    while (count < wanted && frame_count > 1) {
        const bool cluster = random.uniform() < 1.0 / 3.0;
        const std::size_t size = cluster ? 3 + below(random, 4) : 1;
        const std::size_t begin = 1 + below(random, frame_count - 1);
        const std::size_t length = kLeastBurst + below(random, kMostBurst - kLeastBurst + 1);
        for (const std::size_t k : neighbours(layout, below(random, m), size)) {
            for (std::size_t f = begin; f < std::min(frame_count, begin + length) && count < wanted; ++f) {
                char& hidden = mask.hidden[f * m + k];
                count += hidden == 0 ? 1 : 0;
                hidden = 1;
            }
        }
    }
    return mask;
}

DropoutMask set_dropout(std::span<const std::uint16_t> markers, std::size_t frame_count,
                        std::size_t marker_count) {
    DropoutMask mask = nothing_hidden(frame_count, marker_count);
    for (std::size_t f = 0; f < frame_count; ++f) {
        if (f % kSetPeriod < kSetPeriod - kSetHidden) continue;
        for (const std::uint16_t k : markers) mask.hidden[f * marker_count + k] = 1;
    }
    return mask;
}

DropoutMask near_total_dropout(std::size_t seen, std::size_t frame_count, std::size_t marker_count,
                               std::uint64_t seed) {
    DropoutMask mask = nothing_hidden(frame_count, marker_count);
    WhiteNoise random(seed);
    std::vector<std::size_t> left(marker_count);
    std::iota(left.begin(), left.end(), std::size_t{0});
    for (std::size_t f = 1; f < frame_count; ++f) {
        if (f % kSetHidden == 1) {
            for (std::size_t i = 0; i < std::min(seen, marker_count); ++i)
                std::swap(left[i], left[i + below(random, marker_count - i)]);
        }
        for (std::size_t i = seen; i < marker_count; ++i) mask.hidden[f * marker_count + left[i]] = 1;
    }
    return mask;
}

std::vector<Vec3> held_last(std::span<const Vec3> positions_mm, const DropoutMask& mask) {
    std::vector<Vec3> out(positions_mm.begin(), positions_mm.end());
    const std::size_t m = mask.marker_count;
    for (std::size_t f = 1; f < mask.frame_count; ++f) {
        for (std::size_t k = 0; k < m; ++k) {
            if (mask.at(f, k)) out[f * m + k] = out[(f - 1) * m + k];
        }
    }
    return out;
}

std::vector<Vec3> interpolated(std::span<const Vec3> positions_mm, const DropoutMask& mask) {
    std::vector<Vec3> out = held_last(positions_mm, mask);
    const std::size_t m = mask.marker_count;
    for (std::size_t k = 0; k < m; ++k) {
        for (std::size_t f = 1; f < mask.frame_count; ++f) {
            if (!mask.at(f, k) || mask.at(f - 1, k)) continue;
            std::size_t end = f;
            while (end < mask.frame_count && mask.at(end, k)) ++end;
            if (end == mask.frame_count) break;
            const Vec3 before = out[(f - 1) * m + k];
            const Vec3 step = (positions_mm[end * m + k] - before) / static_cast<double>(end - f + 1);
            for (std::size_t g = f; g < end; ++g)
                out[g * m + k] = before + static_cast<double>(g - f + 1) * step;
        }
    }
    return out;
}

}  // namespace rig::host
