#include "core/infer/mode_posterior.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/float_kernels.hpp"

namespace rig {

namespace {

constexpr std::size_t kStride = ModePosterior::kStride;
constexpr std::size_t kColumns = 3 * ModePosterior::kTogether;
static_assert(kColumns % kLaneFloats == 0);
// Of a measured marker's weight: what is left of one below it is rounding.
constexpr double kLeastShare = 1e-12;

// A positive semi-definite matrix as a sum of v v^T.
struct Squares {
    std::size_t count = 0;
    std::array<Vec3, 3> term{};
};

// Pivoted Cholesky factor, until less than `least` is left on the diagonal.
Squares squares_of(Mat3 rest, double least) {
    Squares out;
    while (out.count < 3) {
        Eigen::Index at = 0;
        if (rest(1, 1) > rest(at, at)) at = 1;
        if (rest(2, 2) > rest(at, at)) at = 2;
        if (!(rest(at, at) > least)) return out;
        const Vec3 v = rest.col(at) / std::sqrt(rest(at, at));
        rest -= v * v.transpose();
        out.term[out.count++] = v;
    }
    return out;
}

using Base = ModePosterior::Base;

Base base_of(const FaceGaussian& face, const ModePosterior& p) {
    std::size_t known = 0;
    std::size_t missing = 0;
    for (std::size_t k = 0; k < face.marker_count; ++k) {  // terms; a single ray is two, and lacks one
        known += p.knowledge[k] == MarkerKnowledge::kHidden ? 0U : 2U;
        known += p.knowledge[k] == MarkerKnowledge::kMeasured ? 1U : 0U;
        missing += p.knowledge[k] == MarkerKnowledge::kMeasured ? 0U : 1U;
        missing += p.knowledge[k] == MarkerKnowledge::kHidden ? 2U : 0U;
    }
    return missing <= known ? Base::kMeasuredFace : Base::kNothing;
}

// Adds terms of single markers to a matrix, many in one pass.
class TermSum {
  public:
    TermSum(const FaceGaussian& face, double sign, ModePosterior& p) : face_(face), p_(p) {
        p.sign.fill(sign);
    }

    void add(std::size_t marker, const Squares& squares) {
        if (count_ + squares.count > ModePosterior::kMostTerms) finish();
        for (std::size_t t = 0; t < squares.count; ++t) {
            combine_rows(face_.mode_row(3 * marker), kMaxModes, squares.term[t].data(), 3,
                         padded(face_.mode_count), nullptr, p_.terms.data() + count_++ * kStride);
        }
    }
    void finish() {
        if (count_ > 0)
            add_squares(p_.factor.data(), kStride, face_.mode_count, p_.terms.data(), p_.sign.data(), count_);
        count_ = 0;
    }

  private:
    const FaceGaussian& face_;
    ModePosterior& p_;
    std::size_t count_ = 0;
};

Squares whole_of(const FaceGaussian& face, std::size_t k) {
    const double root = std::sqrt(face.measured_weight(k));
    return {3, {root * Vec3::UnitX(), root * Vec3::UnitY(), root * Vec3::UnitZ()}};
}

// Rows of one matrix into another's, `stride` apart.
void copy_rows(std::size_t rows, const double* from, std::size_t from_stride, double* to,
               std::size_t stride) {
    for (std::size_t i = 0; i < rows; ++i) std::copy_n(from + i * from_stride, kMaxModes, to + i * stride);
}

// Fills posterior.factor with the equations of what is in the base.
void begin_equations(const FaceGaussian& face, Base base, ModePosterior& p) {
    const std::size_t d = face.mode_count;
    const MarkerKnowledge in_it =
        base == Base::kMeasuredFace ? MarkerKnowledge::kHidden : MarkerKnowledge::kMeasured;
    bool kept = p.base == base;
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        const bool in_base = p.knowledge[k] == in_it;
        kept = kept && p.in_base[k] == in_base;
        p.in_base[k] = in_base;
    }
    for (std::size_t i = 0; i < d; ++i) {
        double* row = p.factor.data() + i * kStride;
        std::fill(row, row + kStride, 0.0);
        row[i] = 1.0;
    }
    if (kept) {
        copy_rows(d, p.base_equations.data(), kMaxModes, p.factor.data(), kStride);
        return;
    }
    if (base == Base::kMeasuredFace)
        copy_rows(d, face.measured_modes.data(), kMaxModes, p.factor.data(), kStride);
    TermSum sum(face, base == Base::kMeasuredFace ? -1.0 : 1.0, p);
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        if (p.in_base[k]) sum.add(k, whole_of(face, k));
    }
    sum.finish();
    copy_rows(d, p.factor.data(), kStride, p.base_equations.data(), kMaxModes);
    p.base = base;
}

void add_partly_measured(const FaceGaussian& face, Base base, ModePosterior& p) {
    TermSum sum(face, base == Base::kMeasuredFace ? -1.0 : 1.0, p);
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        if (p.knowledge[k] != MarkerKnowledge::kPartly) continue;
        const double whole = face.measured_weight(k);
        const Mat3 lacking = whole * Mat3::Identity() - p.weight[k];
        sum.add(k, squares_of(base == Base::kMeasuredFace ? lacking : p.weight[k], kLeastShare * whole));
    }
    sum.finish();
}

// M^T K of up to kTogether markers, a column for each coordinate, zeros behind the last.
void fill_columns(const FaceGaussian& face, std::span<const std::uint16_t> markers, std::size_t width,
                  ModePosterior& p) {
    const std::size_t d = face.mode_count;
    for (std::size_t j = 0; j < d; ++j) {
        float* row = p.columns.data() + j * kColumns;
        for (std::size_t c = 3 * markers.size(); c < width; ++c) row[c] = 0.0F;
    }
    for (std::size_t t = 0; t < markers.size(); ++t) {
        const std::size_t k = markers[t];
        const double* rows = face.mode_row(3 * k);
        if (p.knowledge[k] != MarkerKnowledge::kHidden) {
            const Mat3 kept = Mat3::Identity() - face.residual_mm2[k] * p.weight[k];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Vec3 share = kept.col(static_cast<Eigen::Index>(axis));
                combine_rows(rows, kMaxModes, share.data(), 3, padded(d), nullptr,
                             p.narrowed.data() + axis * kMaxModes);
            }
            rows = p.narrowed.data();
        }
        float* out = p.columns.data() + 3 * t;
        for (std::size_t j = 0; j < d; ++j, out += kColumns) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                out[axis] = static_cast<float>(rows[axis * kMaxModes + j]);
        }
    }
}

// sum_i of the squares of (L^-1 columns)_i: L is its diagonal behind a unit lower triangle.
void add_squares_of_columns(std::size_t modes, std::size_t width, ModePosterior& p,
                            std::array<float, kColumns>& squares) {
    for (std::size_t i = 0; i < modes; ++i) {
        float* row = p.columns.data() + i * kColumns;
        combine_rows(p.columns.data(), kColumns, p.unit_lower.data() + i * kMaxModes, i, width, row, row);
        const auto share = static_cast<float>(p.scale[i] * p.scale[i]);
        for (std::size_t c = 0; c < width; ++c) squares[c] += share * (row[c] * row[c]);
    }
}

}  // namespace

void reset_modes(ModePosterior& p) {
    p.base = Base::kNone;
}

bool factor_modes(const FaceGaussian& face, ModePosterior& p) {
    const std::size_t d = face.mode_count;
    const Base base = base_of(face, p);
    begin_equations(face, base, p);
    add_partly_measured(face, base, p);
    if (!upper_factor(p.factor.data(), 0, d, d, kStride, p.scratch.data())) return false;
    for (std::size_t j = 0; j < d; ++j) {
        const double* row = p.factor.data() + j * kStride;
        p.scale[j] = 1.0 / row[j];
        for (std::size_t i = j + 1; i < d; ++i)
            p.unit_lower[i * kMaxModes + j] = static_cast<float>(-p.scale[j] * row[i]);
    }
    return true;
}

void solve_modes(const FaceGaussian& face, const ModePosterior& p, double* x) {
    const std::size_t d = face.mode_count;
    for (std::size_t i = 0; i < d; ++i) {
        x[i] *= p.scale[i];
        add_scaled(x + i + 1, -x[i], p.factor.data() + i * kStride + i + 1, d - i - 1);
    }
    for (std::size_t i = d; i-- > 0;) {
        const double* row = p.factor.data() + i * kStride;
        x[i] = (x[i] - dot(row + i + 1, x + i + 1, d - i - 1)) * p.scale[i];
    }
}

void find_variances(const FaceGaussian& face, std::span<const std::uint16_t> markers, ModePosterior& p,
                    std::array<double, kMaxMarkers>& variance_mm2) {
    const std::size_t d = face.mode_count;
    for (std::size_t first = 0; first < markers.size(); first += ModePosterior::kTogether) {
        const std::span<const std::uint16_t> together =
            markers.subspan(first, std::min(ModePosterior::kTogether, markers.size() - first));
        const std::size_t width = padded(3 * together.size());
        fill_columns(face, together, width, p);
        std::array<float, kColumns> squares{};
        add_squares_of_columns(d, width, p, squares);
        for (std::size_t t = 0; t < together.size(); ++t) {
            const std::size_t k = together[t];
            const double r = face.residual_mm2[k];
            variance_mm2[k] = r * (3.0 - r * p.weight[k].trace()) +
                              static_cast<double>(squares[3 * t] + squares[3 * t + 1] + squares[3 * t + 2]);
        }
    }
}

}  // namespace rig
