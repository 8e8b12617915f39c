// bench_solve    core's quadratic solvers against what can be had: dlib and textbook methods, on the same
// trajectories in one run. Everything in float unless the row says double. Times are thread CPU time less the
// clock's own cost, per frame the least over the replays of the trajectory, then median and 99th percentile
// over frames. The floor is what no solver can do without: one B^T t, one product with the inverse at the
// working set's size, one gradient, by core's own kernels.
#include <dlib/optimization.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "core/solve/normal_equations.hpp"
#include "tests/bench/thread_clock.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/textbook_solvers.hpp"

namespace {

std::atomic<std::uint64_t> heap_calls{0};

}  // namespace

// Not inlined: the compiler would see malloc and free across the pair and warn of a mismatch that is none.
[[gnu::noinline]] void* operator new(std::size_t size) {
    heap_calls.fetch_add(1, std::memory_order_relaxed);
    if (void* p = std::malloc(size)) return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}

namespace {

using namespace rig;

struct Family {
    char kind;  // 'a': NNLS; 'b': box QP
    std::size_t rows, shapes;
};

// [Hybrid16 eq. 3-4] with the benchmark's settings; a has none of them.
constexpr double kBeta = 1e-3, kRidge = 1e-3, kPull = 2e-3;

struct Bench {
    Bench(const Family& f, std::size_t frames, std::uint64_t seed)
        : family(f), data(test::make_solver_trajectory(f.rows, f.shapes, frames, seed)) {
        const bool b = f.kind == 'b';
        beta = b ? kBeta : 0.0;
        pull = b ? kPull : 0.0;
        hessian = test::gram_of(data, b ? kRidge + kPull : 0.0);
        low.assign(f.shapes, 0.0);
        high.assign(f.shapes, b ? 1.0 : std::numeric_limits<double>::infinity());
    }

    Family family;
    test::SolverTrajectory data;
    double beta = 0.0, pull = 0.0;
    std::vector<double> hessian, low, high;
};

// What a method left behind in one frame, judged in double against the frame's own problem.
struct Judgement {
    double kkt = 0.0;
    double objective = 0.0;
};

Judgement judge(const Bench& bench, const std::vector<double>& q, const std::vector<double>& w) {
    const std::size_t n = bench.family.shapes;
    Judgement j;
    for (std::size_t i = 0; i < n; ++i) {
        double g = q[i];
        for (std::size_t k = 0; k < n; ++k) g += bench.hessian[i * n + k] * w[k];
        const double target = std::clamp(w[i] - g / bench.hessian[i * n + i], bench.low[i], bench.high[i]);
        j.kkt = std::max(j.kkt, std::fabs(w[i] - target));
        j.objective += 0.5 * w[i] * (g + q[i]);
    }
    return j;
}

// q of a frame: -B^T t + beta/2 - pull w_previous.
std::vector<double> linear_of(const Bench& bench, std::size_t frame, const std::vector<double>& previous) {
    const std::size_t n = bench.family.shapes;
    std::vector<double> q(n, 0.5 * bench.beta);
    for (std::size_t r = 0; r < bench.family.rows; ++r) {
        const double t = bench.data.targets[frame][r];
        for (std::size_t i = 0; i < n; ++i) q[i] -= bench.data.basis[r * n + i] * t;
    }
    for (std::size_t i = 0; i < n; ++i) q[i] -= bench.pull * previous[i];
    return q;
}

// One method on one problem. frame(f, previous, w): solves frame f; reset(): forgets everything.
struct Method {
    std::string name;
    std::function<void()> reset;
    std::function<void(std::size_t, const std::vector<double>&, std::vector<double>&)> prepare_and_solve;
    std::size_t every = 1;  // frames between measured ones: slow methods and cold starts take a sample
    // The floor's time at the frame just solved, us: beside the method's, since a shared machine's clock rate
    // moves from one second to the next.
    std::function<double(std::size_t, const std::vector<double>&)> floor_us = nullptr;
};

struct Row {
    std::vector<double> us, floor_us, kkt, excess;
    double heap_calls_a_frame = 0.0;
};

// The timed part of a method brackets itself: preparing inputs in its own format is not its work.
double timed_us = 0.0;
std::uint64_t timed_heap = 0;
double clock_us = 0.0;

template <typename Work>
void timed(Work&& work) {
    const std::uint64_t heap = heap_calls.load();
    const double began = bench::thread_cpu_us();
    work();
    timed_us = bench::thread_cpu_us() - began - clock_us;
    timed_heap += heap_calls.load() - heap;
}

struct Truth {
    std::vector<std::vector<double>> q;         // of each frame, after the exact previous solution
    std::vector<std::vector<double>> previous;  // exact
    std::vector<double> objective;
    std::vector<double> scale;  // 1/2 |t|^2
};

// The exact answers in double, each frame pulled to the exact answer before: every method gets the same
// problems.
Truth exact(const Bench& bench) {
    const std::size_t n = bench.family.shapes;
    const std::size_t stride = row_stride(n);
    std::vector<double> h(n * stride, 0.0);
    for (std::size_t i = 0; i < n; ++i) std::copy_n(bench.hessian.data() + i * n, n, h.data() + i * stride);
    const auto state = std::make_unique<BoxQpState<double>>();
    const auto workspace = std::make_unique<BoxQpWorkspace<double>>();
    Truth truth;
    std::vector<double> w(n, 0.0);
    for (std::size_t f = 0; f < bench.data.targets.size(); ++f) {
        truth.previous.push_back(w);
        truth.q.push_back(linear_of(bench, f, w));
        const BoxQpReport report =
            solve_box_qp({n, stride, h, truth.q.back(), bench.low, bench.high, 1}, {.tolerance = 1e-11},
                         *state, *workspace, std::span<double>(w));
        if (report.kkt > 1e-7)
            fmt::print(stderr, "bench_solve: frame {}: reference kkt {:.1e}\n", f, report.kkt);
        truth.objective.push_back(judge(bench, truth.q.back(), w).objective);
        double square = 0.0;
        for (const double t : bench.data.targets[f]) square += t * t;
        truth.scale.push_back(0.5 * square);
    }
    return truth;
}

Row measure(const Bench& bench, const Truth& truth, const Method& method, int replays) {
    const std::size_t frames = bench.data.targets.size();
    Row row;
    row.us.assign((frames + method.every - 1) / method.every, std::numeric_limits<double>::infinity());
    row.floor_us = row.us;
    std::vector<double> w(bench.family.shapes, 0.0);
    timed_heap = 0;
    for (int replay = 0; replay < replays; ++replay) {
        method.reset();
        std::fill(w.begin(), w.end(), 0.0);
        for (std::size_t f = 0; f < frames; f += method.every) {
            method.prepare_and_solve(f, truth.previous[f], w);
            double& least = row.us[f / method.every];
            least = std::min(least, timed_us);
            if (method.floor_us) {
                double& floor = row.floor_us[f / method.every];
                floor = std::min(floor, method.floor_us(f, truth.previous[f]));
            }
            if (replay > 0) continue;
            const Judgement j = judge(bench, truth.q[f], w);
            row.kkt.push_back(j.kkt);
            row.excess.push_back((j.objective - truth.objective[f]) / truth.scale[f]);
        }
    }
    row.heap_calls_a_frame =
        static_cast<double>(timed_heap) / static_cast<double>(replays) / static_cast<double>(row.us.size());
    return row;
}

// core's solver with its B^T t, as a frame of the rig would run it.
template <typename Real>
class OwnSolver {
  public:
    OwnSolver(const Bench& bench, double tolerance)
        : bench_(bench), n_(bench.family.shapes), stride_(row_stride(n_)), config_{.tolerance = tolerance} {
        basis_.assign(bench.family.rows * stride_, Real(0));
        hessian_.assign(n_ * stride_, Real(0));
        for (std::size_t r = 0; r < bench.family.rows; ++r) {
            for (std::size_t i = 0; i < n_; ++i)
                basis_[r * stride_ + i] = static_cast<Real>(bench.data.basis[r * n_ + i]);
        }
        for (std::size_t i = 0; i < n_; ++i) {
            for (std::size_t j = 0; j < n_; ++j)
                hessian_[i * stride_ + j] = static_cast<Real>(bench.hessian[i * n_ + j]);
        }
        low_.assign(bench.low.begin(), bench.low.end());
        high_.assign(bench.high.begin(), bench.high.end());
        linear_.assign(stride_, Real(0));
        start_.assign(stride_, Real(0));
        target_.assign(bench.family.rows, Real(0));
        w_.assign(stride_, Real(0));
    }

    void reset() {
        state_->warm = false;
        std::fill(w_.begin(), w_.end(), Real(0));
    }

    void solve(std::size_t frame, const std::vector<double>& previous, std::vector<double>& w, bool cold) {
        load(frame, previous);
        if (cold) reset();
        timed([&] {
            combine_rows(basis_.data(), stride_, target_.data(), bench_.family.rows, padded(n_),
                         start_.data(), linear_.data());
            report_ = solve_box_qp({n_, stride_, hessian_, linear_, low_, high_, 1}, config_, *state_,
                                   *workspace_, std::span<Real>(w_.data(), n_));
        });
        for (std::size_t i = 0; i < n_; ++i) w[i] = static_cast<double>(w_[i]);
    }

    // At the working set of the frame that was solved last.
    double floor_us(std::size_t frame, const std::vector<double>& previous) {
        load(frame, previous);
        const std::size_t k = state_->free_count;
        std::size_t moving = 0;
        for (std::size_t i = 0; i < n_; ++i) {
            if (w_[i] == Real(0)) continue;
            index_[moving] = static_cast<std::uint16_t>(i);
            coefficient_[moving++] = w_[i];
        }
        timed([&] {
            combine_rows(basis_.data(), stride_, target_.data(), bench_.family.rows, padded(n_),
                         start_.data(), linear_.data());
            for (std::size_t a = 0; a < k; ++a) free_[a] = linear_[state_->free[a]];
            combine_rows(state_->inverse.data(), BoxQpState<Real>::kInverseStride, free_.data(), k, k,
                         nullptr, step_.data());
            combine_rows(hessian_.data(), stride_, index_.data(), coefficient_.data(), moving, n_,
                         linear_.data(), gradient_.data());
        });
        return timed_us;
    }

    [[nodiscard]] const BoxQpReport& report() const { return report_; }
    [[nodiscard]] std::size_t free_count() const { return state_->free_count; }

  private:
    void load(std::size_t frame, const std::vector<double>& previous) {
        for (std::size_t r = 0; r < target_.size(); ++r)
            target_[r] = static_cast<Real>(-bench_.data.targets[frame][r]);
        for (std::size_t i = 0; i < n_; ++i)
            start_[i] = static_cast<Real>(0.5 * bench_.beta - bench_.pull * previous[i]);
    }

    const Bench& bench_;
    std::size_t n_, stride_;
    BoxQpConfig config_;
    BoxQpReport report_;
    std::vector<Real> basis_, hessian_, low_, high_, linear_, start_, target_, w_;
    std::vector<Real> free_ = std::vector<Real>(kMaxUnknowns), step_ = free_, gradient_ = free_,
                      coefficient_ = free_;
    std::vector<std::uint16_t> index_ = std::vector<std::uint16_t>(kMaxUnknowns);
    std::unique_ptr<BoxQpState<Real>> state_ = std::make_unique<BoxQpState<Real>>();
    std::unique_ptr<BoxQpWorkspace<Real>> workspace_ = std::make_unique<BoxQpWorkspace<Real>>();
};

Eigen::VectorXf to_eigen(const std::vector<double>& v) {
    Eigen::VectorXf out(static_cast<Eigen::Index>(v.size()));
    for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = static_cast<float>(v[static_cast<std::size_t>(i)]);
    return out;
}

// The rivals get q ready made: their B^T t would be the same product.
class Rivals {
  public:
    explicit Rivals(const Bench& bench, const Truth& truth) : truth_(truth) {
        const auto n = static_cast<Eigen::Index>(bench.family.shapes);
        problem_.hessian.resize(n, n);
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j < n; ++j) {
                problem_.hessian(i, j) =
                    static_cast<float>(bench.hessian[static_cast<std::size_t>(i * n + j)]);
            }
        }
        problem_.low = to_eigen(bench.low);
        problem_.high = to_eigen(bench.high);
        admm_ = std::make_unique<test::CachedInverseAdmm>(problem_, 0.1F);
        hessian_ = dlib::mat(problem_.hessian);
        low_ = dlib::mat(problem_.low);
        // dlib multiplies the bounds, so no infinities: none of these weights comes near
        high_ = dlib::mat(Eigen::VectorXf(problem_.high.cwiseMin(1e3F)));
        w_ = Eigen::VectorXf::Zero(n);
        alpha_ = dlib::zeros_matrix<float>(n, 1);
    }

    void reset() {
        w_.setZero();
        alpha_ = 0.0F;
        admm_->forget();
    }

    void textbook(std::size_t frame, std::vector<double>& w) {
        const Eigen::VectorXf q = to_eigen(truth_.q[frame]);
        timed([&] { test::bounded_least_squares(problem_, q, w_); });
        copy(w);
    }
    void admm(std::size_t frame, std::vector<double>& w) {
        const Eigen::VectorXf q = to_eigen(truth_.q[frame]);
        timed([&] { admm_->solve(q, 1e-5F, 4000, w_); });
        copy(w);
    }
    void dlib_box(std::size_t frame, std::vector<double>& w) {
        const Eigen::VectorXf q = to_eigen(truth_.q[frame]);
        const dlib::matrix<float, 0, 1> b = dlib::mat(q);
        timed([&] { dlib::solve_qp_box_constrained(hessian_, b, alpha_, low_, high_, 1e-6F, 10'000); });
        for (std::size_t i = 0; i < w.size(); ++i) w[i] = static_cast<double>(alpha_(static_cast<long>(i)));
    }

  private:
    void copy(std::vector<double>& w) const {
        for (std::size_t i = 0; i < w.size(); ++i)
            w[i] = static_cast<double>(w_[static_cast<Eigen::Index>(i)]);
    }

    const Truth& truth_;
    test::TextbookProblem problem_;
    std::unique_ptr<test::CachedInverseAdmm> admm_;
    dlib::matrix<float> hessian_;
    dlib::matrix<float, 0, 1> low_, high_, alpha_;
    Eigen::VectorXf w_;
};

void print_row(const std::string& problem, const std::string& name, const Row& row, double floor_us) {
    const double p50 = bench::quantile(row.us, 0.5);
    const double p99 = bench::quantile(row.us, 0.99);
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1e} | {:.1e} | {:.1f} |\n", problem, name,
               p50, p99, p50 / floor_us, p99 / floor_us, bench::quantile(row.kkt, 0.99),
               bench::quantile(row.excess, 1.0), row.heap_calls_a_frame);
}

struct Options {
    std::size_t frames = 2000;
    int replays = 5;
    std::uint64_t seed = 1;
    bool rivals = true;
};

// What the float solver of a problem gives: the floor, and for the growth with N its warm time, us.
struct Reference {
    double floor_us = 0.0;
    double warm_us = 0.0;
};

std::string label_of(const Bench& bench) {
    return fmt::format("{} {}x{}", bench.family.kind, bench.family.rows, bench.family.shapes);
}

// `floor`: the float solver whose floor is the problem's; `own` itself, or one that solves along.
template <typename Real>
Reference run_own(const Bench& bench, const Truth& truth, const Options& options, const std::string& name,
                  OwnSolver<Real>& own, OwnSolver<float>& floor) {
    constexpr bool kFloat = std::is_same_v<Real, float>;
    std::vector<double> changes, free, along(bench.family.shapes);
    const auto floor_us = [&](std::size_t f, const std::vector<double>& previous) {
        if (!kFloat) floor.solve(f, previous, along, false);
        return floor.floor_us(f, previous);
    };
    const auto reset = [&] {
        own.reset();
        floor.reset();
    };
    const Method warm{name + ", warm", reset,
                      [&](std::size_t f, const std::vector<double>& previous, std::vector<double>& w) {
                          own.solve(f, previous, w, false);
                          changes.push_back(own.report().changes);
                          free.push_back(static_cast<double>(own.free_count()));
                      },
                      1, floor_us};
    const Row row = measure(bench, truth, warm, options.replays);
    const double least_us = bench::quantile(row.floor_us, 0.5);
    if (kFloat) {
        fmt::print("| {} | floor | {:.2f} | {:.2f} | 1 | {:.2f} | | | 0 |\n", label_of(bench), least_us,
                   bench::quantile(row.floor_us, 0.99), bench::quantile(row.floor_us, 0.99) / least_us);
    }
    print_row(label_of(bench),
              fmt::format("{} ({:.0f} free, {:.0f} changes)", warm.name, bench::quantile(free, 0.5),
                          bench::quantile(changes, 0.5)),
              row, least_us);
    const Method cold{name + ", cold", reset,
                      [&](std::size_t f, const std::vector<double>& previous, std::vector<double>& w) {
                          own.solve(f, previous, w, true);
                      },
                      10, floor_us};
    const Row cold_row = measure(bench, truth, cold, options.replays);
    print_row(label_of(bench), cold.name, cold_row, bench::quantile(cold_row.floor_us, 0.5));
    return {least_us, bench::quantile(row.us, 0.5)};
}

void run_rivals(const Bench& bench, const Truth& truth, double floor) {
    Rivals rivals(bench, truth);
    const auto method = [&](const char* name, auto act) {
        return Method{name, [&] { rivals.reset(); },
                      [&rivals, act](std::size_t f, const std::vector<double>&, std::vector<double>& w) {
                          (rivals.*act)(f, w);
                      }};
    };
    const bool a = bench.family.kind == 'a';
    for (const Method& m :
         {method(a ? "textbook Lawson-Hanson, warm" : "textbook BVLS, warm", &Rivals::textbook),
          method("cached-inverse ADMM, warm", &Rivals::admm),
          method("dlib box QP, warm", &Rivals::dlib_box)}) {
        print_row(label_of(bench), m.name, measure(bench, truth, m, 1), floor);
    }
}

// The time of one multiply-add, in pairs of an application of the inverse and a rank-one update of it at the
// most shapes there can be.
template <typename Real>
double multiply_add_us() {
    constexpr std::size_t kSize = kMaxShapes;
    constexpr std::size_t kStride = row_stride(kSize);
    constexpr int kPairs = 50;
    std::vector<Real> m(kSize * kStride, Real(0)), u(kStride, Real(1e-3)), out(kStride, Real(0));
    double least = std::numeric_limits<double>::infinity();
    for (int replay = 0; replay < 20; ++replay) {
        timed([&] {
            for (int pair = 0; pair < kPairs; ++pair) {
                combine_rows(m.data(), kStride, u.data(), kSize, kSize, nullptr, out.data());
                add_square(m.data(), kStride, kSize, u.data());
            }
        });
        least = std::min(least, timed_us);
    }
    return least / (2.0 * kPairs * static_cast<double>(kSize * kSize));
}

void print_cap() {
    const auto qp = static_cast<double>(box_qp_work_cap(kMaxShapes));
    const auto normal = static_cast<double>(normal_work_cap(kMaxMarkers, kMaxShapes));
    const double single = multiply_add_us<float>(), precise = multiply_add_us<double>();
    fmt::print(
        "\nthe caps at {} shapes: {:.1f} million multiply-adds of the QP, {:.0f} us in float, {:.0f} us in "
        "double; "
        "{:.1f} million of H with {} markers, {:.0f} and {:.0f} us\n",
        kMaxShapes, 1e-6 * qp, qp * single, qp * precise, 1e-6 * normal, kMaxMarkers, normal * single,
        normal * precise);
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"bench_solve: core's quadratic solvers against dlib and textbook methods"};
    Options options;
    bool quick = false;
    std::string only;
    app.add_option("--frames", options.frames, "frames of each trajectory")->capture_default_str();
    app.add_option("--replays", options.replays, "of each trajectory; a frame's time is the least")
        ->capture_default_str();
    app.add_option("--seed", options.seed, "of the trajectories")->capture_default_str();
    app.add_option("--only", only, "one family: a or b");
    app.add_flag("!--no-rivals", options.rivals, "core's own rows only");
    app.add_flag("--quick", quick, "60 frames, one replay: that it runs");
    CLI11_PARSE(app, argc, argv);
    if (quick) {
        options.frames = 60;
        options.replays = 1;
    }
    clock_us = bench::clock_cost_us();
    fmt::print("{} frames, {} replays, seed {}; the clock's own cost of {:.2f} us is taken off\n\n",
               options.frames, options.replays, options.seed, clock_us);
    fmt::print(
        "| problem | method | p50 us | p99 us | p50 / floor | p99 / floor | kkt p99 | worst excess of the "
        "objective / (1/2 t^2) | heap calls a frame |\n|---|---|---|---|---|---|---|---|---|\n");
    double smallest = 0.0, largest = 0.0;
    bool sound = true;
    for (const Family& family :
         {Family{'b', 66, 12}, Family{'b', 150, 46}, Family{'b', 306, 46}, Family{'b', 150, 140},
          Family{'b', 306, 280}, Family{'a', 150, 46}, Family{'a', 150, 140}}) {
        if (!only.empty() && only[0] != family.kind) continue;
        const Bench bench(family, options.frames, options.seed);
        const Truth truth = exact(bench);
        OwnSolver<float> single(bench, 1e-6);
        const auto [floor_us, p50] = run_own<float>(bench, truth, options, "core, float", single, single);
        // As tight as the stage asks for where nothing regularises: with a loose one the objective of a
        // 150x140 is off by more than a millionth on some seeds.
        if (family.kind == 'a') {
            OwnSolver<double> precise(bench, 1e-9);
            run_own<double>(bench, truth, options, "core, double", precise, single);
        }
        if (options.rivals) run_rivals(bench, truth, floor_us);
        if (family.kind == 'b' && family.rows == 306 && family.shapes == 46) smallest = p50;
        if (family.kind == 'b' && family.shapes == 280) largest = p50;
        sound = sound && std::isfinite(p50);
    }
    if (smallest > 0.0 && largest > 0.0) {
        fmt::print("\ngrowth of b warm from 46 to 280 shapes (306 rows): exponent {:.2f}\n",
                   std::log(largest / smallest) / std::log(280.0 / 46.0));
    }
    print_cap();
    return sound ? 0 : 1;
}
