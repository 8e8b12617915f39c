#include "core/solve/confidence.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"
#include "core/solve/square_terms.hpp"

namespace rig {

namespace {

constexpr std::uint16_t kMostFollowed = 1024;  // rank-one terms before P is made anew
// Of 1 - z^T P z. A marker that alone holds a direction leaves that little when it goes, and the digits of
// what is left go with it: making P anew is the sharper way.
constexpr double kLeastLeft = 1e-6;

class PosteriorFollower {
  public:
    PosteriorFollower(const SolvePack& pack, const NormalTables<double>& tables, ConfidenceState& state,
                      ConfidenceWorkspace& workspace)
        : pack_(pack),
          n_(pack.shape_count),
          stride_(row_stride(pack.shape_count)),
          per_noise_(1.0 / static_cast<double>(pack.noise_mm)),
          tables_(tables),
          s_(state),
          w_(workspace) {}

    void follow(std::span<const Mat3> weights) {
        std::size_t changed = 0;
        for (std::size_t k = 0; k < weights.size(); ++k) changed += weights[k] != s_.weights[k] ? 1 : 0;
        if (s_.valid && changed == 0) return;
        if (!s_.valid || 6 * changed > n_ || s_.followed > kMostFollowed) {
            make(weights);
            return;
        }
        bool in_step = true;
        for (std::size_t k = 0; k < weights.size(); ++k) {
            if (weights[k] == s_.weights[k]) continue;
            for_each_square(weights[k] - s_.weights[k], [&](const Vec3& l, bool add) {
                make_term(k, l);
                in_step = in_step && apply_term(add);
            });
            s_.weights[k] = weights[k];
        }
        if (!in_step) make(weights);
    }

  private:
    // P by Cholesky's factor of its inverse, which starts from all markers or from none.
    void make(std::span<const Mat3> weights) {
        std::size_t plain = 0;
        for (const Mat3& v : weights) plain += v == Mat3::Identity() ? 1 : 0;
        const bool from_all = 2 * plain > weights.size();
        const double scale = from_all ? per_noise_ * per_noise_ : 0.0;
        for (std::size_t i = 0; i < n_ * stride_; ++i) w_.factor[i] = scale * tables_.full_gram[i];
        for (std::size_t i = 0; i < n_; ++i) {
            const auto sigma = static_cast<double>(pack_.prior_sigma[i]);
            w_.factor[i * stride_ + i] += 1.0 / (sigma * sigma);
        }
        for (std::size_t k = 0; k < weights.size(); ++k) {
            s_.weights[k] = weights[k];
            const Mat3 start = from_all ? Mat3(Mat3::Identity()) : Mat3(Mat3::Zero());
            for_each_square(weights[k] - start, [&](const Vec3& l, bool add) {
                make_term(k, l);
                if (add) {
                    add_square(w_.factor.data(), stride_, n_, w_.term.data());
                } else {
                    subtract_square(w_.factor.data(), stride_, n_, w_.term.data());
                }
            });
        }
        s_.followed = 0;
        s_.valid = cholesky(w_.factor.data(), w_.factor.data(), n_, stride_);
        if (s_.valid) symmetric_inverse(w_.factor.data(), n_, stride_, s_.posterior.data(), w_.term.data());
    }

    void make_term(std::size_t k, const Vec3& l) {
        const std::array<double, 3> factor{l[0] * per_noise_, l[1] * per_noise_, l[2] * per_noise_};
        combine_rows(tables_.basis_mm.data() + 3 * k * stride_, stride_, factor.data(), 3, padded(n_),
                     nullptr, w_.term.data());
    }

    // P^-1 +- z z^T.
    bool apply_term(bool add) {
        combine_rows(s_.posterior.data(), stride_, w_.term.data(), n_, padded(n_), nullptr,
                     w_.product.data());
        const double reach = padded_dot(w_.term.data(), w_.product.data(), padded(n_));
        const double left = add ? 1.0 + reach : 1.0 - reach;
        if (!(left > kLeastLeft)) return false;
        const double root = 1.0 / std::sqrt(left);
        for (std::size_t i = 0; i < n_; ++i) w_.product[i] *= root;
        if (add) {
            subtract_square(s_.posterior.data(), stride_, n_, w_.product.data());
        } else {
            add_square(s_.posterior.data(), stride_, n_, w_.product.data());
        }
        ++s_.followed;
        return true;
    }

    const SolvePack& pack_;
    std::size_t n_;
    std::size_t stride_;
    double per_noise_;
    const NormalTables<double>& tables_;
    ConfidenceState& s_;
    ConfidenceWorkspace& w_;
};

}  // namespace

void follow_confidence(const SolvePack& pack, const NormalTables<double>& tables,
                       std::span<const Mat3> weights, ConfidenceState& state,
                       ConfidenceWorkspace& workspace) {
    RIG_CHECK(weights.size() == pack.marker_count);
    PosteriorFollower(pack, tables, state, workspace).follow(weights);
}

void read_confidence(const SolvePack& pack, const ConfidenceState& state, std::span<float> confidence) {
    const std::size_t n = pack.shape_count;
    RIG_CHECK(confidence.size() >= n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto sigma = static_cast<double>(pack.prior_sigma[i]);
        confidence[i] =
            state.valid ? confidence_of(state.posterior[i * row_stride(n) + i], sigma * sigma) : 0.0F;
    }
}

float region_confidence(std::span<const float> prior_sigma, std::span<const float> confidence,
                        std::span<const std::size_t> shapes) {
    double posterior = 0.0;
    double prior = 0.0;
    for (const std::size_t i : shapes) {
        const auto sigma = static_cast<double>(prior_sigma[i]);
        const double left = sigma * (1.0 - static_cast<double>(confidence[i]));
        posterior += left * left;
        prior += sigma * sigma;
    }
    return prior > 0.0 ? confidence_of(posterior, prior) : 0.0F;
}

}  // namespace rig
