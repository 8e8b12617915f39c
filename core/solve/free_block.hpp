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
inline constexpr Real kLeastShare = Real(1e-6);  // that a price knows
template <typename Real>
inline constexpr Real kLeastDiagonal = sizeof(Real) == 4 ? Real(1e-12) : Real(1e-20);  // moves nothing

// Changes of an inverse of k rows that wait for each other: each adds 2 k to a product, and spares half a
// pass over the inverse.
template <typename Real>
[[nodiscard]] constexpr std::size_t changes_that_wait(std::size_t k) {
    if (k < 16) return 1;
    return k < (sizeof(Real) == 4 ? 40 : 28) ? 4 : kBoxQpPending;
}

template <typename Real>
class FreeBlock {
  public:
    // work: counts the multiply-adds.
    FreeBlock(const BoxQpProblem<Real>& problem, BoxQpState<Real>& state, BoxQpWorkspace<Real>& workspace,
              std::uint64_t& work)
        : p_(problem), s_(state), ws_(workspace), work_(work) {}

    [[nodiscard]] std::size_t count() const { return s_.free_count; }

    void clear() {
        pending_ = 0;
        // All that this problem's slots can reach: what is no number spreads into the padding.
        const std::size_t wide = padded(std::max(count(), p_.size));
        for (std::size_t a = 0; a < wide; ++a) std::fill_n(row(a), wide, Real(0));
        for (auto* kept : {&s_.value, &s_.free_low, &s_.free_high, &s_.free_scale}) {
            std::fill_n(kept->begin(), wide, Real(0));
        }
        s_.free_count = 0;
    }

    // Makes the changes that wait: the state's inverse is whole between solves.
    void settle_inverse() {
        const std::size_t k = count();
        if (pending_ > 1) {
            work_ += pending_ * (k * (k + 4) / 2);
            add_squares(s_.inverse.data(), kStride, k, ws_.pending.data(), ws_.sign.data(), pending_);
        } else if (pending_ == 1) {
            work_ += k * k;
            if (ws_.sign[0] > Real(0)) add_square(s_.inverse.data(), kStride, k, ws_.pending.data());
            if (ws_.sign[0] < Real(0)) subtract_square(s_.inverse.data(), kStride, k, ws_.pending.data());
        }
        pending_ = 0;
    }

    // step := inverse free_gradient.
    void find_step() {
        const std::size_t k = count();
        apply(ws_.free_gradient.data(), ws_.step.data());
        for (std::size_t a = k; a < padded(k); ++a) ws_.step[a] = Real(0);
    }

    // Of variable i, which is not free, once the whole step is taken.
    Real gradient_after_step(std::size_t i) {
        gather_column(i);
        work_ += count();
        return ws_.gradient[i] - padded_dot(ws_.direction.data(), ws_.step.data(), padded(count()));
    }

    // Puts variable i, now at x, behind the others and carries the step along; gradient[i] is its part of the
    // gradient. False, and column = inverse H_Fi, when its column depends on the free ones.
    bool add(std::size_t i, Real x) {
        const std::size_t k = count();
        const Real diagonal = p_.hessian[i * p_.stride + i];
        const Real rest = project_column(i);
        if (!(rest > kDependentShare<Real> * diagonal) || !(diagonal > kLeastDiagonal<Real>)) return false;
        const Real scale = Real(1) / rest;
        set_price(i, rest * s_.scale[i]);
        const Real pull =
            padded_dot(ws_.column.data(), ws_.free_gradient.data(), padded(k)) - ws_.gradient[i];
        const Real root = std::sqrt(scale);
        if (k % kLaneFloats == 0) open_lane(k);
        ws_.column[k] = Real(-1);  // the bordered inverse is the old one and scale (u, -1) (u, -1)^T
        defer(k + 1, Real(1), root, -(pull * scale));
        ws_.free_gradient[k] = ws_.gradient[i];
        place(k, i, x);
        ++s_.free_count;
        if (pending_ >= changes_that_wait<Real>(count())) settle_inverse();
        return true;
    }

    // Takes out the variable in `slot` and carries the step along; the last one moves into its place.
    void remove(std::size_t slot) {
        const std::size_t k = count();
        const std::size_t last = k - 1;
        find_row(slot);
        const Real scale = Real(1) / ws_.column[slot];
        set_price(s_.free[slot], scale * s_.free_scale[slot]);
        defer(k, Real(-1), std::sqrt(std::max(scale, Real(0))), ws_.step[slot] * scale);
        if (slot != last) {
            std::copy_n(row(last), last, row(slot));
            for (std::size_t a = 0; a < last; ++a) row(a)[slot] = row(a)[last];
            row(slot)[slot] = row(last)[last];
            for (std::size_t j = 0; j < pending_; ++j) waiting(j)[slot] = waiting(j)[last];
            ws_.free_gradient[slot] = ws_.free_gradient[last];
            ws_.step[slot] = ws_.step[last];
            place(slot, s_.free[last], s_.value[last]);
        }
        for (std::size_t a = 0; a < last; ++a) row(a)[last] = Real(0);
        for (std::size_t j = 0; j < pending_; ++j) waiting(j)[last] = Real(0);
        std::fill_n(row(last), padded(k), Real(0));
        for (auto* kept :
             {&s_.value, &s_.free_low, &s_.free_high, &s_.free_scale, &ws_.free_gradient, &ws_.step}) {
            (*kept)[last] = Real(0);
        }
        s_.free_count = static_cast<std::uint16_t>(last);
        if (pending_ >= changes_that_wait<Real>(count())) settle_inverse();
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

    [[nodiscard]] Real* waiting(std::size_t j) { return ws_.pending.data() + j * kStride; }

    // out := inverse in, zeros behind k.
    void apply(const Real* in, Real* out) {
        const std::size_t k = count();
        work_ += k * k + 2 * k * pending_;
        combine_rows(s_.inverse.data(), kStride, in, k, k, nullptr, out);
        if (pending_ == 0) return;
        for (std::size_t j = 0; j < pending_; ++j) {
            ws_.share[j] = ws_.sign[j] * padded_dot(waiting(j), in, padded(k));
        }
        combine_rows(ws_.pending.data(), kStride, ws_.share.data(), pending_, k, out, out);
    }

    // column := row `slot` of the inverse.
    void find_row(std::size_t slot) {
        const std::size_t k = count();
        work_ += k * pending_;
        for (std::size_t j = 0; j < pending_; ++j) ws_.share[j] = ws_.sign[j] * waiting(j)[slot];
        combine_rows(ws_.pending.data(), kStride, ws_.share.data(), pending_, k, row(slot),
                     ws_.column.data());
        for (std::size_t a = k; a < padded(k); ++a) ws_.column[a] = Real(0);
    }

    // The inverse changes by sign (root column) (root column)^T, the step by -pull column.
    void defer(std::size_t k, Real sign, Real root, Real pull) {
        Real* __restrict u = waiting(pending_);
        for (std::size_t a = 0; a < padded(k); ++a) {
            ws_.step[a] -= ws_.column[a] * pull;
            u[a] = ws_.column[a] * root;
        }
        ws_.sign[pending_++] = sign;
    }

    // share: of H_ii, left beyond the span of the free columns. Among similar shapes little is left, and what
    // a multiplier then gains is large for its size (steepest edge; Forrest and Goldfarb 1992).
    void set_price(std::size_t i, Real share) {
        s_.price[i] = Real(1) / std::sqrt(share > kLeastShare<Real> ? share : kLeastShare<Real>);
    }

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
        for (std::size_t j = 0; j < pending_; ++j) std::fill_n(waiting(j) + k, kLaneFloats, Real(0));
    }

    // direction := H_Fi.
    void gather_column(std::size_t i) {
        const std::size_t k = count();
        const Real* from = p_.hessian.data() + i * p_.stride;
        for (std::size_t a = 0; a < k; ++a) ws_.direction[a] = from[s_.free[a]];
        for (std::size_t a = k; a < padded(k); ++a) ws_.direction[a] = Real(0);
    }

    // column := inverse H_Fi; returns what H_ii keeps beyond the span of the free columns.
    Real project_column(std::size_t i) {
        const std::size_t k = count();
        gather_column(i);
        for (std::size_t a = k; a < padded(k); ++a) ws_.column[a] = Real(0);
        apply(ws_.direction.data(), ws_.column.data());
        return p_.hessian[i * p_.stride + i] - padded_dot(ws_.direction.data(), ws_.column.data(), padded(k));
    }

    const BoxQpProblem<Real>& p_;
    BoxQpState<Real>& s_;
    BoxQpWorkspace<Real>& ws_;
    std::uint64_t& work_;
    std::size_t pending_ = 0;  // changes that wait
};

}  // namespace rig
