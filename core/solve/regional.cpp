#include "core/solve/regional.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/solve/confidence.hpp"

namespace rig {

namespace {

constexpr double kMaxCoordinate_mm = 1e6;  // a thousand faces away; keeps every product finite
constexpr double kMaxRowWeight = 1e6;      // of a pack's noise against a marker's: a thousand times finer

bool within(double x, double limit) {
    return x <= limit && x >= -limit;  // false for NaN
}

// Measured positions less the origin, and their weights: what both solvers start from.
void fill_rows(const RegionModel& region, const RegionalInput& input, RegionalWorkspace& ws) {
    for (std::size_t a = 0; a < region.marker_count; ++a) {
        const std::size_t k = region.markers[a];
        const Vec3& position = input.positions_mm[k];
        const bool seen = within(position[0], kMaxCoordinate_mm) && within(position[1], kMaxCoordinate_mm) &&
                          within(position[2], kMaxCoordinate_mm);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<Eigen::Index>(axis);
            const std::size_t row = 3 * a + axis;
            const double weight = static_cast<double>(region.marker_blend[a]) * input.weights[k](at, at);
            const bool counts = seen && weight > 0.0 && within(weight, kMaxRowWeight);
            ws.row_weight[row] = counts ? static_cast<float>(weight) : 0.0F;
            ws.target_mm[row] =
                counts ? static_cast<float>(position[at] - static_cast<double>(region.origin_mm[row])) : 0.0F;
        }
    }
}

bool all_one(std::span<const float> weights) {
    return std::all_of(weights.begin(), weights.end(), [](float w) { return w == 1.0F; });
}

void run_simplex(const RegionModel& region, const RegionalTables& tables, std::size_t index,
                 RegionState& state, RegionalWorkspace& ws, RegionReport& report) {
    SimplexQpProblem problem;
    problem.rows = 3U * region.marker_count;
    problem.count = region.example_count;
    problem.stride = padded(region.example_count);
    problem.examples = region.examples_mm;
    problem.gram = tables.gram[index];
    problem.target = {ws.target_mm.data(), problem.rows};
    const std::span<const float> weights(ws.row_weight.data(), problem.rows);
    if (!all_one(weights)) problem.row_weight = weights;
    const SimplexQpReport qp = solve_simplex_qp(problem, {}, state.simplex, ws.simplex, ws.coefficients);
    report.kkt = static_cast<double>(qp.kkt);
    report.iterations = qp.iterations;
    report.changes = qp.changes;
    report.rows_used = qp.rows_used;
    report.optimal = qp.optimal;
}

// E^T V E in double: absolute positions make it large and nearly singular.
void refresh_gram(const RegionModel& region, RegionState& state, const RegionalWorkspace& ws) {
    const std::size_t rows = 3U * region.marker_count;
    const std::size_t n = region.example_count;
    const std::size_t stride = padded(n);
    if (state.has_gram &&
        std::equal(ws.row_weight.begin(), ws.row_weight.begin() + static_cast<std::ptrdiff_t>(rows),
                   state.row_weight.begin())) {
        return;
    }
    std::copy_n(ws.row_weight.begin(), rows, state.row_weight.begin());
    state.gram.fill(0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        const auto weight = static_cast<double>(ws.row_weight[r]);
        if (!(weight > 0.0)) continue;
        const float* row = region.examples_mm.data() + r * stride;
        for (std::size_t i = 0; i < n; ++i) {
            const double scaled = weight * static_cast<double>(row[i]);
            for (std::size_t j = 0; j <= i; ++j)
                state.gram[i * kMaxRegionShapes + j] += scaled * static_cast<double>(row[j]);
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < i; ++j)
            state.gram[j * kMaxRegionShapes + i] = state.gram[i * kMaxRegionShapes + j];
    }
    state.has_gram = true;
}

void run_nnls(const RegionModel& region, RegionState& state, RegionalWorkspace& ws, RegionReport& report) {
    const std::size_t rows = 3U * region.marker_count;
    const std::size_t n = region.example_count;
    const std::size_t stride = padded(n);
    std::fill_n(ws.linear.begin(), n, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        if (!(ws.row_weight[r] > 0.0F)) continue;
        ++report.rows_used;
        const double scaled = static_cast<double>(ws.row_weight[r]) * static_cast<double>(ws.target_mm[r]);
        const float* row = region.examples_mm.data() + r * stride;
        for (std::size_t i = 0; i < n; ++i) ws.linear[i] += scaled * static_cast<double>(row[i]);
    }
    if (report.rows_used == 0) {
        report.optimal = true;
        for (std::size_t i = 0; i < n; ++i) ws.weights[i] = state.nnls.weights[i];
    } else {
        refresh_gram(region, state, ws);
        const NnlsProblem problem{n, kMaxRegionShapes, state.gram, ws.linear};
        const BoxQpReport qp = solve_nnls(problem, state.nnls, ws.nnls, ws.weights);
        report.kkt = qp.kkt;
        report.iterations = qp.iterations;
        report.changes = qp.changes;
        report.optimal = qp.optimal;
    }
    ws.coefficients.fill(0.0F);
    for (std::size_t i = 0; i < n; ++i) ws.coefficients[i] = static_cast<float>(ws.weights[i]);
}

void measure_fit(const RegionModel& region, const RegionalWorkspace& ws, RegionReport& report) {
    const std::size_t stride = padded(region.example_count);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t r = 0; r < 3U * region.marker_count; ++r) {
        const float weight = ws.row_weight[r];
        if (!(weight > 0.0F)) continue;
        const float fitted =
            padded_dot(region.examples_mm.data() + r * stride, ws.coefficients.data(), stride);
        const auto left = static_cast<double>(ws.target_mm[r] - fitted);
        sum += static_cast<double>(weight) * left * left;
        weights += static_cast<double>(weight);
    }
    report.objective_mm2 = sum;
    report.residual_rms_mm = weights > 0.0 ? std::sqrt(sum / weights) : 0.0;
}

// Adds the region's share of every streamed shape. Its confidence is that of those shapes, as in
// confidence.hpp with every variance counted by its share: P_ii / P0_ii = (1 - confidence_i)^2.
void add_shapes(const SolvePack& pack, const RegionModel& region, const RegionalWorkspace& ws,
                std::span<const float> confidence, RegionReport& report, std::span<double> shape_weights) {
    double prior = 0.0;
    double posterior = 0.0;
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        const auto share = static_cast<double>(region.shape_blend[i]);
        if (share == 0.0) continue;
        double asked = 0.0;
        for (std::size_t j = 0; j < region.example_count; ++j) {
            asked += static_cast<double>(ws.coefficients[j]) *
                     static_cast<double>(region.shapes[j * pack.shape_count + i]);
        }
        shape_weights[i] += share * asked;
        const auto sigma = static_cast<double>(pack.prior_sigma[i]);
        const double unknown = (1.0 - static_cast<double>(confidence[i])) * sigma;
        prior += share * sigma * sigma;
        posterior += share * unknown * unknown;
    }
    report.confidence = prior > 0.0 ? confidence_of(posterior, prior) : 0.0F;
}

}  // namespace

void build_regional_tables(const SolvePack& pack, RegionalTables& tables) {
    RIG_CHECK(pack.region_count <= kMaxRegions);
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionModel& region = pack.regions[r];
        if (region.solver != RegionSolver::kSimplex) continue;
        build_simplex_gram(region.examples_mm, 3U * region.marker_count, region.example_count, {},
                           tables.gram[r]);
    }
}

void reset_regions(RegionalState& state) {
    for (RegionState& region : state.regions) {
        region.simplex.warm = false;
        region.nnls = NnlsState{};
        region.has_gram = false;
    }
}

void solve_regions(const SolvePack& pack, const RegionalTables& tables, const RegionalInput& input,
                   RegionalState& state, RegionalWorkspace& workspace, RegionalOutput& output,
                   std::span<double> shape_weights) {
    RIG_CHECK(input.positions_mm.size() == pack.marker_count && input.weights.size() == pack.marker_count);
    RIG_CHECK(input.confidence.size() >= pack.shape_count && shape_weights.size() >= pack.shape_count);
    std::fill_n(shape_weights.begin(), pack.shape_count, 0.0);
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionModel& region = pack.regions[r];
        RegionReport& report = output.regions[r];
        report = RegionReport{};
        workspace.coefficients.fill(0.0F);
        fill_rows(region, input, workspace);
        if (region.solver == RegionSolver::kSimplex) {
            run_simplex(region, tables, r, state.regions[r], workspace, report);
        } else {
            run_nnls(region, state.regions[r], workspace, report);
        }
        measure_fit(region, workspace, report);
        add_shapes(pack, region, workspace, input.confidence, report, shape_weights);
        std::copy_n(workspace.coefficients.begin(), kMaxRegionShapes, output.coefficients[r].begin());
    }
}

}  // namespace rig
