#include "core/geometry/shape_information.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr std::size_t kStride = ShapeInformation::kStride;
// Floats taken out and put in leave 6e-8 of a marker each time; after this many the matrix is built anew.
constexpr std::uint16_t kMostChanges = 512;
constexpr std::size_t kUnknowns = 4;

double largest_entry(const Mat3& a) {
    return a.cwiseAbs().maxCoeff();
}

// Columns [ -[q]x | I ] of a marker's motion, as they stand behind those of the modes.
struct PoseColumns {
    float entry[6][3];
};

PoseColumns pose_columns(const Vec3& q_mm) {
    const auto x = static_cast<float>(q_mm[0]);
    const auto y = static_cast<float>(q_mm[1]);
    const auto z = static_cast<float>(q_mm[2]);
    return {{{0.0F, -z, y},
             {z, 0.0F, -x},
             {-y, x, 0.0F},
             {1.0F, 0.0F, 0.0F},
             {0.0F, 1.0F, 0.0F},
             {0.0F, 0.0F, 1.0F}}};
}

// Adds J^T W J of one marker, W symmetric, face frame.
void add_marker(const ShapeModel& model, std::size_t marker, const Vec3& q_mm, const Mat3& w,
                ShapeInformation& s) {
    const std::size_t modes = model.mode_count;
    const PoseColumns pose = pose_columns(q_mm);
    for (std::size_t r = 0; r < 3; ++r) {
        const auto at = static_cast<Eigen::Index>(r);
        const float row[3] = {static_cast<float>(w(at, 0)), static_cast<float>(w(at, 1)),
                              static_cast<float>(w(at, 2))};
        float* out = s.weighted.data() + r * kStride;
        combine_rows(model.rows.data() + 3 * marker * kMaxModes, kMaxModes, row, 3, modes, nullptr, out);
        for (std::size_t c = 0; c < 6; ++c) {
            const float* p = pose.entry[c];
            out[modes + c] = (row[0] * p[0] + row[1] * p[1]) + row[2] * p[2];
        }
        for (std::size_t c = modes + 6; c < kStride; ++c) out[c] = 0.0F;
    }
    add_triple(s.matrix.data(), kStride, {model.columns.data() + 3 * marker, ShapeModel::kColumnStride}, 0,
               modes, modes + 6, s.weighted.data());
    add_triple(s.matrix.data(), kStride, {pose.entry[0], 3}, modes, modes + 6, modes + 6, s.weighted.data());
}

void begin(const Mat3& rotation, std::size_t markers, ShapeInformation& s) {
    s.built = true;
    s.changes = 0;
    s.rotation = rotation;
    s.matrix.fill(0.0F);
    for (std::size_t k = 0; k < markers; ++k) s.informations[k] = Mat3::Zero();
}

bool turned_too_far(const Mat3& a, const Mat3& b, double limit_rad) {
    // |R - S| of Frobenius is 2 sqrt(2) sin(angle / 2).
    return (a - b).squaredNorm() > 2.0 * limit_rad * limit_rad;
}

}  // namespace

bool follow_markers(const ShapeModel& model, const Mat3& rotation, std::span<const Vec3> face_mm,
                    std::span<const Mat3> informations, const ShapeTolerance& tolerance,
                    ShapeInformation& s) {
    RIG_CHECK(face_mm.size() >= model.marker_count && informations.size() >= model.marker_count);
    bool changed = false;
    if (!s.built || s.changes > kMostChanges ||
        turned_too_far(rotation, s.rotation, tolerance.rotation_rad)) {
        begin(rotation, model.marker_count, s);
        changed = true;
    }
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const double held = largest_entry(s.informations[k]);
        const double now = largest_entry(informations[k]);
        if (held == 0.0 && now == 0.0) continue;
        const bool moved = (face_mm[k] - s.positions_mm[k]).cwiseAbs().maxCoeff() > tolerance.position_mm;
        const Mat3 difference = informations[k] - s.informations[k];
        if (!moved && held > 0.0 && largest_entry(difference) <= tolerance.information_share * held) continue;
        if (moved && held > 0.0) {
            const Mat3 out = s.rotation.transpose() * s.informations[k] * s.rotation;
            add_marker(model, k, s.positions_mm[k], -out, s);
        }
        const bool afresh = moved || held == 0.0;
        if (afresh) s.positions_mm[k] = face_mm[k];
        const Mat3 put = s.rotation.transpose() * (afresh ? informations[k] : difference) * s.rotation;
        add_marker(model, k, s.positions_mm[k], put, s);
        s.informations[k] = informations[k];
        s.changes = static_cast<std::uint16_t>(s.changes + 1);
        changed = true;
    }
    return changed;
}

bool factor_shape(const ShapeInformation& information, std::size_t mode_count,
                  const ShapePriorInformation& prior, ShapeFactor& factor) {
    const std::size_t size = mode_count + 6;
    const bool keep = factor.modes_done && factor.by_mode == prior.by_mode;
    const std::size_t from = keep ? mode_count : 0;
    for (std::size_t i = from; i < size; ++i) {
        double* row = factor.upper.data() + i * ShapeFactor::kStride;
        const float* source = information.matrix.data() + i * kStride;
        for (std::size_t c = i; c < size; ++c) row[c] = static_cast<double>(source[c]);
        for (std::size_t c = size; c < size + kLaneFloats; ++c) row[c] = 0.0;
        row[i] +=
            i < mode_count ? prior.by_mode : (i < mode_count + 3 ? prior.by_rotation : prior.by_translation);
    }
    std::array<double, ShapeInformation::kSize> scratch{};
    factor.by_mode = prior.by_mode;
    factor.modes_done =
        keep || upper_factor(factor.upper.data(), 0, mode_count, size, ShapeFactor::kStride, scratch.data());
    return factor.modes_done &&
           upper_factor(factor.upper.data(), mode_count, size, size, ShapeFactor::kStride, scratch.data());
}

double solve_shape(const ShapeFactor& factor, std::size_t mode_count, double* x) {
    const std::size_t size = mode_count + 6;
    double squares = 0.0;
    // Four unknowns leave the rest in one pass, in the order of single ones.
    for (std::size_t first = 0; first < size; first += kUnknowns) {
        const std::size_t end = first + kUnknowns < size ? first + kUnknowns : size;
        double taken[kUnknowns] = {};
        for (std::size_t i = first; i < end; ++i) {
            const double* row = factor.upper.data() + i * ShapeFactor::kStride;
            x[i] /= row[i];
            squares += x[i] * x[i];
            taken[i - first] = -x[i];
            for (std::size_t j = i + 1; j < end; ++j) x[j] += -x[i] * row[j];
        }
        combine_rows(factor.upper.data() + first * ShapeFactor::kStride + end, ShapeFactor::kStride, taken,
                     end - first, size - end, x + end, x + end);
    }
    for (std::size_t i = size; i-- > 0;) {
        const double* row = factor.upper.data() + i * ShapeFactor::kStride;
        x[i] = (x[i] - dot(row + i + 1, x + i + 1, size - i - 1)) / row[i];
    }
    return squares;
}

}  // namespace rig
