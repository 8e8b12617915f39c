// A rank of a few numbers: medians, quantiles. Not for: sorted copies.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace rig {

// The value that `rank` others are no greater than; reorders them. rank < values.size().
template <class Range>
[[nodiscard]] double ranked(Range&& values, std::size_t rank) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(values.begin(), place, values.end());
    return static_cast<double>(*place);
}

// The middle one, of an even number the greater of the two in the middle; reorders them. Not empty.
template <class Range>
[[nodiscard]] double median(Range&& values) {
    return ranked(values, values.size() / 2);
}

}  // namespace rig
