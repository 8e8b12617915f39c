// bench_simplex [--frames N] [--noise X]    14 regions of 10 to 15 examples in one frame: time against the
// floor.
//
// A smooth trajectory; 27 to 78 rows; examples in families of three alike ones; 0.2 % noise. Times are thread
// CPU time less the clock's own cost, per frame the least of five replays of the trajectory, then median and
// 99th percentile over the frames. KKT residuals are worked out anew in double. The floor is what no solver
// can do without, compiled as core is: one G^T g, one product with the inverse at the working set's size, one
// gradient. dlib's solver of the same programme (sequential minimal optimisation, in double, warm) runs
// beside. Ends with 1 when a frame has no certificate or the heap was called.
#include <dlib/optimization.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/simplex_qp.hpp"
#include "firmware_host/daemon/heap_guard.hpp"
#include "tests/bench/simplex/floor.hpp"
#include "tests/bench/thread_clock.hpp"
#include "tests/support/simplex_problem.hpp"

namespace {

using namespace rig;

constexpr std::size_t kRegions = 14;
constexpr int kReplays = 5;

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

// Largest move of a projected Jacobi step, as in SimplexQpReport, in double from the examples themselves.
double kkt_of(const SimplexQpProblem& p, const std::vector<float>& c) {
    std::vector<double> pull(p.count, 0.0);
    std::vector<double> diagonal(p.count, 0.0);
    for (std::size_t r = 0; r < p.rows; ++r) {
        const float* row = p.examples.data() + r * p.stride;
        auto left = static_cast<double>(p.target[r]);
        for (std::size_t i = 0; i < p.count; ++i)
            left -= static_cast<double>(row[i]) * static_cast<double>(c[i]);
        for (std::size_t i = 0; i < p.count; ++i) {
            pull[i] += left * static_cast<double>(row[i]);
            diagonal[i] += static_cast<double>(row[i]) * static_cast<double>(row[i]);
        }
    }
    double lambda = 0.0;
    double shift = 0.0;
    for (std::size_t i = 0; i < p.count; ++i) {
        lambda += static_cast<double>(c[i]) * pull[i];
        shift += diagonal[i] / static_cast<double>(p.count);
    }
    double worst = 0.0;
    for (std::size_t i = 0; i < p.count; ++i) {
        const double at = static_cast<double>(c[i]);
        worst =
            std::max(worst, std::fabs(at - std::max(0.0, at + (pull[i] - lambda) / (diagonal[i] + shift))));
    }
    return worst;
}

// One way of spending a frame: its times, and what it left behind in the first replay.
struct Outcome {
    explicit Outcome(std::size_t frames) : us(frames, kNever) {}
    void take(std::size_t frame, double time_us) { us[frame] = std::min(us[frame], time_us); }
    void judge(const SimplexQpProblem& problem, const Region& region, const SimplexQpReport& report) {
        kkt.push_back(kkt_of(problem, region.coefficients));
        uncertified += report.optimal ? 0 : 1;
        walked += report.walked ? 1 : 0;
        iterations += report.iterations;
        changes += report.changes;
    }

    static constexpr double kNever = 1e9;
    std::vector<double> us;
    std::vector<double> kkt;
    std::size_t uncertified = 0;
    std::size_t walked = 0;
    double iterations = 0.0;
    double changes = 0.0;
    std::uint32_t heap_calls = 0;
};

// dlib's solver for one region: minimise 1/2 a^T Q a - a^T b, a >= 0, sum a = 1.
struct Rival {
    explicit Rival(const SimplexQpProblem& p) {
        const auto n = static_cast<long>(p.count);
        gram.set_size(n, n);
        for (long i = 0; i < n; ++i) {
            for (long j = 0; j < n; ++j)
                gram(i, j) = static_cast<double>(
                    p.gram[static_cast<std::size_t>(i) * p.stride + static_cast<std::size_t>(j)]);
        }
        examples.set_size(static_cast<long>(p.rows), n);
        for (std::size_t r = 0; r < p.rows; ++r) {
            for (std::size_t i = 0; i < p.count; ++i)
                examples(static_cast<long>(r), static_cast<long>(i)) =
                    static_cast<double>(p.examples[r * p.stride + i]);
        }
        gap = kGapShare * dlib::trace(gram) / static_cast<double>(n);
        restart();
    }
    void restart() { share = dlib::ones_matrix<double>(gram.nr(), 1) / static_cast<double>(gram.nr()); }
    void solve() {
        const dlib::matrix<double, 0, 1> b = dlib::trans(examples) * target;
        dlib::solve_qp_using_smo(gram, b, share, gap, 100'000);
    }

    static constexpr double kGapShare =
        1e-9;  // of the mean diagonal: its answers are then about as exact as ours
    dlib::matrix<double> gram, examples;
    dlib::matrix<double, 0, 1> target, share;
    double gap = 0.0;
};

class Bench {
  public:
    Bench(std::size_t frames, double noise)
        : regions(make_regions(frames, noise)), floor(frames), warm(frames), cold(frames), rival(frames) {
        for (const auto& region : regions) rivals_.emplace_back(region->problem->view());
    }

    void replay(bool first) {
        for (auto& region : regions) region->state = SimplexQpState{};
        for (Rival& each : rivals_) each.restart();
        for (std::size_t f = 0; f < floor.us.size(); ++f) {
            std::array<SimplexQpProblem, kRegions> views;
            for (std::size_t r = 0; r < kRegions; ++r) {
                regions[r]->problem->measure(regions[r]->positions[f]);
                views[r] = regions[r]->problem->view();
            }
            solve(views, f, first, false, warm);
            run_floor(f, first);
            if (f % kColdEvery == 0) solve(views, f, first, true, cold);
            run_rivals(views, f, first);
        }
    }

    std::vector<std::unique_ptr<Region>> regions;
    Outcome floor, warm, cold, rival;
    double used = 0.0;

  private:
    static constexpr std::size_t kColdEvery = 20;

    void solve(const std::array<SimplexQpProblem, kRegions>& views, std::size_t frame, bool first, bool anew,
               Outcome& out) {
        std::array<SimplexQpReport, kRegions> reports;
        std::vector<SimplexQpState> fresh(anew ? kRegions : 0);
        seal_heap();
        const std::uint32_t before = heap_calls_after_seal();
        const double begin = bench::thread_cpu_us();
        for (std::size_t r = 0; r < kRegions; ++r) {
            reports[r] = solve_simplex_qp(views[r], {}, anew ? fresh[r] : regions[r]->state, *workspace_,
                                          regions[r]->coefficients);
        }
        out.take(frame, bench::thread_cpu_us() - begin - overhead_us_);
        out.heap_calls += heap_calls_after_seal() - before;
        unseal_heap();
        for (std::size_t r = 0; first && r < kRegions; ++r) out.judge(views[r], *regions[r], reports[r]);
    }

    void run_floor(std::size_t frame, bool first) {
        std::vector<std::unique_ptr<PackedFloor>> parts;
        for (auto& region : regions) parts.push_back(std::make_unique<PackedFloor>(*region));
        const double begin = bench::thread_cpu_us();
        for (auto& part : parts) sink_ = sink_ + bench::run_floor(part->problem);
        floor.take(frame, bench::thread_cpu_us() - begin - overhead_us_);
        for (auto& part : parts) used += first ? static_cast<double>(part->used.size()) : 0.0;
    }

    void run_rivals(const std::array<SimplexQpProblem, kRegions>& views, std::size_t frame, bool first) {
        for (std::size_t r = 0; r < kRegions; ++r)
            rivals_[r].target = dlib::matrix_cast<double>(
                dlib::mat(views[r].target.data(), static_cast<long>(views[r].rows)));
        const double begin = bench::thread_cpu_us();
        for (Rival& each : rivals_) each.solve();
        rival.take(frame, bench::thread_cpu_us() - begin - overhead_us_);
        for (std::size_t r = 0; first && r < kRegions; ++r) {
            std::vector<float> c(views[r].count);
            for (std::size_t i = 0; i < c.size(); ++i)
                c[i] = static_cast<float>(rivals_[r].share(static_cast<long>(i)));
            rival.kkt.push_back(kkt_of(views[r], c));
        }
    }

    std::vector<Rival> rivals_;
    std::unique_ptr<SimplexQpWorkspace> workspace_ = std::make_unique<SimplexQpWorkspace>();
    double overhead_us_ = bench::clock_cost_us();
    volatile float sink_ = 0.0F;
};

void print_row(const char* name, Outcome& outcome, double floor_us) {
    std::erase(outcome.us, Outcome::kNever);
    const double middle = bench::quantile(outcome.us, 0.5);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} |", name, middle, bench::quantile(outcome.us, 0.99),
               middle / floor_us);
    if (outcome.kkt.empty()) {
        fmt::print(" - | - | - | - | - | - |\n");
        return;
    }
    const auto solves = static_cast<double>(outcome.kkt.size());
    if (outcome.iterations == 0.0) {
        fmt::print(" - | - | {:.1e} | {:.1e} | - | - |\n", bench::quantile(outcome.kkt, 0.99),
                   *std::max_element(outcome.kkt.begin(), outcome.kkt.end()));
        return;
    }
    fmt::print(" {:.2f} | {:.2f} | {:.1e} | {:.1e} | {} of {} | {} |\n", outcome.iterations / solves,
               outcome.changes / solves, bench::quantile(outcome.kkt, 0.99),
               *std::max_element(outcome.kkt.begin(), outcome.kkt.end()), outcome.uncertified,
               outcome.kkt.size(), outcome.heap_calls);
}

}  // namespace

int main(int argc, char** argv) {
    std::size_t frames = 2000;
    double noise = 0.002;
    CLI::App app("Simplex QP of 14 regions against the floor");
    app.add_option("--frames", frames, "length of the trajectory")->capture_default_str();
    app.add_option("--noise", noise, "of a coordinate, as a share of the motion")->capture_default_str();
    app.footer("Example:\n  bench_simplex --frames 200");
    CLI11_PARSE(app, argc, argv);

    Bench bench(frames, noise);
    for (int replay = 0; replay < kReplays; ++replay) bench.replay(replay == 0);
    const double floor_us = bench::quantile(bench.floor.us, 0.5);
    fmt::print("{} regions, {} frames, {:.1f} examples in use; {} warm solves went on in double\n\n",
               kRegions, frames, bench.used / static_cast<double>(frames * kRegions), bench.warm.walked);
    fmt::print(
        "| all regions of a frame | median us | p99 us | x floor | iterations | changes | kkt p99 | worst "
        "kkt | "
        "uncertified | heap calls |\n|---|---|---|---|---|---|---|---|---|---|\n");
    print_row("floor", bench.floor, floor_us);
    print_row("warm", bench.warm, floor_us);
    print_row("cold", bench.cold, floor_us);
    print_row("dlib's SMO, warm", bench.rival, floor_us);
    if (!heap_guard_is_active()) fmt::print(stderr, "heap calls are not counted in this build\n");
    const bool good = bench.warm.uncertified + bench.cold.uncertified == 0 &&
                      bench.warm.heap_calls + bench.cold.heap_calls == 0;
    return good ? 0 : 1;
}
