// The clock of the benches: CPU time of this thread, what a reading costs, and quantiles of many readings.
#pragma once

#include <ctime>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace rig::bench {

inline double thread_cpu_us() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

// share: 0 the least, 0.5 the median, 1 the most. values: not empty.
inline double quantile(std::vector<double> values, double share) {
    const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
    return values[at];
}

// What two readings with nothing between them tell. A low quantile, not the least: one pair that came out
// equal would take the cost for nothing, and an outlier would flatter every time.
inline double clock_cost_us() {
    std::vector<double> costs(20'000);
    for (double& cost : costs) {
        const double began = thread_cpu_us();
        cost = thread_cpu_us() - began;
    }
    return quantile(std::move(costs), 0.1);
}

}  // namespace rig::bench
