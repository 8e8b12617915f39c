#include "core/base/dense.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/float_kernels.hpp"

namespace rig {

namespace {

constexpr int kMaxJacobiSweeps = 30;

void rotate_rows_and_columns(double* a, std::size_t n, std::size_t stride, std::size_t p, std::size_t q,
                             double c, double s) {
    for (std::size_t k = 0; k < n; ++k) {
        const double akp = a[k * stride + p];
        const double akq = a[k * stride + q];
        a[k * stride + p] = c * akp - s * akq;
        a[k * stride + q] = s * akp + c * akq;
    }
    for (std::size_t k = 0; k < n; ++k) {
        const double apk = a[p * stride + k];
        const double aqk = a[q * stride + k];
        a[p * stride + k] = c * apk - s * aqk;
        a[q * stride + k] = s * apk + c * aqk;
    }
}

void rotate_columns(double* v, std::size_t n, std::size_t stride, std::size_t p, std::size_t q, double c,
                    double s) {
    for (std::size_t k = 0; k < n; ++k) {
        const double vkp = v[k * stride + p];
        const double vkq = v[k * stride + q];
        v[k * stride + p] = c * vkp - s * vkq;
        v[k * stride + q] = s * vkp + c * vkq;
    }
}

// One sweep over all pairs; returns the sum of squares it met off the diagonal.
double jacobi_sweep(double* a, std::size_t n, std::size_t stride, double* vectors) {
    double off = 0.0;
    for (std::size_t p = 0; p + 1 < n; ++p) {
        for (std::size_t q = p + 1; q < n; ++q) {
            const double apq = a[p * stride + q];
            off += apq * apq;
            if (apq == 0.0) continue;
            const double theta = (a[q * stride + q] - a[p * stride + p]) / (2.0 * apq);
            const double sign = theta >= 0.0 ? 1.0 : -1.0;
            const double t = sign / (sign * theta + std::sqrt(theta * theta + 1.0));
            const double c = 1.0 / std::sqrt(t * t + 1.0);
            rotate_rows_and_columns(a, n, stride, p, q, c, t * c);
            rotate_columns(vectors, n, stride, p, q, c, t * c);
        }
    }
    return off;
}

void sort_falling(double* values, double* vectors, std::size_t n, std::size_t stride) {
    for (std::size_t i = 0; i < n; ++i) {
        std::size_t best = i;
        for (std::size_t j = i + 1; j < n; ++j) {
            if (values[j] > values[best]) best = j;
        }
        if (best == i) continue;
        const double value = values[i];
        values[i] = values[best];
        values[best] = value;
        for (std::size_t k = 0; k < n; ++k) {
            const double entry = vectors[k * stride + i];
            vectors[k * stride + i] = vectors[k * stride + best];
            vectors[k * stride + best] = entry;
        }
    }
}

// Two of the four partial sums at a time: the width of the narrowest machine, so they stay in registers.
using Two [[gnu::vector_size(16), gnu::aligned(8), gnu::may_alias]] = double;

Two two_at(const double* p) {
    return *reinterpret_cast<const Two*>(p);
}
Two two_at(const float* p) {
    return Two{static_cast<double>(p[0]), static_cast<double>(p[1])};
}

template <typename Left>
double sum_products(const Left* a, const double* b, std::size_t n) {
    Two sum01{};
    Two sum23{};
    std::size_t i = 0;
    for (; i + 4 <= n; i += 4) {
        sum01 += two_at(a + i) * two_at(b + i);
        sum23 += two_at(a + i + 2) * two_at(b + i + 2);
    }
    double s0 = sum01[0];
    for (; i < n; ++i) s0 += static_cast<double>(a[i]) * b[i];
    return (s0 + sum01[1]) + (sum23[0] + sum23[1]);
}

}  // namespace

double dot(const double* a, const double* b, std::size_t n) {
    return sum_products(a, b, n);
}
double dot(const float* a, const double* b, std::size_t n) {
    return sum_products(a, b, n);
}

void add_scaled(double* y, double alpha, const double* x, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) y[i] += alpha * x[i];
}

bool cholesky(const double* a, double* l, std::size_t n, std::size_t stride, double floor) {
    double largest = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        if (a[i * stride + i] > largest) largest = a[i * stride + i];
    }
    const double smallest_pivot = floor * largest;
    for (std::size_t i = 0; i < n; ++i) {
        double* li = l + i * stride;
        for (std::size_t j = 0; j < i; ++j) {
            const double* lj = l + j * stride;
            li[j] = (a[i * stride + j] - dot(li, lj, j)) / lj[j];
        }
        const double pivot = a[i * stride + i] - dot(li, li, i);
        if (!(pivot > smallest_pivot)) return false;  // also refuses NaN
        li[i] = std::sqrt(pivot);
    }
    return true;
}

void solve_lower(const double* l, std::size_t n, std::size_t stride, double* x) {
    for (std::size_t i = 0; i < n; ++i) x[i] = (x[i] - dot(l + i * stride, x, i)) / l[i * stride + i];
}

void solve_lower_transposed(const double* l, std::size_t n, std::size_t stride, double* x) {
    for (std::size_t i = n; i-- > 0;) {
        x[i] /= l[i * stride + i];
        add_scaled(x, -x[i], l + i * stride, i);
    }
}

void symmetric_inverse(const double* l, std::size_t n, std::size_t stride, double* inverse, double* scratch) {
    RIG_CHECK(stride >= padded(n) && l != inverse);
    // M = L^-1 row by row, each from the rows above it.
    for (std::size_t i = 0; i < n; ++i) {
        double* row = inverse + i * stride;
        const double scale = 1.0 / l[i * stride + i];
        for (std::size_t j = 0; j < i; ++j) scratch[j] = -scale * l[i * stride + j];
        for (std::size_t j = 0; j < padded(n); ++j) row[j] = 0.0;
        combine_rows(inverse, stride, scratch, i, padded(i), nullptr, row);
        row[i] = scale;
    }
    // M^T M: row i needs the rows from i on only, so it can take the place of M's.
    for (std::size_t i = 0; i < n; ++i) {
        double* row = inverse + i * stride;
        for (std::size_t k = i + 1; k < n; ++k) scratch[k] = inverse[k * stride + i];
        const double own = row[i];
        for (std::size_t j = 0; j <= i; ++j) row[j] *= own;
        combine_rows(inverse + (i + 1) * stride, stride, scratch + i + 1, n - i - 1, padded(n), row, row);
    }
}

bool upper_factor(double* a, std::size_t first, std::size_t last, std::size_t n, std::size_t stride,
                  double* scratch, double floor) {
    double largest = 0.0;
    for (std::size_t i = first; i < last; ++i) {
        if (a[i * stride + i] > largest) largest = a[i * stride + i];
    }
    for (std::size_t i = first; i < last; ++i) {
        double* row = a + i * stride + i;
        for (std::size_t j = 0; j < i; ++j) scratch[j] = -a[j * stride + i];
        combine_rows(a + i, stride, scratch, i, n - i, row, row);
        if (!(row[0] > floor * largest)) return false;  // also refuses NaN
        const double scale = 1.0 / std::sqrt(row[0]);
        for (std::size_t j = 0; j < n - i; ++j) row[j] *= scale;
    }
    return true;
}

bool inverse_of_factor(double* a, std::size_t n, std::size_t stride, double* inverse, double* scratch,
                       double floor) {
    RIG_CHECK(stride >= n + kLaneFloats && a != inverse);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = n; j < n + kLaneFloats; ++j) a[i * stride + j] = 0.0;
        for (std::size_t j = 0; j < padded(n); ++j) inverse[i * stride + j] = 0.0;
    }
    if (!upper_factor(a, 0, n, n, stride, scratch, floor)) return false;
    for (std::size_t i = 0; i < n; ++i) {
        double* row = inverse + i * stride;
        const double scale = 1.0 / a[i * stride + i];
        for (std::size_t j = 0; j < i; ++j) scratch[j] = -scale * a[j * stride + i];
        // Rows above the columns' first are zero in them.
        for (std::size_t c = 0; c < i; c += kLaneFloats) {
            const std::size_t width = i - c < kLaneFloats ? i - c : kLaneFloats;
            combine_rows(inverse + c * stride + c, stride, scratch + c, i - c, width, nullptr, row + c);
        }
        row[i] = scale;
    }
    return true;
}

void symmetric_eigen(double* a, std::size_t n, std::size_t stride, double* values, double* vectors) {
    RIG_CHECK(stride >= n);
    double total = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            vectors[i * stride + j] = i == j ? 1.0 : 0.0;
            total += a[i * stride + j] * a[i * stride + j];
        }
    }
    for (int sweep = 0; sweep < kMaxJacobiSweeps; ++sweep) {
        if (jacobi_sweep(a, n, stride, vectors) <= 1e-30 * total) break;
    }
    for (std::size_t i = 0; i < n; ++i) values[i] = a[i * stride + i];
    sort_falling(values, vectors, n, stride);
}

}  // namespace rig
