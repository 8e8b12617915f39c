// Published problems: core's answer and the textbooks' against the printed one, from both sides. A convex
// combination is solved by a sequence of box problems, and by the solver of its own in the last test.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "core/solve/nnls.hpp"
#include "core/solve/simplex_qp.hpp"
#include "tests/support/published_problems.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/textbook_solvers.hpp"

namespace rig {
namespace {

using test::PublishedKind;
using test::PublishedProblem;
using Numbers = std::vector<long double>;

std::vector<PublishedProblem> problems_of(PublishedKind kind) {
    test::PublishedProblems all = test::load_published_problems();
    EXPECT_EQ(all.fault, "");
    std::erase_if(all.problems, [kind](const PublishedProblem& p) { return p.kind != kind; });
    return all.problems;
}

// Of H with its diagonal scaled to 1: what rounding is multiplied by on its way to x.
double condition_of(const PublishedProblem& p) {
    const auto n = static_cast<Eigen::Index>(p.size);
    Eigen::MatrixXd h(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
            const auto at = [&](Eigen::Index r, Eigen::Index c) {
                return static_cast<double>(p.hessian[static_cast<std::size_t>(r * n + c)]);
            };
            h(i, j) = at(i, j) / std::sqrt(std::max(1e-300, at(i, i) * at(j, j)));
        }
    }
    const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(h).eigenvalues();
    return values.maxCoeff() / std::max(values.minCoeff(), 1e-16 * values.maxCoeff());
}

// Sum of the magnitudes that f is the difference of: what its rounding is relative to.
long double terms_of(const PublishedProblem& p, const Numbers& x) {
    long double sum = std::fabs(p.constant);
    for (std::size_t i = 0; i < p.size; ++i) {
        sum += std::fabs(p.linear[i] * x[i]);
        for (std::size_t j = 0; j < p.size; ++j)
            sum += 0.5L * std::fabs(p.hessian[i * p.size + j] * x[i] * x[j]);
    }
    return sum;
}

struct Objective {
    long double value = 0.0L;
    long double half_unit = 0.0L;
};

// The published objective, or f at the published optimum with what its last digit leaves open.
Objective objective_of(const PublishedProblem& p) {
    if (p.has_objective) return {p.objective, p.objective_half_unit};
    Objective out{p.value(p.optimum), 0.0L};
    const Numbers slope = p.gradient(p.optimum);
    for (std::size_t i = 0; i < p.size; ++i) {
        // An entry on its bound is printed exactly.
        if (p.optimum[i] == p.low[i] || p.optimum[i] == p.high[i]) continue;
        out.half_unit += std::fabs(slope[i]) * p.optimum_half_unit;
        for (std::size_t j = 0; j < p.size; ++j) {
            out.half_unit +=
                0.5L * std::fabs(p.hessian[i * p.size + j]) * p.optimum_half_unit * p.optimum_half_unit;
        }
    }
    return out;
}

// `rounding` relative to the numbers that were added; `condition` of the H that was solved with.
void expect_published(const PublishedProblem& p, const Numbers& x, long double rounding, double condition,
                      const std::string& who) {
    const Objective published = objective_of(p);
    // Beside a zero the second term says nothing: f is flat there, and x as exact as `rounding`.
    const long double room = published.half_unit + rounding * terms_of(p, x) + rounding * rounding;
    EXPECT_LE(p.value(x), published.value + room) << p.name << ", " << who << ": not the optimum";
    EXPECT_GE(p.value(x), published.value - room) << p.name << ", " << who << ": better than published";
    const long double reach = static_cast<long double>(condition) * rounding;
    if (p.optimum.empty() || reach > 1e-2L) return;  // x is lost in rounding; f is not
    for (std::size_t i = 0; i < p.size; ++i) {
        const long double size = std::max(1.0L, std::fabs(p.optimum[i]));
        EXPECT_NEAR(static_cast<double>(x[i]), static_cast<double>(p.optimum[i]),
                    static_cast<double>(p.optimum_half_unit + reach * size))
            << p.name << ", " << who << ", x" << i + 1 << ", condition " << condition;
    }
}

// Core's solver on a published problem, in one precision.
template <typename Real>
class Solved {
  public:
    explicit Solved(const PublishedProblem& p)
        : stride_(row_stride(p.size)),
          h_(p.size * stride_, Real(0)),
          state_(std::make_unique<BoxQpState<Real>>()),
          workspace_(std::make_unique<BoxQpWorkspace<Real>>()) {
        for (std::size_t i = 0; i < p.size; ++i) {
            for (std::size_t j = 0; j < p.size; ++j)
                h_[i * stride_ + j] = static_cast<Real>(p.hessian[i * p.size + j]);
            q_.push_back(static_cast<Real>(p.linear[i]));
            low_.push_back(static_cast<Real>(p.low[i]));
            high_.push_back(static_cast<Real>(p.high[i]));
        }
    }
    Numbers solve(std::vector<Real> start) {
        report = solve_box_qp({q_.size(), stride_, h_, q_, low_, high_, 1}, config_, *state_, *workspace_,
                              std::span<Real>(start));
        return {start.begin(), start.end()};
    }
    // Leaves the state of the opposite problem behind: q negated, with bounds that keep it bounded.
    void make_hostile() {
        std::vector<Real> q = q_;
        std::vector<Real> low = low_;
        std::vector<Real> high = high_;
        for (Real& x : q) x = -x;
        for (Real& x : low) x = std::max(x, Real(-1000));
        for (Real& x : high) x = std::min(x, Real(1000));
        std::vector<Real> w = high;
        (void)solve_box_qp({q.size(), stride_, h_, q, low, high, 1}, config_, *state_, *workspace_,
                           std::span<Real>(w));
        ASSERT_TRUE(state_->warm);
    }
    // The corner that is furthest from where the linear term points.
    [[nodiscard]] std::vector<Real> worst_corner() const {
        std::vector<Real> out;
        for (std::size_t i = 0; i < q_.size(); ++i) {
            out.push_back(q_[i] > Real(0) ? std::min(high_[i], Real(1e4)) : std::max(low_[i], Real(-1e4)));
        }
        return out;
    }
    BoxQpReport report;

  private:
    std::size_t stride_;
    std::vector<Real> h_, q_, low_, high_;
    BoxQpConfig config_{.tolerance = sizeof(Real) == sizeof(float) ? 1e-6 : 1e-9};
    std::unique_ptr<BoxQpState<Real>> state_;
    std::unique_ptr<BoxQpWorkspace<Real>> workspace_;
};

template <typename Real>
void solve_all() {
    constexpr bool kSingle = sizeof(Real) == sizeof(float);
    constexpr long double kRounding = kSingle ? 2e-6L : 1e-12L;
    const std::string precision = kSingle ? "float" : "double";
    for (const PublishedProblem& p : problems_of(PublishedKind::kBox)) {
        Solved<Real> solver(p);
        expect_published(p, solver.solve(std::vector<Real>(p.size, Real(0))), kRounding, condition_of(p),
                         precision + " cold");
        EXPECT_TRUE(solver.report.optimal) << p.name << ", " << precision << " cold, " << solver.report.kkt;
        solver.make_hostile();
        expect_published(p, solver.solve(solver.worst_corner()), kRounding, condition_of(p),
                         precision + " hostile");
        EXPECT_TRUE(solver.report.optimal)
            << p.name << ", " << precision << " hostile, " << solver.report.kkt;
    }
}

std::string fault_of(const std::string& text) {
    const test::TempFolder folder;
    std::ofstream(folder.path() / "p.txt") << text;
    return test::load_published_problems(folder.path()).fault;
}

TEST(PublishedProblems, AreReadOrRefused) {
    const std::string good =
        "# x^2 - x\nname p\nkind box\nsize 1\nform quadratic\nhessian 2\nlinear -1\nconstant 0\n"
        "low -inf\nhigh inf\noptimum 0.5\noptimum_half_unit 0.05\n";
    EXPECT_EQ(fault_of(good), "");
    for (const char* line : {"name p", "kind box", "size 1", "form quadratic", "hessian 2", "linear -1",
                             "constant 0", "low -inf", "optimum 0.5", "optimum_half_unit 0.05"}) {
        std::string bad = good;
        bad.replace(bad.find(line), std::string(line).size(), "");
        EXPECT_NE(fault_of(bad), "") << "without " << line;
    }
    EXPECT_NE(fault_of(good + "objective nan\nobjective_half_unit 0\n"), "");
    EXPECT_NE(fault_of(good + "linear -1\n"), "");
    EXPECT_NE(fault_of(good + "objective 1 2\nobjective_half_unit 0\n"), "");
    EXPECT_NE(test::load_published_problems("no_such_folder").fault, "");
    EXPECT_GE(problems_of(PublishedKind::kBox).size(), 20U);
}

TEST(PublishedProblems, AreOptimalAsPrinted) {
    for (const PublishedKind kind : {PublishedKind::kBox, PublishedKind::kSimplex}) {
        for (const PublishedProblem& p : problems_of(kind)) {
            if (p.optimum.empty()) continue;
            const Numbers slope = p.gradient(p.optimum);
            // What half a unit of every entry does to the slope.
            std::vector<long double> open(p.size, 1e-12L * terms_of(p, p.optimum));
            long double sum = 0.0L;
            long double least = std::numeric_limits<long double>::infinity();
            for (std::size_t i = 0; i < p.size; ++i) {
                sum += p.optimum[i];
                least = std::min(least, slope[i]);
                for (std::size_t j = 0; j < p.size; ++j)
                    open[i] += std::fabs(p.hessian[i * p.size + j]) * p.optimum_half_unit;
            }
            const bool simplex = kind == PublishedKind::kSimplex;
            EXPECT_TRUE(!simplex || std::fabs(sum - 1.0L) <= 1e-15L) << p.name;
            for (std::size_t i = 0; i < p.size; ++i) {
                const long double pull = simplex ? slope[i] - least : slope[i];
                const long double room = simplex ? open[i] + *std::ranges::max_element(open) : open[i];
                EXPECT_TRUE(p.optimum[i] >= p.low[i] && p.optimum[i] <= p.high[i]) << p.name;
                EXPECT_TRUE(p.optimum[i] <= p.low[i] || pull <= room) << p.name << ", x" << i + 1;
                EXPECT_TRUE(p.optimum[i] >= p.high[i] || pull >= -room) << p.name << ", x" << i + 1;
            }
        }
    }
}

TEST(PublishedProblems, CoreInDouble) {
    solve_all<double>();
}

TEST(PublishedProblems, CoreInFloat) {
    solve_all<float>();
}

TEST(PublishedProblems, Textbooks) {
    std::size_t tried = 0;
    for (const PublishedProblem& p : problems_of(PublishedKind::kBox)) {
        if (condition_of(p) > 1e4) continue;  // a float Cholesky factor of H itself is all they have
        ++tried;
        const auto n = static_cast<Eigen::Index>(p.size);
        long double mean = 0.0L;  // of the diagonal, which becomes 1: ADMM has one tolerance for f' and x
        for (std::size_t i = 0; i < p.size; ++i)
            mean += p.hessian[i * p.size + i] / static_cast<long double>(p.size);
        test::TextbookProblem book{Eigen::MatrixXf(n, n), Eigen::VectorXf(n), Eigen::VectorXf(n)};
        Eigen::VectorXf q(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto at = static_cast<std::size_t>(i);
            for (Eigen::Index j = 0; j < n; ++j) {
                book.hessian(i, j) =
                    static_cast<float>(p.hessian[at * p.size + static_cast<std::size_t>(j)] / mean);
            }
            q[i] = static_cast<float>(p.linear[at] / mean);
            book.low[i] = static_cast<float>(p.low[at]);
            book.high[i] = static_cast<float>(p.high[at]);
        }
        Eigen::VectorXf w = Eigen::VectorXf::Zero(n);
        test::bounded_least_squares(book, q, w);
        expect_published(p, {w.begin(), w.end()}, 2e-6L, condition_of(p), "bounded least squares");
        test::CachedInverseAdmm admm(book, 0.3F);
        EXPECT_LT(admm.solve(q, 1e-6F, 20'000, w), 20'000) << p.name;
        expect_published(p, {w.begin(), w.end()}, 1e-5L, condition_of(p), "ADMM");
    }
    EXPECT_GE(tried, 15U);
}

// f + lambda (sum x - 1) + weight / 2 (sum x - 1)^2, less its constants.
PublishedProblem augmented(const PublishedProblem& p, long double weight, long double multiplier) {
    PublishedProblem out = p;
    for (long double& h : out.hessian) h += weight;
    for (long double& q : out.linear) q += multiplier - weight;
    return out;
}

long double largest_of(const Numbers& values) {
    long double out = 0.0L;
    for (const long double x : values) out = std::max(out, std::fabs(x));
    return out;
}

// The method of multipliers: minimise augmented f over x >= 0 and let lambda follow the sum's error until
// there is none [Nocedal and Wright 2006, section 17.3].
Numbers solve_convex_combination(const PublishedProblem& p, bool hostile) {
    const long double weight = largest_of(p.hessian);
    long double multiplier = 0.0L;
    Numbers x(p.size, hostile ? 1.0L : 0.0L);
    for (int round = 0; round < 200; ++round) {
        Solved<double> solver(augmented(p, weight, multiplier));
        if (hostile) solver.make_hostile();
        x = solver.solve({x.begin(), x.end()});
        const long double off = std::accumulate(x.begin(), x.end(), -1.0L);
        if (std::fabs(off) < 1e-9L) break;  // as exact as a solve is
        multiplier += weight * off;
    }
    return x;
}

TEST(PublishedProblems, ConvexCombinations) {
    const std::vector<PublishedProblem> problems = problems_of(PublishedKind::kSimplex);
    EXPECT_GE(problems.size(), 2U);
    for (const PublishedProblem& p : problems) {
        const double condition = condition_of(augmented(p, largest_of(p.hessian), 0.0L));
        for (const bool hostile : {false, true}) {
            const Numbers x = solve_convex_combination(p, hostile);
            EXPECT_NEAR(static_cast<double>(std::accumulate(x.begin(), x.end(), 0.0L)), 1.0, 1e-8) << p.name;
            expect_published(p, x, 1e-9L, condition, hostile ? "hostile" : "cold");
        }
    }
}

// x >= 0 by the solver of key shapes.
Numbers solve_non_negative(const PublishedProblem& p) {
    const auto state = std::make_unique<NnlsState>();
    const auto workspace = std::make_unique<NnlsWorkspace>();
    std::vector<double> hessian(p.hessian.begin(), p.hessian.end());
    std::vector<double> linear;
    for (const long double q : p.linear) linear.push_back(-static_cast<double>(q));
    std::vector<double> x(p.size);
    EXPECT_TRUE(solve_nnls({p.size, p.size, hessian, linear}, *state, *workspace, x).optimal) << p.name;
    return {x.begin(), x.end()};
}

// A convex combination by the solver of examples: G with G^T G = H and g with G^T g = -q.
Numbers solve_of_examples(const PublishedProblem& p) {
    const auto n = static_cast<Eigen::Index>(p.size);
    Eigen::MatrixXd h(n, n);
    Eigen::VectorXd q(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        q[i] = static_cast<double>(p.linear[static_cast<std::size_t>(i)]);
        for (Eigen::Index j = 0; j < n; ++j)
            h(i, j) = static_cast<double>(p.hessian[static_cast<std::size_t>(i * n + j)]);
    }
    // H = V L V^T; where L is zero, q is too.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(h);
    const Eigen::VectorXd roots = parts.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    const Eigen::MatrixXd g = roots.asDiagonal() * parts.eigenvectors().transpose();
    Eigen::VectorXd target = parts.eigenvectors().transpose() * -q;
    for (Eigen::Index r = 0; r < n; ++r)
        target[r] = roots[r] > 1e-7 * roots.maxCoeff() ? target[r] / roots[r] : 0.0;
    EXPECT_LT((g.transpose() * target + q).norm(), 1e-9 * (1.0 + q.norm())) << p.name;
    const std::size_t stride = padded(p.size);
    struct alignas(64) Lanes {
        float values[kLaneFloats];
    };
    std::vector<Lanes> examples(p.size * stride / kLaneFloats), gram(p.size * stride / kLaneFloats);
    std::vector<float> measured, c(p.size);
    for (Eigen::Index r = 0; r < n; ++r) {
        measured.push_back(static_cast<float>(target[r]));
        for (Eigen::Index i = 0; i < n; ++i)
            examples.data()->values[static_cast<std::size_t>(r) * stride + static_cast<std::size_t>(i)] =
                static_cast<float>(g(r, i));
    }
    const std::span<const float> rows{examples.data()->values, p.size * stride};
    const std::span<float> products{gram.data()->values, p.size * stride};
    build_simplex_gram(rows, p.size, p.size, {}, products);
    const auto state = std::make_unique<SimplexQpState>();
    const auto workspace = std::make_unique<SimplexQpWorkspace>();
    const SimplexQpReport report = solve_simplex_qp({p.size, p.size, stride, rows, products, measured, {}, 0},
                                                    {}, *state, *workspace, c);
    EXPECT_TRUE(report.optimal) << p.name;
    return {c.begin(), c.end()};
}

TEST(PublishedProblems, SolversOfRegions) {
    int non_negative = 0;
    for (const PublishedProblem& p : problems_of(PublishedKind::kBox)) {
        const auto from_zero = [](long double x) { return x == 0.0L; };
        const auto without_end = [](long double x) { return std::isinf(x); };
        if (p.size > kMaxRegionShapes || !std::all_of(p.low.begin(), p.low.end(), from_zero) ||
            !std::all_of(p.high.begin(), p.high.end(), without_end))
            continue;
        ++non_negative;
        expect_published(p, solve_non_negative(p), 1e-9L, condition_of(p), "NNLS of a region");
    }
    EXPECT_GE(non_negative, 6);
    for (const PublishedProblem& p : problems_of(PublishedKind::kSimplex))
        expect_published(p, solve_of_examples(p), 2e-6L, condition_of(p), "simplex QP of a region");
}

}  // namespace
}  // namespace rig
