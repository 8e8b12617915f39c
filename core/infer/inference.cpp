#include "core/infer/inference.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/float_kernels.hpp"
#include "core/geometry/triangulation.hpp"

namespace rig {

namespace {

constexpr double kSmallestDepthShare =
    1e-6;                            // of a marker's mean information: below it the depth was not measured
constexpr double kWeakPrior = 0.01;  // of a marker's mean information
// A marker counts as measured when it is known at least half as well as the pack expects along every axis.
constexpr double kMeasuredShare = 0.25;
constexpr double kRayShare = 1e-9;  // of what is known across a ray: more of it along the ray is a second ray
constexpr double kFarthestSpreads = 6.0;  // from the mean face; a Gaussian is there once in 1e8 frames

constexpr std::size_t kStride = InferenceWorkspace::kStride;
using Prepared = InferenceWorkspace::Prepared;

struct Census {
    std::size_t hidden = 0;
    std::size_t partly = 0;
};

bool is_at_least(const Mat3& information, double floor) {
    const Mat3 rest = information - floor * Mat3::Identity();
    const double two = rest(0, 0) * rest(1, 1) - rest(0, 1) * rest(1, 0);
    return rest(0, 0) >= 0.0 && two >= 0.0 && rest.determinant() >= 0.0;
}

// What it weighs depends on this marker alone: were it taken for better known because others are hidden, a
// confidence could rise when a marker is hidden.
MarkerKnowledge knowledge_of(const StabilisedMarker& marker, double nominal) {
    if (!marker.seen || !(marker.information.trace() > 0.0)) return MarkerKnowledge::kHidden;
    return is_at_least(marker.information, kMeasuredShare * nominal) ? MarkerKnowledge::kMeasured
                                                                     : MarkerKnowledge::kPartly;
}

// Across a single ray and as well known in every direction there: A = a (I - d d^T), a half the trace.
bool is_across_one_ray(const Mat3& information) {
    const double across = 0.5 * information.trace();
    const Mat3 along = across * Mat3::Identity() - information;
    Eigen::Index at = 0;
    if (along(1, 1) > along(at, at)) at = 1;
    if (along(2, 2) > along(at, at)) at = 2;
    const Vec3 column = along.col(at);
    const Mat3 rest = along - column * column.transpose() / along(at, at);
    return rest.cwiseAbs().maxCoeff() <= kRayShare * across;
}

// No eigenvalue is larger; of a single ray it is the largest.
double largest_information(const Mat3& information) {
    if (is_across_one_ray(information)) return 0.5 * information.trace();
    return (information.cwiseAbs() * Vec3::Ones()).maxCoeff();
}

// Of a partly measured marker, about modes' prediction: A (I + r A)^-1, A scaled down where it claims more
// than a measured marker has.
Mat3 partial_weight(const Mat3& information, double nominal, double residual_mm2) {
    const Mat3 capped = information * std::min(1.0, nominal / largest_information(information));
    const Mat3 grown = Mat3::Identity() + residual_mm2 * capped;
    const Mat3 weight = capped * inverse_3x3(grown);
    return 0.5 * (weight + weight.transpose());
}

// Multiply-adds of the two ways, for this many hidden markers.
bool precision_is_cheaper(const FaceGaussian& face, std::size_t hidden) {
    const std::size_t n = 3 * hidden;
    const std::size_t d = face.mode_count;
    const std::size_t terms = std::min(n, 3U * face.marker_count - n);
    if (n > InferenceWorkspace::kMaxHiddenRows) return false;
    return n * n * n / 3 <= terms * d * d / 2 + d * d * d / 6 + n * d * d / 2;
}

// x := L^-T L^-1 right, through `half`.
void solve_prepared(std::size_t n, InferenceWorkspace& w, double* x) {
    for (std::size_t i = 0; i < n; ++i)
        w.half[i] = dot(w.inverse.data() + i * kStride, w.right.data(), i + 1);
    combine_rows(w.inverse.data(), kStride, w.half.data(), n, n, nullptr, x);
}

std::size_t hidden_row(const InferenceWorkspace& w, std::size_t i) {
    return 3U * w.hidden[i / 3] + i % 3;
}

// Conditional of the hidden rows h given the others: covariance (Q_hh)^-1, mean -(Q_hh)^-1 Q_hs e_s.
bool prepare_by_precision(const FaceGaussian& face, std::size_t hidden, InferenceWorkspace& w) {
    const std::size_t n = 3 * hidden;
    for (std::size_t i = 0; i < n; ++i) {
        const double* q = face.precision.data() + hidden_row(w, i) * kMaxRows;
        for (std::size_t b = i / 3; b < hidden; ++b)
            std::copy_n(q + 3U * w.hidden[b], 3, w.system.data() + i * kStride + 3 * b);
    }
    if (!inverse_of_factor(w.system.data(), n, kStride, w.inverse.data(), w.half.data())) return false;
    // The diagonal of the covariance: the squares of each column of L^-1.
    std::fill_n(w.right.data(), n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
        const double* row = w.inverse.data() + i * kStride;
        for (std::size_t j = 0; j <= i; ++j) w.right[j] += row[j] * row[j];
    }
    for (std::size_t i = 0; i < hidden; ++i) {
        // The conditional is that of another measurement; its noise is not the marker's.
        w.variance_mm2[w.hidden[i]] =
            w.right[3 * i] + w.right[3 * i + 1] + w.right[3 * i + 2] - 3.0 * face.noise_mm2;
    }
    return true;
}

// The coefficients' normal equations, and the variance of what is not measured whole.
bool prepare_by_modes(const FaceGaussian& face, const StabiliserOutput& stabilised, const Census& census,
                      InferenceWorkspace& w) {
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        Mat3& weight = w.modes.weight[k];
        switch (w.modes.knowledge[k]) {
            case MarkerKnowledge::kHidden:
                weight = Mat3::Zero();
                break;
            case MarkerKnowledge::kPartly:
                weight = partial_weight(stabilised.markers[k].information, 1.0 / face.noise_mm2,
                                        face.residual_mm2[k]);
                break;
            case MarkerKnowledge::kMeasured:
                weight = face.measured_weight(k) * Mat3::Identity();
                break;
        }
    }
    if (!factor_modes(face, w.modes)) return false;
    find_variances(face, std::span(w.unmeasured).first(census.hidden + census.partly), w.modes,
                   w.variance_mm2);
    return true;
}

Vec3 within_reach(const FaceGaussian& face, std::size_t k, const Vec3& position_mm) {
    const Vec3 offset = position_mm - face.mean_mm[k];
    const double reach = kFarthestSpreads * std::sqrt(face.prior_mm2[k]);
    const double length = std::sqrt(offset.dot(offset));
    if (length <= reach) return position_mm;
    if (!(length < 1e150)) return face.mean_mm[k];  // also NaN: what was measured is no face
    return face.mean_mm[k] + (reach / length) * offset;
}

// Measured where it was measured, inferred elsewhere. A weak prior decides only what was not measured.
Vec3 with_own_measurement(const StabilisedMarker& marker, const Vec3& inferred_mm) {
    const double mean = marker.information.trace() / 3.0;
    const bool full_rank = marker.information.determinant() > kSmallestDepthShare * mean * mean * mean;
    if (full_rank) return marker.position_mm;
    const Mat3 system = marker.information + kWeakPrior * mean * Mat3::Identity();
    const Vec3 offset = marker.information * (marker.position_mm - inferred_mm);
    return inferred_mm + inverse_3x3(system) * offset;
}

void put(const FaceGaussian& face, const StabilisedMarker& marker, std::size_t k, const Vec3& estimate_mm,
         double variance_mm2, InferenceOutput& output) {
    const Vec3 inferred = within_reach(face, k, estimate_mm);
    const double usual = face.prior_mm2[k];
    const double variance = std::clamp(variance_mm2, 0.0, usual);
    output.position_mm[k] =
        marker.seen && marker.information.trace() > 0.0 ? with_own_measurement(marker, inferred) : inferred;
    output.deviation_mm[k] = static_cast<float>(std::sqrt(variance));
    output.confidence[k] = usual > 0.0 ? static_cast<float>(1.0 - std::sqrt(variance / usual)) : 1.0F;
}

Census classify(const FaceGaussian& face, const StabiliserOutput& stabilised, InferenceWorkspace& w) {
    const double nominal = 1.0 / face.noise_mm2;
    Census census;
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        const StabilisedMarker& marker = stabilised.markers[k];
        const MarkerKnowledge knowledge = knowledge_of(marker, nominal);
        w.modes.knowledge[k] = knowledge;
        if (knowledge != MarkerKnowledge::kMeasured)
            w.unmeasured[census.hidden + census.partly] = static_cast<std::uint16_t>(k);
        if (knowledge == MarkerKnowledge::kHidden) w.hidden[census.hidden++] = static_cast<std::uint16_t>(k);
        if (knowledge == MarkerKnowledge::kPartly) ++census.partly;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<Eigen::Index>(axis);
            w.error_mm[3 * k + axis] =
                knowledge == MarkerKnowledge::kHidden ? 0.0 : marker.position_mm[at] - face.mean_mm[k][at];
        }
    }
    return census;
}

void put_by_precision(const FaceGaussian& face, const StabiliserOutput& stabilised, std::size_t hidden,
                      InferenceWorkspace& w, InferenceOutput& output) {
    const std::size_t n = 3 * hidden;
    for (std::size_t i = 0; i < n; ++i) {
        const double* q = face.precision.data() + hidden_row(w, i) * kMaxRows;
        w.right[i] = -padded_dot(q, w.error_mm.data(), padded(3U * face.marker_count));
    }
    solve_prepared(n, w, w.right.data());
    for (std::size_t i = 0; i < hidden; ++i) {
        const std::size_t k = w.hidden[i];
        const Vec3 offset{w.right[3 * i], w.right[3 * i + 1], w.right[3 * i + 2]};
        put(face, stabilised.markers[k], k, face.mean_mm[k] + offset, w.variance_mm2[k], output);
    }
}

// Mean of x: K M c + r W y.
void put_by_modes(const FaceGaussian& face, const StabiliserOutput& stabilised, const Census& census,
                  InferenceWorkspace& w, InferenceOutput& output) {
    const std::size_t rows = 3U * face.marker_count;
    const std::size_t d = face.mode_count;
    const auto error_of = [&](std::size_t k) {
        return Vec3{w.error_mm[3 * k], w.error_mm[3 * k + 1], w.error_mm[3 * k + 2]};
    };
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        const Vec3 weighted = w.modes.weight[k] * error_of(k);
        for (std::size_t axis = 0; axis < 3; ++axis)
            w.half[3 * k + axis] = weighted[static_cast<Eigen::Index>(axis)];
    }
    combine_rows(face.modes.data(), kMaxModes, w.half.data(), rows, padded(d), nullptr, w.right.data());
    solve_modes(face, w.modes, w.right.data());
    for (std::size_t i = 0; i < census.hidden + census.partly; ++i) {
        const std::size_t k = w.unmeasured[i];
        Vec3 predicted;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            predicted[static_cast<Eigen::Index>(axis)] =
                padded_dot(face.mode_row(3 * k + axis), w.right.data(), padded(d));
        }
        const Mat3 own = face.residual_mm2[k] * w.modes.weight[k];
        const Vec3 correction = own * (error_of(k) - predicted);
        put(face, stabilised.markers[k], k, face.mean_mm[k] + predicted + correction, w.variance_mm2[k],
            output);
    }
}

// What hides where decides all that prepare() works out, unless a marker is partly measured.
bool is_prepared(const FaceGaussian& face, const Census& census, const InferenceWorkspace& w) {
    return w.prepared != Prepared::kNothing && census.partly == 0 &&
           std::equal(w.modes.knowledge.begin(), w.modes.knowledge.begin() + face.marker_count,
                      w.prepared_for.begin());
}

void prepare(const FaceGaussian& face, const StabiliserOutput& stabilised, const Census& census,
             InferenceWorkspace& w) {
    w.prepared = Prepared::kNothing;
    if (census.partly == 0 && precision_is_cheaper(face, census.hidden) &&
        prepare_by_precision(face, census.hidden, w)) {
        w.prepared = Prepared::kPrecision;
    } else if (prepare_by_modes(face, stabilised, census, w)) {
        w.prepared = Prepared::kModes;
    }
    w.prepared_for = w.modes.knowledge;
}

}  // namespace

void reset_inference(InferenceWorkspace& workspace) {
    workspace.prepared = Prepared::kNothing;
    reset_modes(workspace.modes);
    workspace.error_mm.fill(0.0);
}

void infer_missing(const FaceGaussian& face, const StabiliserOutput& stabilised, InferenceWorkspace& w,
                   InferenceOutput& output) {
    RIG_CHECK(stabilised.count == face.marker_count);
    output.count = stabilised.count;
    output.inferred = 0;
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        if (!stabilised.markers[k].seen) ++output.inferred;
        output.position_mm[k] = stabilised.markers[k].position_mm;
        output.confidence[k] = 1.0F;
        output.deviation_mm[k] = 0.0F;
    }
    const Census census = classify(face, stabilised, w);
    if (census.hidden + census.partly == 0) return;
    if (!is_prepared(face, census, w)) prepare(face, stabilised, census, w);
    switch (w.prepared) {
        case Prepared::kPrecision:
            put_by_precision(face, stabilised, census.hidden, w, output);
            return;
        case Prepared::kModes:
            put_by_modes(face, stabilised, census, w, output);
            return;
        case Prepared::kNothing:  // not positive definite to working precision: the mean face
            break;
    }
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        if (w.modes.knowledge[k] == MarkerKnowledge::kMeasured) continue;
        put(face, stabilised.markers[k], k, face.mean_mm[k], face.prior_mm2[k], output);
    }
}

}  // namespace rig
