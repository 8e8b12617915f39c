// The kept inverse follows H from frame to frame: a marker hidden or shown is three rank-one terms.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/solve/box_qp.hpp"
#include "core/solve/free_block.hpp"

namespace rig {

namespace {

// Of 1 + u^T z. Taking a term away that leaves less nearly unties a variable: making the inverse anew is
// the sharper way.
constexpr double kLeastDenominator = 1e-2;

template <typename Real>
bool follow(BoxQpState<Real>& s, std::span<const Real> z, bool add) {
    if (!s.warm || !s.inverse_valid || z.size() < s.size) return false;
    const std::size_t k = s.free_count;
    alignas(64) std::array<Real, kMaxUnknowns> part;
    alignas(64) std::array<Real, kMaxUnknowns> u;
    for (std::size_t a = 0; a < k; ++a) part[a] = z[s.free[a]];
    for (std::size_t a = k; a < padded(k); ++a) part[a] = Real(0);
    combine_rows(s.inverse.data(), BoxQpState<Real>::kInverseStride, part.data(), k, padded(k), nullptr,
                 u.data());
    const Real reach = padded_dot(part.data(), u.data(), padded(k));
    const Real denominator = add ? Real(1) + reach : Real(1) - reach;
    if (!(denominator > static_cast<Real>(kLeastDenominator))) {
        s.inverse_valid = false;
        return false;
    }
    const Real root = Real(1) / std::sqrt(denominator);
    for (std::size_t a = 0; a < k; ++a) u[a] *= root;
    if (add) {
        subtract_square(s.inverse.data(), BoxQpState<Real>::kInverseStride, k, u.data());
    } else {
        add_square(s.inverse.data(), BoxQpState<Real>::kInverseStride, k, u.data());
    }
    return true;
}

template <typename Real>
void settle(BoxQpState<Real>& s, std::span<const Real> hessian, std::size_t stride, std::uint32_t version) {
    if (!s.inverse_valid) return;
    for (std::size_t i = 0; i < s.size; ++i) {
        s.scale[i] = Real(1) / std::max(hessian[i * stride + i], kLeastDiagonal<Real>);
    }
    s.hessian_version = version;
}

}  // namespace

bool follow_hessian(BoxQpState<float>& state, std::span<const float> z, bool add) {
    return follow(state, z, add);
}
bool follow_hessian(BoxQpState<double>& state, std::span<const double> z, bool add) {
    return follow(state, z, add);
}
void settle_hessian(BoxQpState<float>& state, std::span<const float> hessian, std::size_t stride,
                    std::uint32_t version) {
    settle(state, hessian, stride, version);
}
void settle_hessian(BoxQpState<double>& state, std::span<const double> hessian, std::size_t stride,
                    std::uint32_t version) {
    settle(state, hessian, stride, version);
}

}  // namespace rig
