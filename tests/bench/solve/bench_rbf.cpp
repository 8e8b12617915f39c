// The RBF evaluation against the arithmetic it cannot avoid, in one run: time as a multiple of the three
// matrix products in dot form, error against double, heap calls. Thread CPU time less its own cost, for each
// frame the least of five replays, then median and p99 over the frames. Not a test: nothing fails because a
// machine is slow.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/base/float_kernels.hpp"
#include "core/solve/rbf.hpp"
#include "firmware_host/daemon/heap_guard.hpp"
#include "tests/bench/solve/dot_form_floor.hpp"
#include "tests/bench/thread_clock.hpp"
#include "tests/support/random.hpp"

namespace rig::test {
namespace {

constexpr int kReplays = 5;

struct Size {
    std::size_t markers;
    std::size_t dimensions;
    std::size_t centres;
    std::size_t shapes;
};

// A model of the size asked for whose numbers are of the size of a face's, and a smooth trajectory of
// markers.
class Problem {
  public:
    Problem(const Size& size, RbfKernel kernel, std::size_t frames) : size_(size), frames_(frames) {
        SeededRandom random(41);
        const std::size_t rows = 3 * size.markers;
        mean_.resize(rows);
        for (float& x : mean_) x = static_cast<float>(random.normal(0.0, 40.0));
        make_basis(random);
        for (std::size_t i = 0; i < size.centres * size.dimensions; ++i)
            centres_.push_back(static_cast<float>(random.normal(0.0, 10.0)));
        for (std::size_t k = 0; k < size.centres; ++k)
            widths_.push_back(static_cast<float>(random.uniform(40.0, 80.0)));
        for (std::size_t i = 0; i < size.centres * size.shapes; ++i)
            weights_.push_back(static_cast<float>(random.normal(0.0, 0.1)));
        offset_.assign(size.shapes, 0.1F);
        low_.assign(size.shapes, 0.0F);
        high_.assign(size.shapes, 1.0F);
        pack_.solver = SolverKind::kRbf;
        pack_.marker_count = static_cast<std::uint16_t>(size.markers);
        pack_.shape_count = static_cast<std::uint16_t>(size.shapes);
        pack_.weight_low = low_;
        pack_.weight_high = high_;
        pack_.rbf = {.kernel = kernel,
                     .dimension_count = static_cast<std::uint16_t>(size.dimensions),
                     .centre_count = static_cast<std::uint16_t>(size.centres),
                     .mean_mm = mean_,
                     .basis = basis_,
                     .centres = centres_,
                     .widths_mm = widths_,
                     .weights = weights_,
                     .offset = offset_};
        make_trajectory(random);
    }

    [[nodiscard]] const SolvePack& pack() const { return pack_; }
    [[nodiscard]] std::size_t frames() const { return frames_; }
    [[nodiscard]] std::span<const float> frame(std::size_t f) const {
        return std::span(trajectory_).subspan(f * mean_.size(), mean_.size());
    }

    [[nodiscard]] DotFormChain dot_form() const {
        DotFormChain chain;
        chain.basis = padded_matrix(size_.dimensions, mean_.size(), basis_);
        chain.centres = padded_matrix(size_.centres, size_.dimensions, centres_);
        std::vector<float> turned(weights_.size());
        for (std::size_t k = 0; k < size_.centres; ++k) {
            for (std::size_t i = 0; i < size_.shapes; ++i)
                turned[i * size_.centres + k] = weights_[k * size_.shapes + i];
        }
        chain.weights = padded_matrix(size_.shapes, size_.centres, turned);
        return chain;
    }

    // The largest difference of a weight from the same formula in double, Gaussian only.
    [[nodiscard]] double error(std::size_t f, std::span<const float> got) const {
        std::vector<double> w(size_.shapes, 0.1);
        for (std::size_t k = 0; k < size_.centres; ++k) {
            double squared = 0.0;
            for (std::size_t a = 0; a < size_.dimensions; ++a) {
                double x = 0.0;
                for (std::size_t r = 0; r < mean_.size(); ++r) {
                    x += static_cast<double>(basis_[a * mean_.size() + r]) *
                         (static_cast<double>(frame(f)[r]) - static_cast<double>(mean_[r]));
                }
                const double gap = x - static_cast<double>(centres_[k * size_.dimensions + a]);
                squared += gap * gap;
            }
            const auto width = static_cast<double>(widths_[k]);
            const double height = std::exp(-0.5 * squared / (width * width));
            for (std::size_t i = 0; i < size_.shapes; ++i)
                w[i] += height * static_cast<double>(weights_[k * size_.shapes + i]);
        }
        double worst = 0.0;
        for (std::size_t i = 0; i < size_.shapes; ++i) {
            worst = std::max(worst, std::abs(std::clamp(w[i], 0.0, 1.0) - static_cast<double>(got[i])));
        }
        return worst;
    }

  private:
    static DotFormMatrix padded_matrix(std::size_t rows, std::size_t columns, std::span<const float> tight) {
        DotFormMatrix out{rows, columns, std::vector<float>(rows * padded(columns))};
        for (std::size_t r = 0; r < rows; ++r) {
            std::ranges::copy(tight.subspan(r * columns, columns),
                              out.values.begin() + static_cast<std::ptrdiff_t>(r * padded(columns)));
        }
        return out;
    }
    // Random rows are all but orthogonal, which is enough for a measurement.
    void make_basis(SeededRandom& random) {
        const std::size_t rows = mean_.size();
        for (std::size_t i = 0; i < size_.dimensions * rows; ++i) {
            basis_.push_back(
                static_cast<float>(random.normal(0.0, 1.0) / std::sqrt(static_cast<double>(rows))));
        }
    }
    void make_trajectory(SeededRandom& random) {
        const std::size_t rows = mean_.size();
        std::vector<double> rate(size_.dimensions);
        std::vector<double> phase(size_.dimensions);
        for (double& r : rate) r = random.uniform(0.02, 0.1);
        for (double& p : phase) p = random.uniform(0.0, 6.28);
        for (std::size_t f = 0; f < frames_; ++f) {
            std::vector<double> t(mean_.begin(), mean_.end());
            for (std::size_t a = 0; a < size_.dimensions; ++a) {
                const double along = 12.0 * std::sin(rate[a] * static_cast<double>(f) + phase[a]);
                for (std::size_t r = 0; r < rows; ++r)
                    t[r] += along * static_cast<double>(basis_[a * rows + r]);
            }
            for (const double x : t) trajectory_.push_back(static_cast<float>(x + random.normal(0.0, 0.1)));
        }
    }

    Size size_;
    std::size_t frames_;
    SolvePack pack_;
    std::vector<float> mean_, basis_, centres_, widths_, weights_, offset_, low_, high_, trajectory_;
};

struct Spread {
    double p50_us = 0.0;
    double p99_us = 0.0;
};

Spread spread_of(std::vector<double> times) {
    std::ranges::sort(times);
    return {times[times.size() / 2], times[times.size() * 99 / 100]};
}

// Three ways to spend a frame, measured one after the other in every frame so that they share its
// disturbances.
struct Times {
    explicit Times(std::size_t frames) : chain(frames, 1e9), plain(frames, 1e9), wide(frames, 1e9) {}
    std::vector<double> chain, plain, wide;
};

template <class Work>
void time_into(double& least_us, double clock_us, Work work) {
    const double start = bench::thread_cpu_us();
    work();
    least_us = std::min(least_us, std::max(0.0, bench::thread_cpu_us() - start - clock_us));
}

struct Outcome {
    Spread chain, plain, wide;
    double worst_error = 0.0;
    std::uint32_t heap_calls = 0;
    float unused = 0.0F;  // keeps the floors' results alive
};

Outcome measure(const Problem& problem) {
    const auto tables = std::make_unique<RbfTables>();
    const auto workspace = std::make_unique<RbfWorkspace>();
    build_rbf_tables(problem.pack(), *tables);
    const DotFormChain floor = problem.dot_form();
    std::vector<float> t(padded(floor.basis.columns));
    std::vector<float> x(padded(floor.basis.rows));
    std::vector<float> u(padded(floor.centres.rows));
    std::vector<float> w(padded(floor.weights.rows));
    std::vector<float> weights(problem.pack().shape_count);
    Times times(problem.frames());
    Outcome out;
    const double clock_us = bench::clock_cost_us();
    seal_heap();
    const std::uint32_t before = heap_calls_after_seal();
    for (int replay = 0; replay < kReplays; ++replay) {
        for (std::size_t f = 0; f < problem.frames(); ++f) {
            std::ranges::copy(problem.frame(f), t.begin());
            time_into(times.chain[f], clock_us, [&] {
                static_cast<void>(evaluate_rbf(*tables, problem.frame(f), *workspace, weights));
            });
            time_into(times.wide[f], clock_us,
                      [&] { dot_form_wide(floor, t.data(), x.data(), u.data(), w.data()); });
            out.unused += w[0];
            time_into(times.plain[f], clock_us,
                      [&] { dot_form_plain(floor, t.data(), x.data(), u.data(), w.data()); });
            out.unused += w[0];
        }
    }
    out.heap_calls = heap_calls_after_seal() - before;
    unseal_heap();
    if (problem.pack().rbf.kernel == RbfKernel::kGaussian) {
        for (std::size_t f = 0; f < problem.frames(); f += 100) {
            static_cast<void>(evaluate_rbf(*tables, problem.frame(f), *workspace, weights));
            out.worst_error = std::max(out.worst_error, problem.error(f, weights));
        }
    }
    out.chain = spread_of(times.chain);
    out.plain = spread_of(times.plain);
    out.wide = spread_of(times.wide);
    return out;
}

}  // namespace
}  // namespace rig::test

int main(int argc, char** argv) {
    CLI::App app{"bench_rbf: the RBF evaluation in multiples of its three matrix products in dot form"};
    std::size_t frames = 2000;
    app.add_option("--frames", frames, "frames of the trajectory, each replayed five times")
        ->capture_default_str()
        ->check(CLI::Range(100, 1'000'000));
    CLI11_PARSE(app, argc, argv);
    using rig::RbfKernel;
    const rig::test::Size wanted{102, 20, 100, 140};
    const struct {
        const char* name;
        rig::test::Size size;
        RbfKernel kernel;
    } cases[] = {{"306 -> 20 -> 100 -> 140, Gaussian", wanted, RbfKernel::kGaussian},
                 {"306 -> 20 -> 100 -> 140, thin plate", wanted, RbfKernel::kThinPlate},
                 {"306 -> 20 -> 100 -> 140, multiquadric", wanted, RbfKernel::kMultiquadric},
                 {"180 -> 4 -> 100 -> 46, Gaussian", {60, 4, 100, 46}, RbfKernel::kGaussian},
                 {"384 -> 32 -> 256 -> 256, Gaussian", {128, 32, 256, 256}, RbfKernel::kGaussian}};
    fmt::print(
        "thread CPU time less its own cost, least of {} replays of {} frames; floor: the three products in "
        "dot\n"
        "form with core's flags, `wide` with 16 partial sums a row, `plain` with one\n\n",
        rig::test::kReplays, frames);
    fmt::print(
        "| chain | p50 us | p99 us | wide floor p50 us | ratio p50 | ratio p99 | plain floor p50 us | ratio "
        "p50 | "
        "worst weight error | heap calls |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (const auto& c : cases) {
        const rig::test::Problem problem(c.size, c.kernel, frames);
        const rig::test::Outcome o = rig::test::measure(problem);
        const bool judged = c.kernel == RbfKernel::kGaussian;
        fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {} | {} |\n",
                   c.name, o.chain.p50_us, o.chain.p99_us, o.wide.p50_us, o.chain.p50_us / o.wide.p50_us,
                   o.chain.p99_us / o.wide.p99_us, o.plain.p50_us, o.chain.p50_us / o.plain.p50_us,
                   judged ? fmt::format("{:.1e}", o.worst_error) : "-", o.heap_calls);
        if (!rig::heap_guard_is_active()) fmt::print(stderr, "heap calls are not counted in this build\n");
    }
    return 0;
}
