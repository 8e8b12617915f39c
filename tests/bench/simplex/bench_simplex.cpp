// bench_simplex [--frames N] [--noise X]    14 regions of 10 to 15 examples in one frame: time against the
// floor.
//
// A smooth trajectory; 27 to 78 rows; examples in families of three alike ones; 0.2 % noise. Times are thread
// CPU time, per frame the least of five replays of the trajectory, then median and 99th percentile over the
// frames.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/solve/simplex_qp.hpp"
#include "tests/bench/simplex/floor.hpp"
#include "tests/support/simplex_problem.hpp"

namespace {

using namespace rig;

constexpr std::size_t kRegions = 14;
constexpr int kReplays = 5;

double cpu_us() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

struct Region {
    std::unique_ptr<test::SimplexProblem> problem;
    std::vector<std::vector<double>> positions;  // per frame
    SimplexQpState state;
    std::vector<float> coefficients;
};

std::vector<std::unique_ptr<Region>> make_regions(std::size_t frames, double noise) {
    test::SeededRandom random(7);
    std::vector<std::unique_ptr<Region>> regions;
    for (std::size_t r = 0; r < kRegions; ++r) {
        test::SimplexFaceOptions o;
        o.rows = 27 + 3 * ((r * 17) / 13 % 18);
        o.count = 10 + r % 6;
        o.similarity = random.uniform(0.3, 0.9);
        const std::vector<double> raw = test::simplex_examples(o, random);
        auto region = std::make_unique<Region>();
        region->problem = std::make_unique<test::SimplexProblem>(o.rows, o.count, raw);
        const test::SimplexTrajectory trajectory(o.count, random);
        for (std::size_t f = 0; f < frames; ++f) {
            const std::vector<double> c = trajectory.at(static_cast<double>(f));
            std::vector<double> position(o.rows, 0.0);
            for (std::size_t k = 0; k < o.rows; ++k) {
                for (std::size_t i = 0; i < o.count; ++i) position[k] += raw[k * o.count + i] * c[i];
                position[k] += random.normal(0.0, noise * o.motion_mm);
            }
            region->positions.push_back(position);
        }
        region->coefficients.assign(o.count, 0.0F);
        regions.push_back(std::move(region));
    }
    return regions;
}

// The inverse at the working set's size, packed, as a solver that keeps only what is in use would hold it.
struct PackedFloor {
    explicit PackedFloor(const Region& region) {
        for (std::size_t i = 0; i < region.problem->count(); ++i) {
            if ((region.state.used >> i & 1U) == 0) continue;
            used.push_back(static_cast<std::uint16_t>(i));
            coefficients.push_back(region.coefficients[i]);
        }
        const std::size_t k = used.size();
        const std::size_t stride = padded(region.problem->count());
        for (std::size_t a = 0; a < k; ++a) {
            for (std::size_t b = 0; b < k; ++b)
                inverse[a * padded(k) + b] = region.state.inverse[used[a] * stride + used[b]];
        }
        const SimplexQpProblem view = region.problem->view();
        problem = {view.rows,          view.stride, view.examples.data(), view.gram.data(), inverse.data(),
                   view.target.data(), used,        coefficients};
    }
    PackedFloor(const PackedFloor&) = delete;
    PackedFloor& operator=(const PackedFloor&) = delete;

    alignas(64) std::array<float, kMaxRegionShapes * kSimplexStride> inverse{};
    std::vector<std::uint16_t> used;
    std::vector<float> coefficients;
    bench::FloorProblem problem;
};

struct Totals {
    double iterations = 0.0;
    double changes = 0.0;
    double used = 0.0;
    float worst_kkt = 0.0F;
    std::size_t not_optimal = 0;
};

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

double p99(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[(v.size() - 1) * 99 / 100];
}

double clock_overhead_us() {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 10000; ++i) {
        const double begin = cpu_us();
        least = std::min(least, cpu_us() - begin);
    }
    return least;
}

}  // namespace

int main(int argc, char** argv) {
    std::size_t frames = 2000;
    double noise = 0.002;
    CLI::App app("Simplex QP of 14 regions against the floor");
    app.add_option("--frames", frames, "length of the trajectory");
    app.add_option("--noise", noise, "of a coordinate, as a share of the motion");
    CLI11_PARSE(app, argc, argv);

    auto regions = make_regions(frames, noise);
    auto workspace = std::make_unique<SimplexQpWorkspace>();
    const double overhead = clock_overhead_us();
    std::vector<double> warm(frames, 1e9);
    std::vector<double> cold(frames, 1e9);
    std::vector<double> floor(frames, 1e9);
    Totals totals;
    volatile float sink = 0.0F;
    for (int replay = 0; replay < kReplays; ++replay) {
        for (auto& region : regions) region->state = SimplexQpState{};
        for (std::size_t f = 0; f < frames; ++f) {
            for (auto& region : regions) region->problem->measure(region->positions[f]);
            std::vector<SimplexQpProblem> views;
            for (auto& region : regions) views.push_back(region->problem->view());
            std::array<SimplexQpReport, kRegions> reports;
            double begin = cpu_us();
            for (std::size_t r = 0; r < kRegions; ++r) {
                reports[r] =
                    solve_simplex_qp(views[r], {}, regions[r]->state, *workspace, regions[r]->coefficients);
            }
            warm[f] = std::min(warm[f], cpu_us() - begin - overhead);
            std::vector<std::unique_ptr<PackedFloor>> floors;
            for (auto& region : regions) floors.push_back(std::make_unique<PackedFloor>(*region));
            begin = cpu_us();
            for (auto& one : floors) sink = sink + bench::run_floor(one->problem);
            floor[f] = std::min(floor[f], cpu_us() - begin - overhead);
            for (std::size_t r = 0; r < kRegions && replay == 0; ++r) {
                totals.iterations += reports[r].iterations;
                totals.changes += reports[r].changes;
                totals.used += static_cast<double>(floors[r]->used.size());
                totals.worst_kkt = std::max(totals.worst_kkt, reports[r].kkt);
                totals.not_optimal += reports[r].optimal ? 0 : 1;
            }
            if (f % 20 != 0) continue;
            std::vector<SimplexQpState> states(kRegions);
            begin = cpu_us();
            for (std::size_t r = 0; r < kRegions; ++r)
                static_cast<void>(
                    solve_simplex_qp(views[r], {}, states[r], *workspace, regions[r]->coefficients));
            cold[f] = std::min(cold[f], cpu_us() - begin - overhead);
        }
    }
    std::erase_if(cold, [](double t) { return t > 1e8; });
    const double per = static_cast<double>(frames * kRegions);
    fmt::print(
        "14 regions, {} frames: {:.1f} examples in use, {:.2f} iterations, {:.2f} changes a region and "
        "frame\n",
        frames, totals.used / per, totals.iterations / per, totals.changes / per);
    fmt::print("{:<6} {:>10} {:>10} {:>8}\n", "", "median us", "p99 us", "x floor");
    fmt::print("{:<6} {:>10.2f} {:>10.2f} {:>8.2f}\n", "floor", median(floor), p99(floor), 1.0);
    fmt::print("{:<6} {:>10.2f} {:>10.2f} {:>8.2f}\n", "warm", median(warm), p99(warm),
               median(warm) / median(floor));
    fmt::print("{:<6} {:>10.2f} {:>10.2f} {:>8.2f}\n", "cold", median(cold), p99(cold),
               median(cold) / median(floor));
    fmt::print("worst kkt {:.2g}, not certified {} of {}\n", totals.worst_kkt, totals.not_optimal,
               frames * kRegions);
    return totals.worst_kkt <= 1e-5F && totals.not_optimal == 0 ? 0 : 1;
}
