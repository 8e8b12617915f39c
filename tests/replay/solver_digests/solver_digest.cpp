// solver_digest    solves generated trajectories, the box QP alone and the whole stage with each solver, adds
// lenses, views and mounts, and prints one digest of every number's bits. The same
// source is built several times, with other optimisation and other instruction sets;
// tests/replay/solver_digests compares what they print. "unsupported" where the processor lacks what the
// build was made for.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "core/solve/nnls.hpp"
#include "core/solve/simplex_qp.hpp"
#include "core/solve/solver.hpp"
#include "tests/replay/solver_digests/geometry_digest.hpp"
#include "tests/replay/solver_digests/tracking_digest.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/random.hpp"
#include "tests/support/solver_problems.hpp"

namespace {

using namespace rig;

bool supported() {
#if defined(__AVX512F__)
    return __builtin_cpu_supports("avx512f") != 0;
#elif defined(__AVX2__)
    return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
#else
    return true;
#endif
}

// A box QP whose markers come and go, so that the inverse follows H too.
template <typename Real>
void run(std::size_t rows, std::size_t shapes, double ridge, double high, test::Digest& digest) {
    const test::SolverTrajectory data = test::make_solver_trajectory(rows, shapes, 120, 5);
    const std::vector<double> gram = test::gram_of(data, ridge);
    const std::size_t stride = row_stride(shapes);
    std::vector<Real> basis(rows * stride, Real(0)), h(shapes * stride, Real(0)), q(stride, Real(0));
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < shapes; ++i)
            basis[r * stride + i] = static_cast<Real>(data.basis[r * shapes + i]);
    }
    for (std::size_t i = 0; i < shapes; ++i) {
        for (std::size_t j = 0; j < shapes; ++j) h[i * stride + j] = static_cast<Real>(gram[i * shapes + j]);
    }
    const std::vector<Real> low(shapes, Real(0)), top(shapes, static_cast<Real>(high));
    std::vector<Real> w(shapes, Real(0)), t(rows);
    const auto state = std::make_unique<BoxQpState<Real>>();
    const auto workspace = std::make_unique<BoxQpWorkspace<Real>>();
    test::SeededRandom random(6);
    std::uint32_t version = 1;
    std::vector<char> hidden(rows, 0);
    for (std::size_t f = 0; f < data.targets.size(); ++f) {
        if (f % 10 == 9) {
            const std::size_t row = random.below(rows);
            const std::span<const Real> z(basis.data() + row * stride, shapes);
            hidden[row] = hidden[row] == 0 ? 1 : 0;
            if (hidden[row] != 0) subtract_square(h.data(), stride, shapes, z.data());
            if (hidden[row] == 0) add_square(h.data(), stride, shapes, z.data());
            follow_hessian(*state, z, hidden[row] == 0);
            settle_hessian(*state, std::span<const Real>(h), stride, ++version);
        }
        for (std::size_t r = 0; r < rows; ++r)
            t[r] = hidden[r] != 0 ? Real(0) : static_cast<Real>(-data.targets[f][r]);
        combine_rows(basis.data(), stride, t.data(), rows, padded(shapes), nullptr, q.data());
        const BoxQpReport report = solve_box_qp({shapes, stride, h, q, low, top, version}, {}, *state,
                                                *workspace, std::span<Real>(w));
        for (const Real x : w) digest.add(x);
        digest.add(report.kkt);
        digest.add(report.objective);
        digest.add(report.iterations);
    }
}

struct alignas(64) Lanes {
    float values[kLaneFloats];
};

// One region's examples in both of its solvers; markers come and go. The last example repeats the first where
// `dependent`.
void run_region(std::size_t rows, std::size_t count, bool dependent, test::Digest& digest) {
    const std::size_t stride = padded(count);
    test::SeededRandom random(7);
    std::vector<Lanes> examples(rows * stride / kLaneFloats), gram(count * stride / kLaneFloats);
    float* const g = examples.data()->values;
    std::vector<double> hessian(count * count, 0.0), linear(count), weights(count);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < count; ++i)
            g[r * stride + i] = static_cast<float>(random.normal(0.0, 6.0));
        if (dependent) g[r * stride + count - 1] = g[r * stride];
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t j = 0; j < count; ++j)
                hessian[i * count + j] += static_cast<double>(g[r * stride + i] + 40.0F) *
                                          static_cast<double>(g[r * stride + j] + 40.0F);
        }
    }
    build_simplex_gram({g, rows * stride}, rows, count, {}, {gram.data()->values, count * stride});
    std::vector<float> target(rows), row_weight(rows, 1.0F), c(count);
    const auto state = std::make_unique<SimplexQpState>();
    const auto workspace = std::make_unique<SimplexQpWorkspace>();
    const auto nnls = std::make_unique<NnlsState>();
    const auto nnls_workspace = std::make_unique<NnlsWorkspace>();
    for (int frame = 0; frame < 60; ++frame) {
        row_weight[random.below(rows)] = frame % 3 == 0 ? 0.5F : 1.0F;
        std::fill(linear.begin(), linear.end(), 0.0);
        for (std::size_t r = 0; r < rows; ++r) {
            const float mix =
                0.5F * (g[r * stride + 1] + g[r * stride + static_cast<std::size_t>(frame) % count]);
            target[r] = mix + static_cast<float>(random.normal(0.0, 2.0));
            for (std::size_t i = 0; i < count; ++i)
                linear[i] +=
                    static_cast<double>(g[r * stride + i] + 40.0F) * static_cast<double>(target[r] + 40.0F);
        }
        const SimplexQpReport report = solve_simplex_qp({rows,
                                                         count,
                                                         stride,
                                                         {g, rows * stride},
                                                         {gram.data()->values, count * stride},
                                                         target,
                                                         row_weight,
                                                         0},
                                                        {}, *state, *workspace, c);
        for (const float x : c) digest.add(x);
        digest.add(report.kkt);
        digest.add(report.iterations);
        const BoxQpReport positive =
            solve_nnls({count, count, hessian, linear}, *nnls, *nnls_workspace, weights);
        for (const double w : weights) digest.add(w);
        digest.add(positive.objective);
    }
}

// A pack of numbers drawn at random: each shape moves a few markers, every solver has what it needs.
struct StagePack {
    explicit StagePack(SolverKind solver) {
        test::SeededRandom random(7);
        constexpr std::size_t kRows = 3 * kMarkers;
        const auto draw = [&](std::size_t count, double mean, double deviation) {
            std::vector<float> values(count);
            for (float& x : values) x = static_cast<float>(random.normal(mean, deviation));
            return values;
        };
        neutral = draw(kRows, 0.0, 40.0);
        basis.assign(kRows * kShapes, 0.0F);
        for (std::size_t i = 0; i < kShapes; ++i) {
            for (std::size_t r = 0; r < 24; ++r)
                basis[random.below(kRows) * kShapes + i] = static_cast<float>(random.normal(0.0, 3.0));
        }
        low.assign(kShapes, 0.0F);
        high.assign(kShapes, 1.0F);
        mean.assign(kShapes, 0.1F);
        sigma.assign(kShapes, 0.3F);
        gamma.assign(kShapes, solver == SolverKind::kBoxQp ? 5.0F : 0.0F);
        axes = draw(kDimensions * kRows, 0.0, 0.1);
        centres = draw(kCentres * kDimensions, 0.0, 10.0);
        widths.assign(kCentres, 12.0F);
        regression = draw(kCentres * kShapes, 0.0, 0.1);
        view.marker_count = kMarkers;
        view.shape_count = kShapes;
        view.solver = solver;
        view.neutral_mm = neutral;
        view.basis_mm = basis;
        view.weight_low = low;
        view.weight_high = high;
        view.prior_mean = mean;
        view.prior_sigma = sigma;
        view.temporal_gamma = gamma;
        view.sparsity_mm2 = view.ridge_mm2 = solver == SolverKind::kBoxQp ? 0.05F : 0.0F;
        view.rbf = {RbfKernel::kThinPlate,
                    0.5F,
                    1.5F,
                    kDimensions,
                    kCentres,
                    neutral,
                    axes,
                    centres,
                    widths,
                    regression,
                    mean};
    }
    static constexpr std::uint16_t kMarkers = 50;
    static constexpr std::uint16_t kShapes = 46;
    static constexpr std::uint16_t kDimensions = 6;
    static constexpr std::uint16_t kCentres = 40;
    std::vector<float> neutral, basis, low, high, mean, sigma, gamma, axes, centres, widths, regression;
    SolvePack view;
};

// Markers move, go, come back and are seen by one camera; in the last third an artist's controls act.
void see_frame(const StagePack& pack, int frame, test::SeededRandom& random, StabiliserOutput& seen,
               InferenceOutput& completed) {
    seen.count = completed.count = StagePack::kMarkers;
    for (std::size_t k = 0; k < StagePack::kMarkers; ++k) {
        Vec3 position;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t row = 3 * k + axis;
            double at = static_cast<double>(pack.neutral[row]) + random.normal(0.0, 0.1);
            for (std::size_t i = 0; i < StagePack::kShapes; ++i) {
                const int phase = (frame + 17 * static_cast<int>(i)) % 80;
                const double weight = phase < 40 ? phase * 0.025 : 2.0 - phase * 0.025;
                at += 0.5 * weight * static_cast<double>(pack.basis[row * StagePack::kShapes + i]);
            }
            position[static_cast<Eigen::Index>(axis)] = at;
        }
        completed.position_mm[k] = position;
        StabilisedMarker& marker = seen.markers[k];
        marker.seen = !random.chance(0.02);
        marker.position_mm = position;
        marker.information = 100.0 * Mat3::Identity();
        if (random.chance(0.02)) marker.information(2, 2) = 1.0;
    }
}

void run_stage(SolverKind solver, test::Digest& digest) {
    const StagePack pack(solver);
    const auto config = std::make_unique<SolverConfig>();
    const auto state = std::make_unique<SolverState>();
    const auto workspace = std::make_unique<SolverWorkspace>();
    const auto output = std::make_unique<SolverOutput>();
    const auto seen = std::make_unique<StabiliserOutput>();
    const auto completed = std::make_unique<InferenceOutput>();
    SolverReport report;
    configure_solver(pack.view, 60.0, *workspace, *config);
    ControlSet controls;
    controls.shapes[3].ridge = 20.0F;
    controls.shapes[4].high = 0.3F;
    static_cast<void>(controls.symmetry.push_back({5, 6, 0.5F}));
    static_cast<void>(controls.cancel.push_back({7, 8}));
    test::SeededRandom random(8);
    for (int frame = 0; frame < 90; ++frame) {
        if (frame == 60) prepare_controls(pack.view, controls, config->controls);
        see_frame(pack, frame, random, *seen, *completed);
        solve(*config, *seen, *completed, frame * 16'667, *state, *workspace, *output, report);
        for (std::size_t i = 0; i < StagePack::kShapes; ++i) {
            digest.add(output->weights[i]);
            digest.add(output->confidence[i]);
        }
        digest.add(report.kkt);
        digest.add(report.hull_share);
    }
}

}  // namespace

int main() {
    if (!supported()) {
        std::puts("unsupported");
        return 0;
    }
    test::Digest digest;
    run<float>(150, 46, 3e-3, 1.0, digest);
    run<float>(150, 140, 3e-3, 1.0, digest);
    run<double>(66, 12, 1e-6, 1e6, digest);
    run<double>(150, 46, 0.0, 1e6, digest);
    run_region(60, 12, false, digest);
    run_region(27, 15, true, digest);
    run_region(45, 24, true, digest);
    for (const SolverKind solver :
         {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp, SolverKind::kRbf})
        run_stage(solver, digest);
    add_geometry(digest);
    add_tracking(digest);
    std::printf("%016llx\n", static_cast<unsigned long long>(digest.value()));
    return 0;
}
