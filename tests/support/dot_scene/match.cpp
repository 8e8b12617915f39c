#include "tests/support/dot_scene/match.hpp"

#include <algorithm>
#include <cmath>

namespace rig::test {

MatchCounts& MatchCounts::operator+=(const MatchCounts& other) {
    expected += other.expected;
    expected_found += other.expected_found;
    seen += other.seen;
    right += other.right;
    square_error_px2 += other.square_error_px2;
    largest_error_px = std::max(largest_error_px, other.largest_error_px);
    return *this;
}

double MatchCounts::recall() const {
    return expected == 0 ? 1.0 : static_cast<double>(expected_found) / static_cast<double>(expected);
}

double MatchCounts::precision() const {
    return seen == 0 ? 1.0 : static_cast<double>(right) / static_cast<double>(seen);
}

double MatchCounts::rms_px() const {
    return right == 0 ? 0.0 : std::sqrt(square_error_px2 / static_cast<double>(right));
}

MatchCounts match(std::span<const TrueDot> truth, std::span<const SeenDot> seen) {
    MatchCounts counts;
    counts.seen = seen.size();
    std::vector<bool> taken(seen.size(), false);
    for (const TrueDot& dot : truth) {
        counts.expected += dot.expected ? 1U : 0U;
        std::size_t best = seen.size();
        double best_distance = dot.reach_px;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            const double distance = std::hypot(seen[i].x_px - dot.x_px, seen[i].y_px - dot.y_px);
            if (taken[i] || distance > best_distance) continue;
            best = i;
            best_distance = distance;
        }
        if (best == seen.size()) continue;
        taken[best] = true;
        counts.expected_found += dot.expected ? 1U : 0U;
        counts.right += 1;
        counts.square_error_px2 += best_distance * best_distance;
        counts.largest_error_px = std::max(counts.largest_error_px, best_distance);
    }
    return counts;
}

std::vector<SeenDot> seen_dots(const Observations& observations) {
    std::vector<SeenDot> seen;
    for (const Observation& o : observations)
        seen.push_back({static_cast<double>(o.x_px), static_cast<double>(o.y_px)});
    return seen;
}

}  // namespace rig::test
