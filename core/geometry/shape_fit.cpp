#include "core/geometry/shape_fit.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

// A step that leaves more than this of the step before came from a matrix that no longer fits.
constexpr double kStaleShare = 0.25;       // of the squared length
constexpr double kLeftShare = 0.25;        // of the limit's square, for a step that is foretold
constexpr double kStaleSigmas = 1e-3;      // shorter steps are rounding
constexpr double kLeastStepSigmas = 1e-7;  // of a fit without a memory: as far as the steps lead

bool used(const Mat3& information) {
    return information(0, 0) != 0.0 || information(1, 1) != 0.0;
}

struct FitProblem {
    const ShapeModel& model;
    std::span<const Vec3> positions_mm;
    std::span<const Mat3> informations;
    const ShapePrior& prior;
    ShapePriorInformation prior_information;
};

struct PriorOffsets {
    Vec3 rotation_rad;
    Vec3 translation_mm;
};

PriorOffsets offsets_from_prior(const ShapeFit& fit, const ShapePrior& prior) {
    const Mat3 turned = fit.pose.rotation * prior.pose.rotation.transpose();
    return {vector_from_rotation(turned), fit.pose.translation_mm - prior.pose.translation_mm};
}

void place_markers(const ShapeModel& model, const ShapeFit& fit, ShapeFitWorkspace& w) {
    const std::size_t modes = model.mode_count;
    for (std::size_t j = 0; j < modes; ++j) w.coefficients[j] = static_cast<float>(fit.coefficients[j]);
    combine_rows(model.columns.data(), ShapeModel::kColumnStride, w.coefficients.data(), modes,
                 3U * model.marker_count, nullptr, w.moved_mm.data());
    const Mat3 rotation = fit.pose.rotation;
    const Vec3 shift = fit.pose.translation_mm;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const float* moved = w.moved_mm.data() + 3 * k;
        const Vec3 q = model.mean_mm[k] + Vec3{static_cast<double>(moved[0]), static_cast<double>(moved[1]),
                                               static_cast<double>(moved[2])};
        w.face_mm[k] = q;
        const Vec3 turned = rotation * q;
        w.headset_mm[k] = turned + shift;
    }
}

// Downhill direction of half the objective at the placed markers, in the unknowns of ShapeInformation.
void fill_right(const FitProblem& p, const ShapeFit& fit, ShapeFitWorkspace& w) {
    const std::size_t modes = p.model.mode_count;
    const Mat3 face_from_headset = fit.pose.rotation.transpose();
    Vec3 turn = Vec3::Zero();
    Vec3 shift = Vec3::Zero();
    for (std::size_t k = 0; k < p.model.marker_count; ++k) {
        float* out = w.pull.data() + 3 * k;
        if (!used(p.informations[k])) {
            out[0] = out[1] = out[2] = 0.0F;
            continue;
        }
        const Vec3 e = p.positions_mm[k] - w.headset_mm[k];
        const Vec3 weighted = p.informations[k] * e;
        const Vec3 pull = face_from_headset * weighted;
        for (std::size_t a = 0; a < 3; ++a) out[a] = static_cast<float>(pull[static_cast<Eigen::Index>(a)]);
        turn += w.face_mm[k].cross(pull);
        shift += pull;
    }
    combine_rows(p.model.rows.data(), kMaxModes, w.pull.data(), 3U * p.model.marker_count, modes, nullptr,
                 w.slope.data());
    const PriorOffsets offsets = offsets_from_prior(fit, p.prior);
    turn -= p.prior_information.by_rotation * (face_from_headset * offsets.rotation_rad);
    shift -= p.prior_information.by_translation * (face_from_headset * offsets.translation_mm);
    for (std::size_t j = 0; j < modes; ++j) {
        w.right[j] = static_cast<double>(w.slope[j]) -
                     p.prior_information.by_mode * (fit.coefficients[j] - p.prior.coefficients[j]);
    }
    for (std::size_t a = 0; a < 3; ++a) {
        w.right[modes + a] = turn[static_cast<Eigen::Index>(a)];
        w.right[modes + 3 + a] = shift[static_cast<Eigen::Index>(a)];
    }
}

double objective_of(const FitProblem& p, const ShapeFit& fit, const ShapeFitWorkspace& w) {
    double sum = 0.0;
    for (std::size_t k = 0; k < p.model.marker_count; ++k) {
        if (!used(p.informations[k])) continue;
        const Vec3 e = p.positions_mm[k] - w.headset_mm[k];
        const Vec3 weighted = p.informations[k] * e;
        sum += e.dot(weighted);
    }
    const PriorOffsets offsets = offsets_from_prior(fit, p.prior);
    sum += p.prior_information.by_rotation * offsets.rotation_rad.squaredNorm();
    sum += p.prior_information.by_translation * offsets.translation_mm.squaredNorm();
    for (std::size_t j = 0; j < p.model.mode_count; ++j) {
        const double d = fit.coefficients[j] - p.prior.coefficients[j];
        sum += p.prior_information.by_mode * d * d;
    }
    return sum;
}

bool prepare_factor(const FitProblem& p, const ShapeFit& fit, const ShapeTolerance& tolerance,
                    const ShapeFitWorkspace& w, ShapeFitMemory& memory) {
    if (follow_markers(p.model, fit.pose.rotation, w.face_mm, p.informations, tolerance,
                       memory.information)) {
        memory.factor.modes_done = false;
    }
    return factor_shape(memory.information, p.model.mode_count, p.prior_information, memory.factor);
}

// As the markers stand now, every one of them.
bool prepare_anew(const FitProblem& p, const ShapeFit& fit, const ShapeFitWorkspace& w,
                  ShapeFitMemory& memory) {
    forget(memory);
    return prepare_factor(p, fit, {}, w, memory);
}

void take_step(const ShapeModel& model, const ShapeFitWorkspace& w, ShapeFit& fit) {
    const double* step = w.right.data() + model.mode_count;
    const Mat3 turned = fit.pose.rotation * rotation_from_vector(Vec3{step[0], step[1], step[2]});
    const Vec3 shift = fit.pose.rotation * Vec3{step[3], step[4], step[5]};
    fit.pose.rotation = orthonormalised(turned);
    fit.pose.translation_mm += shift;
    for (std::size_t j = 0; j < model.mode_count; ++j) fit.coefficients[j] += w.right[j];
}

// False when the normal equations cannot be solved.
bool iterate(const FitProblem& p, const ShapeFitLimits& limits, ShapeFitMemory& memory, ShapeFitWorkspace& w,
             ShapeFit& fit) {
    double before = 0.0;
    double shrank = 1.0;  // the step before, of the one before it: squared lengths
    if (!prepare_factor(p, fit, {}, w, memory) && !prepare_anew(p, fit, w, memory)) return false;
    for (int step = 0; step < limits.steps; ++step) {
        fill_right(p, fit, w);
        double squared = solve_shape(memory.factor, p.model.mode_count, w.right.data());
        const bool stale =
            step > 0 && squared > kStaleShare * before && squared > kStaleSigmas * kStaleSigmas;
        if (stale || !is_finite(squared)) {
            if (!prepare_anew(p, fit, w, memory)) return false;
            fill_right(p, fit, w);
            squared = solve_shape(memory.factor, p.model.mode_count, w.right.data());
            if (!is_finite(squared)) return false;
        }
        take_step(p.model, w, fit);
        place_markers(p.model, fit, w);
        const double limit = limits.step_sigmas * limits.step_sigmas;
        const double shrinks = step > 0 ? squared / before : 1.0;
        // Steps shrink alike, so the next one can be told from these.
        if (squared < limit || (step > 1 && std::max(shrinks, shrank) * squared < kLeftShare * limit)) break;
        before = squared;
        shrank = shrinks;
    }
    return true;
}

}  // namespace

void forget(ShapeFitMemory& memory) {
    memory.information.built = false;
    memory.factor.modes_done = false;
}

void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, const ShapeFitLimits& limits,
               const ShapeFit& start, ShapeFitMemory& memory, ShapeFitWorkspace& w, ShapeFit& fit) {
    RIG_CHECK(positions_mm.size() == model.marker_count && informations.size() == model.marker_count);
    const FitProblem problem{model,
                             positions_mm,
                             informations,
                             prior,
                             {1.0 / (prior.coefficient_sigma * prior.coefficient_sigma),
                              1.0 / (prior.rotation_sigma_rad * prior.rotation_sigma_rad),
                              1.0 / (prior.translation_sigma_mm * prior.translation_sigma_mm)}};
    fit = start;
    place_markers(model, fit, w);
    fit.ok = iterate(problem, limits, memory, w, fit);
    if (!fit.ok) {
        forget(memory);
        fit.pose = prior.pose;
        fit.coefficients = prior.coefficients;
        place_markers(model, fit, w);
    }
    fit.objective = objective_of(problem, fit, w);
}

void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, int steps, const ShapeFit& start,
               ShapeFitWorkspace& w, ShapeFit& fit) {
    forget(w.memory);
    fit_shape(model, positions_mm, informations, prior, {steps, kLeastStepSigmas}, start, w.memory, w, fit);
}

Mat3 fitted_covariance(const ShapeModel& model, std::size_t marker, const ShapeFitMemory& memory,
                       ShapeFitWorkspace& w) {
    const std::size_t modes = model.mode_count;
    const Vec3& q = w.face_mm[marker];
    const double turns[3][3] = {{0.0, q[2], -q[1]}, {-q[2], 0.0, q[0]}, {q[1], -q[0], 0.0}};
    const float* rows = model.rows.data() + 3 * marker * kMaxModes;
    Mat3 covariance;
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t j = 0; j < modes; ++j) w.right[j] = static_cast<double>(rows[a * kMaxModes + j]);
        for (std::size_t c = 0; c < 3; ++c) {
            w.right[modes + c] = turns[a][c];
            w.right[modes + 3 + c] = a == c ? 1.0 : 0.0;
        }
        const double own = solve_shape(memory.factor, modes, w.right.data());
        for (std::size_t b = 0; b < 3; ++b) {
            double sum = dot(rows + b * kMaxModes, w.right.data(), modes) + w.right[modes + 3 + b];
            for (std::size_t c = 0; c < 3; ++c) sum += turns[b][c] * w.right[modes + c];
            covariance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) = a == b ? own : sum;
        }
    }
    return covariance;
}

}  // namespace rig
