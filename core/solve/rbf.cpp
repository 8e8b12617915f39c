#include "core/solve/rbf.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/float_kernels.hpp"
#include "core/base/float_math.hpp"
#include "core/base/float_vector.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr float kMaxCoordinateMm = 1e6F;  // a thousand faces away; keeps every square far from overflow
constexpr float kNowhere = 1e30F;         // the squared distance of padding: never the nearest

static_assert(kMaxRows % kLaneFloats == 0 && kMaxRbfDimensions % kLaneFloats == 0);
static_assert(kMaxRbfCentres % kLaneFloats == 0 && kMaxShapes % kLaneFloats == 0);

// Rows of `from`, `columns` long and tight, to rows padded(columns) apart.
void copy_padded(std::span<const float> from, std::size_t columns, std::span<float> to) {
    const std::size_t rows = from.size() / columns;
    for (std::size_t r = 0; r < rows; ++r) {
        std::ranges::copy(from.subspan(r * columns, columns),
                          to.begin() + static_cast<std::ptrdiff_t>(r * padded(columns)));
    }
}

std::uint16_t take_motion(const RbfTables& tables, std::span<const float> positions_mm, float* motion_mm) {
    std::uint32_t replaced = 0;
    const float* t = positions_mm.data();
    for (std::size_t r = 0; r < tables.rows; ++r) {
        const bool position = t[r] > -kMaxCoordinateMm && t[r] < kMaxCoordinateMm;
        const float motion = t[r] - tables.mean_mm[r];
        motion_mm[r] = position ? motion : 0.0F;
        replaced += position ? 0U : 1U;
    }
    for (std::size_t r = tables.rows; r < padded(tables.rows); ++r) motion_mm[r] = 0.0F;
    return static_cast<std::uint16_t>(replaced);
}

// Sixteen partial sums added in a fixed tree: the order of core's padded_dot().
float tree_sum(const float* s) {
    float eight[8];
    float four[4];
    for (std::size_t i = 0; i < 8; ++i) eight[i] = s[i] + s[i + 8];
    for (std::size_t i = 0; i < 4; ++i) four[i] = eight[i] + eight[i + 4];
    return (four[0] + four[2]) + (four[1] + four[3]);
}

constexpr std::size_t kVectors = kLaneFloats / kFloatVectorWidth;
constexpr std::size_t kAxesAtOnce = 8 / kVectors;  // so that 8 registers hold the sums of all of them
static_assert(kMaxRbfDimensions % kAxesAtOnce == 0);

// x, several axes at a time: they share the loads of the motion, and their sums hide each other's latency.
// Axes beyond d are rows of zeros.
void project(const RbfTables& tables, const float* motion_mm, float* point_mm) {
    const std::size_t rows = padded(tables.rows);
    for (std::size_t axis = 0; axis < tables.dimensions; axis += kAxesAtOnce) {
        const float* first = tables.basis.data() + axis * rows;
        FloatVector sum[kAxesAtOnce][kVectors]{};
        for (std::size_t r = 0; r < rows; r += kLaneFloats) {
            for (std::size_t v = 0; v < kVectors; ++v) {
                const std::size_t at = r + v * kFloatVectorWidth;
                const FloatVector motion = load_floats(motion_mm + at);
                for (std::size_t a = 0; a < kAxesAtOnce; ++a)
                    sum[a][v] += load_floats(first + a * rows + at) * motion;
            }
        }
        for (std::size_t a = 0; a < kAxesAtOnce; ++a) {
            alignas(64) float lanes[kLaneFloats];
            for (std::size_t v = 0; v < kVectors; ++v) store_floats(lanes + v * kFloatVectorWidth, sum[a][v]);
            point_mm[axis + a] = tree_sum(lanes);
        }
    }
}

// u. Directly, not as |x|^2 - 2 x.c + |c|^2: that loses the digits which a point near a centre needs.
void measure_centres(const RbfTables& tables, const float* point_mm, float* squared) {
    const std::size_t stride = padded(tables.centres);
    for (std::size_t k = 0; k < stride; k += kLaneFloats) {
        FloatVector sum[kVectors]{};
        for (std::size_t a = 0; a < tables.dimensions; ++a) {
            const float* centre = tables.centres_mm.data() + a * stride + k;
            for (std::size_t v = 0; v < kVectors; ++v) {
                const FloatVector gap = point_mm[a] - load_floats(centre + v * kFloatVectorWidth);
                sum[v] += gap * gap;
            }
        }
        for (std::size_t v = 0; v < kVectors; ++v) {
            const std::size_t at = k + v * kFloatVectorWidth;
            store_floats(squared + at, sum[v] * load_floats(tables.inverse_square_width.data() + at));
        }
    }
    for (std::size_t k = tables.centres; k < stride; ++k) squared[k] = kNowhere;
}

void find_nearest(const RbfTables& tables, const float* squared, RbfReport& report) {
    FloatVector least = load_floats(squared);
    for (std::size_t k = 0; k < padded(tables.centres); k += kFloatVectorWidth) {
        const FloatVector here = load_floats(squared + k);
        least = here < least ? here : least;
    }
    float nearest = least[0];
    for (std::size_t lane = 1; lane < kFloatVectorWidth; ++lane) nearest = std::min(nearest, least[lane]);
    const float* first = std::find(squared, squared + tables.centres, nearest);
    report.nearest_centre = static_cast<std::uint16_t>(first - squared);
    report.nearest_widths = std::sqrt(nearest);
}

// h = phi(u)
void find_heights(const RbfTables& tables, const float* squared, float* heights) {
    const std::size_t n = padded(tables.centres);
    switch (tables.kernel) {
        case RbfKernel::kGaussian:
            for (std::size_t k = 0; k < n; ++k) heights[k] = -0.5F * squared[k];
            exp_each(heights, n, heights);
            return;
        case RbfKernel::kThinPlate:
            log_each(squared, n, heights);
            for (std::size_t k = 0; k < n; ++k) heights[k] *= 0.5F * squared[k];
            return;
        case RbfKernel::kMultiquadric:
            for (std::size_t k = 0; k < n; ++k) heights[k] = std::sqrt(1.0F + squared[k]);
            return;
    }
}

std::uint16_t clamp_weights(const RbfTables& tables, const float* raw, std::span<float> weights) {
    std::uint32_t clamped = 0;
    float* out = weights.data();
    for (std::size_t i = 0; i < tables.shapes; ++i) {
        const float above = raw[i] < tables.low[i] ? tables.low[i] : raw[i];
        const float inside = above > tables.high[i] ? tables.high[i] : above;
        clamped += inside != raw[i] ? 1U : 0U;
        out[i] = inside;
    }
    return static_cast<std::uint16_t>(clamped);
}

}  // namespace

void build_rbf_tables(const SolvePack& pack, RbfTables& tables) {
    const RbfModel& rbf = pack.rbf;
    RIG_CHECK(pack.solver == SolverKind::kRbf && rbf.centre_count > 0 && rbf.dimension_count > 0);
    for (const std::span<float> padding :
         {std::span<float>(tables.mean_mm), std::span<float>(tables.basis),
          std::span<float>(tables.centres_mm), std::span<float>(tables.inverse_square_width),
          std::span<float>(tables.weights), std::span<float>(tables.offset)}) {
        std::ranges::fill(padding, 0.0F);
    }
    tables.kernel = rbf.kernel;
    tables.hull_near_widths = rbf.hull_near_widths;
    tables.hull_far_widths = rbf.hull_far_widths;
    tables.rows = 3U * pack.marker_count;
    tables.dimensions = rbf.dimension_count;
    tables.centres = rbf.centre_count;
    tables.shapes = pack.shape_count;
    std::ranges::copy(rbf.mean_mm, tables.mean_mm.begin());
    copy_padded(rbf.basis, tables.rows, tables.basis);
    copy_padded(rbf.weights, tables.shapes, tables.weights);
    for (std::size_t k = 0; k < tables.centres; ++k) {
        for (std::size_t a = 0; a < tables.dimensions; ++a) {
            tables.centres_mm[a * padded(tables.centres) + k] = rbf.centres[k * tables.dimensions + a];
        }
        const auto width = static_cast<double>(rbf.widths_mm[k]);
        tables.inverse_square_width[k] = static_cast<float>(1.0 / (width * width));
    }
    std::ranges::copy(rbf.offset, tables.offset.begin());
    std::ranges::copy(pack.weight_low, tables.low.begin());
    std::ranges::copy(pack.weight_high, tables.high.begin());
}

float hull_share(float distance_widths, float near_widths, float far_widths) {
    if (far_widths <= 0.0F || distance_widths <= near_widths) return 0.0F;
    if (distance_widths >= far_widths) return 1.0F;
    const float s = (distance_widths - near_widths) / (far_widths - near_widths);
    return s * s * (3.0F - 2.0F * s);
}

RbfReport evaluate_rbf(const RbfTables& tables, std::span<const float> positions_mm, RbfWorkspace& workspace,
                       std::span<float> weights) {
    RIG_CHECK(positions_mm.size() == tables.rows && weights.size() == tables.shapes && tables.centres > 0);
    RbfReport report;
    report.coordinates_replaced = take_motion(tables, positions_mm, workspace.motion_mm.data());
    project(tables, workspace.motion_mm.data(), workspace.point_mm.data());
    measure_centres(tables, workspace.point_mm.data(), workspace.squared.data());
    find_nearest(tables, workspace.squared.data(), report);
    report.hull_share = hull_share(report.nearest_widths, tables.hull_near_widths, tables.hull_far_widths);
    find_heights(tables, workspace.squared.data(), workspace.heights.data());
    combine_rows(tables.weights.data(), padded(tables.shapes), workspace.heights.data(), tables.centres,
                 padded(tables.shapes), tables.offset.data(), workspace.weights.data());
    report.weights_clamped = clamp_weights(tables, workspace.weights.data(), weights);
    return report;
}

}  // namespace rig
