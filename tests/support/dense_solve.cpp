#include "tests/support/dense_solve.hpp"

#include <algorithm>
#include <cmath>

namespace rig::test {

bool solve_dense(std::vector<long double> a, std::vector<long double>& b, long double least_pivot) {
    const std::size_t n = b.size();
    long double largest = 0.0L;
    for (const long double x : a) largest = std::max(largest, std::fabs(x));
    for (std::size_t c = 0; c < n; ++c) {
        std::size_t pivot = c;
        for (std::size_t r = c + 1; r < n; ++r) {
            if (std::fabs(a[r * n + c]) > std::fabs(a[pivot * n + c])) pivot = r;
        }
        if (std::fabs(a[pivot * n + c]) <= least_pivot * largest) return false;
        for (std::size_t k = 0; k < n; ++k) std::swap(a[c * n + k], a[pivot * n + k]);
        std::swap(b[c], b[pivot]);
        for (std::size_t r = c + 1; r < n; ++r) {
            const long double factor = a[r * n + c] / a[c * n + c];
            for (std::size_t k = c; k < n; ++k) a[r * n + k] -= factor * a[c * n + k];
            b[r] -= factor * b[c];
        }
    }
    for (std::size_t c = n; c-- > 0;) {
        for (std::size_t k = c + 1; k < n; ++k) b[c] -= a[c * n + k] * b[k];
        b[c] /= a[c * n + c];
    }
    return true;
}

}  // namespace rig::test
