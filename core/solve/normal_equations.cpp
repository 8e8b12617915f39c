#include "core/solve/normal_equations.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/solve/square_terms.hpp"

namespace rig {

namespace {

constexpr std::uint16_t kMostFollowed =
    192;                                 // rank-one terms before H is made anew: 64 markers hidden or shown
constexpr double kDiagonalFloor = 1e-9;  // of the largest diagonal entry
constexpr double kSmallestDiagonal = 1e-12;  // mm^2, when the basis is zero

bool unseen(const Mat3& v) {
    return v(0, 0) == 0.0 && v(1, 1) == 0.0 && v(2, 2) == 0.0;
}

bool same_weight(const Mat3& now, const Mat3& used) {
    if (unseen(now) || unseen(used)) return unseen(now) == unseen(used);
    return (now - used).cwiseAbs().maxCoeff() <= kSameInformation * now.trace();
}

template <typename Real>
class HessianFollower {
  public:
    HessianFollower(const SolvePack& pack, const NormalTables<Real>& tables, NormalState<Real>& state,
                    BoxQpState<Real>& qp, NormalEquations<Real>& e)
        : n_(pack.shape_count),
          stride_(row_stride(pack.shape_count)),
          tables_(tables),
          s_(state),
          qp_(qp),
          e_(e) {}

    // True when H had to change.
    bool follow(const NormalInput& input) {
        std::size_t changed = 0;
        for (std::size_t k = 0; k < input.weights.size(); ++k) {
            if (s_.valid && !same_weight(input.weights[k], s_.weights[k])) ++changed;
        }
        if (s_.valid && changed == 0) return false;
        if (!s_.valid || 4 * changed > input.weights.size() || s_.followed > kMostFollowed) {
            make(input);
            return true;
        }
        bool in_step = true;
        for (std::size_t k = 0; k < input.weights.size(); ++k) {
            if (same_weight(input.weights[k], s_.weights[k])) continue;
            in_step = add_marker(k, input.weights[k] - s_.weights[k], true) && in_step;
            s_.weights[k] = input.weights[k];
        }
        finish(in_step);
        return true;
    }

    void regularise(const SolvePack& pack, double gamma_scale) {
        s_.gamma_scale = gamma_scale;
        const double floor = diagonal_floor();
        for (std::size_t i = 0; i < n_; ++i) {
            const double gamma = gamma_scale * static_cast<double>(pack.temporal_gamma[i]);
            const Real now = static_cast<Real>(static_cast<double>(pack.ridge_mm2) + gamma + floor);
            s_.hessian[i * stride_ + i] += now - s_.regularisation[i];
            s_.regularisation[i] = now;
        }
        ++s_.version;
    }

  private:
    // Makes the answer unique when shapes are invisible or dependent and no ridge does it: far below what any
    // marker can say, and above double's rounding.
    [[nodiscard]] double diagonal_floor() const {
        double largest = 0.0;
        for (std::size_t i = 0; i < n_; ++i) {
            largest = std::max(largest, static_cast<double>(tables_.full_gram[i * stride_ + i]));
        }
        return sizeof(Real) == sizeof(double) ? kDiagonalFloor * largest + kSmallestDiagonal : 0.0;
    }

    void make(const NormalInput& input) {
        std::size_t plain = 0;
        for (const Mat3& v : input.weights)
            plain += (v - Mat3::Identity()).cwiseAbs().maxCoeff() == 0.0 ? 1 : 0;
        const bool subtract = 2 * plain > input.weights.size();
        for (std::size_t i = 0; i < n_ * stride_; ++i)
            s_.hessian[i] = subtract ? tables_.full_gram[i] : Real(0);
        for (std::size_t k = 0; k < input.weights.size(); ++k) {
            const Mat3 from = subtract ? Mat3(Mat3::Identity()) : Mat3(Mat3::Zero());
            s_.weights[k] = input.weights[k];
            add_marker(k, input.weights[k] - from, false);
        }
        for (std::size_t i = 0; i < n_; ++i) s_.hessian[i * stride_ + i] += s_.regularisation[i];
        s_.valid = true;
        s_.followed = 0;
        finish(false);
    }

    void finish(bool in_step) {
        ++s_.version;
        if (in_step) settle_hessian(qp_, {s_.hessian.data(), n_ * stride_}, stride_, s_.version);
    }

    // H += B_k^T dV B_k. False when the QP's inverse could not follow.
    bool add_marker(std::size_t k, const Mat3& change, bool follow_inverse) {
        bool in_step = true;
        for_each_square(change, [&](const Vec3& l, bool add) {
            in_step = add_term(k, l, add, follow_inverse) && in_step;
        });
        return in_step;
    }

    bool add_term(std::size_t k, const Vec3& l, bool add, bool follow_inverse) {
        const std::array<Real, 3> factor{static_cast<Real>(l[0]), static_cast<Real>(l[1]),
                                         static_cast<Real>(l[2])};
        combine_rows(tables_.basis_mm.data() + 3 * k * stride_, stride_, factor.data(), 3, padded(n_),
                     nullptr, e_.term.data());
        if (add) {
            add_square(s_.hessian.data(), stride_, n_, e_.term.data());
        } else {
            subtract_square(s_.hessian.data(), stride_, n_, e_.term.data());
        }
        ++s_.followed;
        const std::uint64_t free = qp_.free_count;
        e_.work += 3 * n_ + n_ * n_ + (follow_inverse ? 2 * free * free + 2 * n_ : 0);
        return !follow_inverse || follow_hessian(qp_, {e_.term.data(), n_}, add);
    }

    std::size_t n_;
    std::size_t stride_;
    const NormalTables<Real>& tables_;
    NormalState<Real>& s_;
    BoxQpState<Real>& qp_;
    NormalEquations<Real>& e_;
};

template <typename Real>
void build_linear(const SolvePack& pack, const NormalTables<Real>& tables, const NormalInput& input,
                  const NormalState<Real>& state, NormalEquations<Real>& e) {
    const std::size_t n = pack.shape_count;
    const std::size_t stride = row_stride(n);
    e.constant_mm2 = 0.0;
    e.markers_used = 0;
    std::size_t rows = 0;
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        if (unseen(input.weights[k])) continue;
        ++e.markers_used;
        const Vec3 error = point_at(pack.neutral_mm, k) - input.positions_mm[k];
        const Vec3 weighted = state.weights[k] * error;
        e.constant_mm2 += error.dot(weighted);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            e.rows[rows] = static_cast<std::uint16_t>(3 * k + axis);
            e.error[rows++] = static_cast<Real>(weighted[static_cast<Eigen::Index>(axis)]);
        }
    }
    const auto half_beta = static_cast<Real>(0.5 * static_cast<double>(pack.sparsity_mm2));
    for (std::size_t i = 0; i < n; ++i) {
        const double gamma = input.gamma_scale * static_cast<double>(pack.temporal_gamma[i]);
        const double previous = gamma > 0.0 ? input.previous[i] : 0.0;
        const Real sparsity = pack.weight_low[i] >= 0.0F ? half_beta : Real(0);
        e.linear[i] = sparsity - static_cast<Real>(gamma * previous);
        e.constant_mm2 += gamma * previous * previous;
    }
    for (std::size_t i = n; i < padded(n); ++i) e.linear[i] = Real(0);
    e.work += rows * n;
    combine_rows(tables.basis_mm.data(), stride, e.rows.data(), e.error.data(), rows, padded(n),
                 e.linear.data(), e.linear.data());
}

}  // namespace

template <typename Real>
void build_normal_tables(const SolvePack& pack, NormalTables<Real>& tables) {
    const std::size_t n = pack.shape_count;
    const std::size_t stride = row_stride(n);
    const std::size_t rows = 3U * pack.marker_count;
    RIG_CHECK(n <= kMaxShapes && rows <= kMaxRows && pack.basis_mm.size() == rows * n);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < stride; ++i) {
            tables.basis_mm[r * stride + i] = i < n ? static_cast<Real>(pack.basis_mm[r * n + i]) : Real(0);
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < stride; ++j) {
            double sum = 0.0;  // in double for either: made once
            for (std::size_t r = 0; r < rows && j < n; ++r) {
                sum += static_cast<double>(pack.basis_mm[r * n + i]) *
                       static_cast<double>(pack.basis_mm[r * n + j]);
            }
            tables.full_gram[i * stride + j] = static_cast<Real>(sum);
        }
    }
}

template <typename Real>
void build_normal_equations(const SolvePack& pack, const NormalTables<Real>& tables, const NormalInput& input,
                            NormalState<Real>& state, BoxQpState<Real>& qp, NormalEquations<Real>& e) {
    RIG_CHECK(input.positions_mm.size() == pack.marker_count && input.weights.size() == pack.marker_count);
    HessianFollower<Real> follower(pack, tables, state, qp, e);
    const bool fresh = !state.valid;
    e.work = 0;
    e.changed = follower.follow(input);
    if (fresh || input.gamma_scale != state.gamma_scale) follower.regularise(pack, input.gamma_scale);
    build_linear(pack, tables, input, state, e);
}

template <typename Real>
double residual_rms_mm(const SolvePack& pack, const NormalTables<Real>& tables, const NormalInput& input,
                       std::span<const Real> w) {
    const std::size_t wide = padded(pack.shape_count);
    const std::size_t stride = row_stride(pack.shape_count);
    RIG_CHECK(w.size() >= wide);
    double sum = 0.0;
    double coordinates = 0.0;
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const Mat3& v = input.weights[k];
        if (unseen(v)) continue;
        Vec3 error = point_at(pack.neutral_mm, k) - input.positions_mm[k];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Real* row = tables.basis_mm.data() + (3 * k + axis) * stride;
            error[static_cast<Eigen::Index>(axis)] += static_cast<double>(padded_dot(row, w.data(), wide));
        }
        sum += error.dot(v * error);
        coordinates += v.trace();
    }
    return coordinates > 0.0 ? std::sqrt(sum / coordinates) : 0.0;
}

template void build_normal_tables(const SolvePack&, NormalTables<float>&);
template void build_normal_tables(const SolvePack&, NormalTables<double>&);
template void build_normal_equations(const SolvePack&, const NormalTables<float>&, const NormalInput&,
                                     NormalState<float>&, BoxQpState<float>&, NormalEquations<float>&);
template void build_normal_equations(const SolvePack&, const NormalTables<double>&, const NormalInput&,
                                     NormalState<double>&, BoxQpState<double>&, NormalEquations<double>&);
template double residual_rms_mm(const SolvePack&, const NormalTables<float>&, const NormalInput&,
                                std::span<const float>);
template double residual_rms_mm(const SolvePack&, const NormalTables<double>&, const NormalInput&,
                                std::span<const double>);

}  // namespace rig
