// The inverse of H over the free variables, and how it changes when one comes or goes. Not which one should:
// box_qp.cpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/solve/box_qp.hpp"

namespace rig {

// Shares of H_ii. A column of which less is left beyond the span of the free ones counts as dependent on
// them: what rounding leaves of it says nothing.
template <typename Real>
inline constexpr Real kDependentShare = sizeof(Real) == 4 ? Real(4e-6) : Real(1e-11);
template <typename Real>
inline constexpr Real kLeastDiagonal = sizeof(Real) == 4 ? Real(1e-12) : Real(1e-20);  // moves nothing

template <typename Real>
class FreeBlock {
  public:
    FreeBlock(const BoxQpProblem<Real>& problem, BoxQpState<Real>& state, BoxQpWorkspace<Real>& workspace)
        : p_(problem), s_(state), ws_(workspace) {}

    [[nodiscard]] std::size_t count() const { return s_.free_count; }

    void clear() {
        for (std::size_t a = 0; a < count(); ++a) std::fill_n(row(a), padded(count()), Real(0));
        s_.free_count = 0;
    }

    // step := inverse free_gradient.
    void find_step() {
        combine_rows(s_.inverse.data(), kStride, ws_.free_gradient.data(), count(), padded(count()), nullptr,
                     ws_.step.data());
    }

    // Puts variable i, now at w, behind the others and carries the step along; gradient[i] is its part of the
    // gradient. False, and column = inverse H_Fi, when its column depends on the free ones.
    bool add(std::size_t i, Real w) {
        const std::size_t k = count();
        const Real diagonal = p_.hessian[i * p_.stride + i];
        const Real rest = project_column(i);
        if (!(rest > kDependentShare<Real> * diagonal) || !(diagonal > kLeastDiagonal<Real>)) return false;
        const Real scale = Real(1) / rest;
        const Real pull =
            padded_dot(ws_.column.data(), ws_.free_gradient.data(), padded(k)) - ws_.gradient[i];
        const Real root = std::sqrt(scale);
        Real* last = row(k);
        for (std::size_t a = 0; a < k; ++a) {
            const Real u = ws_.column[a];
            last[a] = -scale * u;
            row(a)[k] = last[a];
            ws_.step[a] += u * (pull * scale);
            ws_.column[a] = u * root;
        }
        add_square(s_.inverse.data(), kStride, k, ws_.column.data());
        // columns from k on: the square adds only zeros there, because the column is padded with them
        last[k] = scale;
        ws_.step[k] = -pull * scale;
        ws_.free_gradient[k] = ws_.gradient[i];
        s_.free[k] = static_cast<std::uint16_t>(i);
        place(k, i, w);
        ++s_.free_count;
        pad(s_.free_count);
        return true;
    }

    // Takes out the variable in `slot` and carries the step along; the last one moves into its place.
    void remove(std::size_t slot) {
        const std::size_t k = count();
        const std::size_t last = k - 1;
        const Real scale = Real(1) / row(slot)[slot];
        const Real root = std::sqrt(std::max(scale, Real(0)));
        const Real pull = ws_.step[slot] * scale;
        for (std::size_t a = 0; a < k; ++a) {
            const Real u = row(slot)[a];
            ws_.step[a] -= u * pull;
            ws_.column[a] = u * root;
        }
        std::fill(ws_.column.begin() + static_cast<std::ptrdiff_t>(k),
                  ws_.column.begin() + static_cast<std::ptrdiff_t>(padded(k)), Real(0));
        subtract_square(s_.inverse.data(), kStride, k, ws_.column.data());
        if (slot != last) {
            std::copy_n(row(last), last, row(slot));
            for (std::size_t a = 0; a < last; ++a) row(a)[slot] = row(a)[last];
            row(slot)[slot] = row(last)[last];
            s_.free[slot] = s_.free[last];
            ws_.free_gradient[slot] = ws_.free_gradient[last];
            ws_.step[slot] = ws_.step[last];
            place(slot, s_.free[last], ws_.value[last]);
        }
        for (std::size_t a = 0; a < k; ++a) row(a)[last] = Real(0);
        std::fill_n(row(last), padded(k), Real(0));
        s_.free_count = static_cast<std::uint16_t>(last);
        pad(last);
    }

    // The free variables' values and bounds beside each other.
    void gather_values(std::span<const Real> w) {
        for (std::size_t a = 0; a < count(); ++a) place(a, s_.free[a], w[s_.free[a]]);
    }

    void gather_gradient() {
        for (std::size_t a = 0; a < count(); ++a) ws_.free_gradient[a] = ws_.gradient[s_.free[a]];
        pad(count());
    }

  private:
    static constexpr std::size_t kStride = BoxQpState<Real>::kInverseStride;

    [[nodiscard]] Real* row(std::size_t a) { return s_.inverse.data() + a * kStride; }

    void place(std::size_t slot, std::size_t i, Real w) {
        ws_.value[slot] = w;
        ws_.free_low[slot] = p_.low[i];
        ws_.free_high[slot] = p_.high[i];
    }

    // Zeros behind the k entries of what the kernels read in whole lanes.
    void pad(std::size_t k) {
        for (std::size_t a = k; a < padded(k); ++a) ws_.free_gradient[a] = ws_.step[a] = Real(0);
    }

    // column := inverse H_Fi; returns what H_ii keeps beyond the span of the free columns.
    Real project_column(std::size_t i) {
        const std::size_t k = count();
        const Real* from = p_.hessian.data() + i * p_.stride;
        for (std::size_t a = 0; a < k; ++a) ws_.direction[a] = from[s_.free[a]];
        for (std::size_t a = k; a < padded(k); ++a) ws_.direction[a] = Real(0);
        combine_rows(s_.inverse.data(), kStride, ws_.direction.data(), k, padded(k), nullptr,
                     ws_.column.data());
        return from[i] - padded_dot(ws_.direction.data(), ws_.column.data(), padded(k));
    }

    const BoxQpProblem<Real>& p_;
    BoxQpState<Real>& s_;
    BoxQpWorkspace<Real>& ws_;
};

}  // namespace rig
