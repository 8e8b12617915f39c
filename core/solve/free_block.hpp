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
    // work: counts the multiply-adds.
    FreeBlock(const BoxQpProblem<Real>& problem, BoxQpState<Real>& state, BoxQpWorkspace<Real>& workspace,
              std::uint64_t& work)
        : p_(problem), s_(state), ws_(workspace), work_(work) {}

    [[nodiscard]] std::size_t count() const { return s_.free_count; }

    void clear() {
        const std::size_t wide = padded(count());
        for (std::size_t a = 0; a < count(); ++a) std::fill_n(row(a), wide, Real(0));
        for (auto* kept : {&s_.value, &s_.free_low, &s_.free_high, &s_.free_scale}) {
            std::fill_n(kept->begin(), wide, Real(0));
        }
        s_.free_count = 0;
    }

    // step := inverse free_gradient.
    void find_step() {
        const std::size_t k = count();
        work_ += k * k;
        combine_rows(s_.inverse.data(), kStride, ws_.free_gradient.data(), k, k, nullptr, ws_.step.data());
        for (std::size_t a = k; a < padded(k); ++a) ws_.step[a] = Real(0);
    }

    // Puts variable i, now at x, behind the others and carries the step along; gradient[i] is its part of the
    // gradient. False, and column = inverse H_Fi, when its column depends on the free ones.
    bool add(std::size_t i, Real x) {
        const std::size_t k = count();
        const Real diagonal = p_.hessian[i * p_.stride + i];
        const Real rest = project_column(i);
        if (!(rest > kDependentShare<Real> * diagonal) || !(diagonal > kLeastDiagonal<Real>)) return false;
        const Real scale = Real(1) / rest;
        const Real pull =
            padded_dot(ws_.column.data(), ws_.free_gradient.data(), padded(k)) - ws_.gradient[i];
        const Real root = std::sqrt(scale);
        if (k % kLaneFloats == 0) open_lane(k);
        ws_.column[k] = Real(-1);  // the bordered inverse is the old one and scale (u, -1) (u, -1)^T
        for (std::size_t a = 0; a <= k; ++a) {
            const Real u = ws_.column[a];
            ws_.step[a] += u * (pull * scale);
            ws_.column[a] = u * root;
        }
        work_ += (k + 1) * (k + 1);
        add_square(s_.inverse.data(), kStride, k + 1, ws_.column.data());
        ws_.free_gradient[k] = ws_.gradient[i];
        place(k, i, x);
        ++s_.free_count;
        return true;
    }

    // Takes out the variable in `slot` and carries the step along; the last one moves into its place.
    void remove(std::size_t slot) {
        const std::size_t k = count();
        const std::size_t last = k - 1;
        const Real* from = row(slot);
        const Real scale = Real(1) / from[slot];
        const Real root = std::sqrt(std::max(scale, Real(0)));
        const Real pull = ws_.step[slot] * scale;
        for (std::size_t a = 0; a < padded(k); ++a) {
            const Real u = from[a];
            ws_.step[a] -= u * pull;
            ws_.column[a] = u * root;
        }
        work_ += k * k;
        subtract_square(s_.inverse.data(), kStride, k, ws_.column.data());
        if (slot != last) {
            std::copy_n(row(last), last, row(slot));
            for (std::size_t a = 0; a < last; ++a) row(a)[slot] = row(a)[last];
            row(slot)[slot] = row(last)[last];
            ws_.free_gradient[slot] = ws_.free_gradient[last];
            ws_.step[slot] = ws_.step[last];
            place(slot, s_.free[last], s_.value[last]);
        }
        for (std::size_t a = 0; a < last; ++a) row(a)[last] = Real(0);
        std::fill_n(row(last), padded(k), Real(0));
        for (auto* kept :
             {&s_.value, &s_.free_low, &s_.free_high, &s_.free_scale, &ws_.free_gradient, &ws_.step}) {
            (*kept)[last] = Real(0);
        }
        s_.free_count = static_cast<std::uint16_t>(last);
    }

    // The free variables' values and bounds beside each other.
    void gather_values() {
        for (std::size_t a = 0; a < count(); ++a) place(a, s_.free[a], s_.answer[s_.free[a]]);
    }

    void spread_values() {
        for (std::size_t a = 0; a < count(); ++a) s_.answer[s_.free[a]] = s_.value[a];
    }

    void gather_gradient() {
        const std::size_t k = count();
        for (std::size_t a = 0; a < k; ++a) ws_.free_gradient[a] = ws_.gradient[s_.free[a]];
        for (std::size_t a = k; a < padded(k); ++a) ws_.free_gradient[a] = Real(0);
    }

  private:
    static constexpr std::size_t kStride = BoxQpState<Real>::kInverseStride;

    [[nodiscard]] Real* row(std::size_t a) { return s_.inverse.data() + a * kStride; }

    void place(std::size_t slot, std::size_t i, Real x) {
        s_.free[slot] = static_cast<std::uint16_t>(i);
        s_.value[slot] = x;
        s_.free_low[slot] = s_.low[i];
        s_.free_high[slot] = s_.high[i];
        s_.free_scale[slot] = s_.scale[i];
    }

    // The kernels read whole lanes: zeros in the one that slot k begins.
    void open_lane(std::size_t k) {
        for (auto* used : {&ws_.free_gradient, &ws_.step, &ws_.column}) {
            std::fill_n(used->begin() + static_cast<std::ptrdiff_t>(k), kLaneFloats, Real(0));
        }
    }

    // column := inverse H_Fi; returns what H_ii keeps beyond the span of the free columns.
    Real project_column(std::size_t i) {
        const std::size_t k = count();
        const Real* from = p_.hessian.data() + i * p_.stride;
        for (std::size_t a = 0; a < k; ++a) ws_.direction[a] = from[s_.free[a]];
        for (std::size_t a = k; a < padded(k); ++a) ws_.direction[a] = ws_.column[a] = Real(0);
        work_ += k * k;
        combine_rows(s_.inverse.data(), kStride, ws_.direction.data(), k, k, nullptr, ws_.column.data());
        return from[i] - padded_dot(ws_.direction.data(), ws_.column.data(), padded(k));
    }

    const BoxQpProblem<Real>& p_;
    BoxQpState<Real>& s_;
    BoxQpWorkspace<Real>& ws_;
    std::uint64_t& work_;
};

}  // namespace rig
