#include "tests/support/reference_simplex_qp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/dense_solve.hpp"

namespace rig::test {

namespace {

using Numbers = std::vector<long double>;

constexpr long double kLeastPivot = 1e-15L;  // under it a pivot is nothing but rounding

Numbers gram_of(const ReferenceSimplexQp& p) {
    Numbers gram(p.count * p.count, 0.0L);
    for (std::size_t r = 0; r < p.rows; ++r) {
        const long double* row = p.examples.data() + r * p.count;
        for (std::size_t i = 0; i < p.count; ++i) {
            for (std::size_t j = 0; j < p.count; ++j) gram[i * p.count + j] += p.weight[r] * row[i] * row[j];
        }
    }
    return gram;
}

// The minimum over the affine span of the examples in `pattern`; false where it leaves the simplex.
bool minimum_of_pattern(const Numbers& gram, const Numbers& linear, std::size_t pattern, Numbers& c) {
    const std::size_t n = linear.size();
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < n; ++i) {
        if ((pattern >> i & 1U) != 0) used.push_back(i);
    }
    const std::size_t k = used.size();
    Numbers a((k + 1) * (k + 1), 0.0L);
    Numbers b(k + 1, 1.0L);
    for (std::size_t i = 0; i < k; ++i) {
        for (std::size_t j = 0; j < k; ++j) a[i * (k + 1) + j] = gram[used[i] * n + used[j]];
        a[i * (k + 1) + k] = a[k * (k + 1) + i] = 1.0L;
        b[i] = linear[used[i]];
    }
    if (!solve_dense(std::move(a), b, kLeastPivot)) return false;
    c.assign(n, 0.0L);
    for (std::size_t i = 0; i < k; ++i) {
        if (b[i] < 0.0L) return false;
        c[used[i]] = b[i];
    }
    return true;
}

}  // namespace

long double ReferenceSimplexQp::objective(std::span<const long double> c) const {
    long double sum = 0.0L;
    for (std::size_t r = 0; r < rows; ++r) {
        long double left = target[r];
        for (std::size_t i = 0; i < count; ++i) left -= examples[r * count + i] * c[i];
        sum += 0.5L * weight[r] * left * left;
    }
    return sum;
}

Numbers ReferenceSimplexQp::gradient(std::span<const long double> c) const {
    Numbers out(count, 0.0L);
    for (std::size_t r = 0; r < rows; ++r) {
        long double left = target[r];
        for (std::size_t i = 0; i < count; ++i) left -= examples[r * count + i] * c[i];
        for (std::size_t i = 0; i < count; ++i) out[i] -= weight[r] * left * examples[r * count + i];
    }
    return out;
}

Numbers solve_exhaustively(const ReferenceSimplexQp& problem) {
    const Numbers gram = gram_of(problem);
    const Numbers zero(problem.count, 0.0L);
    Numbers linear = problem.gradient(zero);
    for (long double& x : linear) x = -x;
    Numbers best;
    long double least = std::numeric_limits<long double>::infinity();
    for (std::size_t pattern = 1; pattern < std::size_t{1} << problem.count; ++pattern) {
        Numbers c;
        if (!minimum_of_pattern(gram, linear, pattern, c)) continue;
        const long double value = problem.objective(c);
        if (value < least) {
            least = value;
            best = c;
        }
    }
    return best;
}

Numbers solve_by_pairs(const ReferenceSimplexQp& problem, long double gap, int moves) {
    const std::size_t n = problem.count;
    const Numbers gram = gram_of(problem);
    Numbers c(n, 0.0L);
    c[0] = 1.0L;
    Numbers g = problem.gradient(c);
    for (int move = 0; move < moves; ++move) {
        std::size_t to = 0;
        std::size_t from = n;
        for (std::size_t i = 0; i < n; ++i) {
            if (g[i] < g[to]) to = i;
            if (c[i] > 0.0L && (from == n || g[i] > g[from])) from = i;
        }
        if (g[from] - g[to] <= gap) break;
        const long double curvature = gram[to * n + to] + gram[from * n + from] - 2.0L * gram[to * n + from];
        const long double free_length = curvature > 0.0L ? (g[from] - g[to]) / curvature : c[from];
        const long double length = std::min(c[from], free_length);
        c[to] += length;
        c[from] = length == c[from] ? 0.0L : c[from] - length;
        for (std::size_t i = 0; i < n; ++i) g[i] += length * (gram[i * n + to] - gram[i * n + from]);
    }
    return c;
}

}  // namespace rig::test
