#include "core/solve/simplex_walk.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr std::size_t kStride = kMaxRegionShapes;
constexpr double kTilt = 1e-10;
constexpr double kLeastShift_mm2 = 1e-8;  // examples within 0.1 um of each other are equal
static_assert(kMaxRegionShapes <= 32);    // one bit each

class Walk {
  public:
    Walk(const SimplexWalkProblem& problem, double tolerance, SimplexWalkState& state,
         SimplexWalkWorkspace& ws, std::uint32_t& used, SimplexWalkReport& report)
        : p_(problem),
          state_(state),
          ws_(ws),
          used_(used),
          report_(report),
          n_(problem.count),
          tolerance_(tolerance) {}

    void run(std::uint16_t iteration_cap, std::span<float> c);

  private:
    [[nodiscard]] bool in_use(std::size_t i) const { return (used_ >> i & 1U) != 0; }
    [[nodiscard]] double diagonal(std::size_t i) const { return state_.gram[i * kStride + i] + shift_; }
    void mark(std::size_t i, bool in_use);
    void sum_up();
    bool aim();
    bool advance();
    void measure();
    bool enter();
    void certify();

    const SimplexWalkProblem& p_;
    SimplexWalkState& state_;
    SimplexWalkWorkspace& ws_;
    std::uint32_t& used_;
    SimplexWalkReport& report_;
    std::size_t n_;
    double tolerance_;
    double shift_ = 1.0;
    double tilt_ = 0.0;
    double lambda_ = 0.0;
    std::size_t standstills_ = 0;
    std::uint32_t refused_ = 0;  // did not fit into a factor
};

void Walk::run(std::uint16_t iteration_cap, std::span<float> c) {
    sum_up();
    for (std::size_t i = 0; i < n_; ++i) ws_.c[i] = static_cast<double>(c[i]);
    bool going = true;
    while (going && report_.iterations < iteration_cap) {
        ++report_.iterations;
        if (!aim()) break;
        if (!advance()) continue;
        measure();
        going = enter();
    }
    certify();
    report_.optimal = !going && report_.kkt <= 4.0 * tolerance_;
    for (std::size_t i = 0; i < n_; ++i) c[i] = static_cast<float>(ws_.c[i]);
}

void Walk::mark(std::size_t i, bool in_use) {
    used_ = in_use ? used_ | 1U << i : used_ & ~(1U << i);
    ++report_.changes;
}

void Walk::sum_up() {
    const bool new_gram = !state_.has_gram;
    if (new_gram) state_.gram.fill(0.0);
    ws_.linear.fill(0.0);
    for (std::size_t r = 0; r < p_.rows; ++r) {
        const double weight = p_.row_weight.empty() ? 1.0 : static_cast<double>(p_.row_weight[r]);
        if (!(weight > 0.0)) continue;
        const float* row = p_.examples.data() + r * p_.stride;
        const double target = weight * static_cast<double>(p_.target[r]);
        for (std::size_t i = 0; i < n_; ++i) {
            const auto x = static_cast<double>(row[i]);
            ws_.linear[i] += target * x;
            if (!new_gram) continue;
            for (std::size_t j = 0; j < n_; ++j)
                state_.gram[i * kStride + j] += weight * x * static_cast<double>(row[j]);
        }
    }
    state_.has_gram = true;
    double trace = 0.0;
    for (std::size_t i = 0; i < n_; ++i) trace += state_.gram[i * kStride + i];
    shift_ = is_finite(trace) ? std::max(trace / static_cast<double>(n_), kLeastShift_mm2) : 1.0;
    tilt_ = kTilt * shift_;
    double largest = 0.0;
    for (std::size_t i = 0; i < n_; ++i) largest = std::max(largest, std::fabs(ws_.linear[i]));
    tolerance_ *= std::max(1.0, largest / shift_);
}

// The minimum on the affine span of the examples in use: x = H^-1 (b - lambda 1), H = A + shift 1 1^T + tilt
// I.
bool Walk::aim() {
    std::size_t k = 0;
    for (std::size_t i = 0; i < n_; ++i) {
        if (in_use(i)) ws_.used[k++] = static_cast<std::uint16_t>(i);
    }
    for (std::size_t a = 0; a < k; ++a) {
        for (std::size_t b = 0; b <= a; ++b) {
            ws_.factor[a * kStride + b] = state_.gram[ws_.used[a] * kStride + ws_.used[b]] + shift_;
        }
        ws_.factor[a * kStride + a] += tilt_;
        ws_.aim[a] = ws_.linear[ws_.used[a]];
        ws_.ones[a] = 1.0;
    }
    if (k == 0 || !cholesky(ws_.factor.data(), ws_.factor.data(), k, kStride)) return false;
    for (double* x : {ws_.aim.data(), ws_.ones.data()}) {
        solve_lower(ws_.factor.data(), k, kStride, x);
        solve_lower_transposed(ws_.factor.data(), k, kStride, x);
    }
    double sum = 0.0;
    double sums = 0.0;
    for (std::size_t a = 0; a < k; ++a) {
        sum += ws_.aim[a];
        sums += ws_.ones[a];
    }
    for (std::size_t a = 0; a < k; ++a) ws_.aim[a] += (1.0 - sum) / sums * ws_.ones[a];
    // spread out, from the back so that nothing is written over
    for (std::size_t i = n_, a = k; i-- > 0;) ws_.aim[i] = in_use(i) ? ws_.aim[--a] : 0.0;
    return is_finite(sum) && is_finite(sums) && sums > 0.0;
}

// Towards the aim as far as the coefficients stay non-negative; the one that becomes zero leaves. True for
// all the way.
bool Walk::advance() {
    double length = 1.0;
    std::size_t blocking = n_;
    for (std::size_t i = 0; i < n_; ++i) {
        if (!(ws_.aim[i] < 0.0)) continue;
        const double room = ws_.c[i] / (ws_.c[i] - ws_.aim[i]);
        if (blocking != n_ && !(room < length)) continue;
        length = room;
        blocking = i;
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
        ws_.c[i] = blocking == n_ ? ws_.aim[i] : std::max(0.0, ws_.c[i] + length * (ws_.aim[i] - ws_.c[i]));
        if (i == blocking) ws_.c[i] = 0.0;
        sum += ws_.c[i];
    }
    for (std::size_t i = 0; i < n_; ++i) ws_.c[i] /= sum;
    standstills_ = length > 0.0 ? 0 : standstills_ + 1;
    if (blocking == n_) return true;
    mark(blocking, false);
    return false;
}

void Walk::measure() {
    lambda_ = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
        ws_.pull[i] =
            ws_.linear[i] - dot(state_.gram.data() + i * kStride, ws_.c.data(), n_) - tilt_ * ws_.c[i];
        lambda_ += ws_.c[i] * ws_.pull[i];
    }
}

// The unused example that pulls hardest; after as many standstills as there are examples the first that pulls
// at all (Bland's rule). False: none.
bool Walk::enter() {
    std::size_t best = n_;
    double largest = tolerance_;
    for (std::size_t i = 0; i < n_; ++i) {
        const double move = (ws_.pull[i] - lambda_) / diagonal(i);
        if (in_use(i) || (refused_ >> i & 1U) != 0 || !(move > largest)) continue;
        best = i;
        largest = move;
        if (standstills_ > n_) break;
    }
    if (best == n_) return false;
    if (standstills_ > 0) refused_ |= 1U << best;  // a second chance at most, where rounding decides
    mark(best, true);
    return true;
}

// Of the problem itself: without the tilt.
void Walk::certify() {
    tilt_ = 0.0;
    measure();
    double highest = lambda_;
    for (std::size_t i = 0; i < n_; ++i) {
        const double target = std::max(0.0, ws_.c[i] + (ws_.pull[i] - lambda_) / diagonal(i));
        report_.kkt = std::max(report_.kkt, std::fabs(ws_.c[i] - target));
        highest = std::max(highest, ws_.pull[i]);
        report_.objective -= 0.5 * ws_.c[i] * (ws_.pull[i] + ws_.linear[i]);
    }
    report_.gap = highest - lambda_;
}

}  // namespace

SimplexWalkReport walk_simplex(const SimplexWalkProblem& problem, double tolerance,
                               std::uint16_t iteration_cap, SimplexWalkState& state,
                               SimplexWalkWorkspace& workspace, std::uint32_t& used, std::span<float> c) {
    RIG_CHECK(problem.count > 0 && problem.count <= kMaxRegionShapes && c.size() >= problem.count);
    RIG_CHECK(problem.examples.size() >= problem.rows * problem.stride && problem.stride >= problem.count);
    RIG_CHECK(problem.target.size() >= problem.rows);
    RIG_CHECK(problem.row_weight.empty() || problem.row_weight.size() >= problem.rows);
    SimplexWalkReport report;
    Walk(problem, tolerance, state, workspace, used, report).run(iteration_cap, c);
    return report;
}

}  // namespace rig
