#include "core/solve/simplex_qp.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/base/check.hpp"
#include "core/solve/lanes.hpp"

namespace rig {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLeastShift_mm2 = 1e-8F;  // examples within 0.1 um of each other are equal
// What must be left of an example's square beyond those in use, as a share of it: float's inverse keeps two
// digits then. With less it is the walk's.
constexpr float kLeastRest = 1e-5F;
constexpr float kAccepted = 4.0F;           // tolerances: rounding leaves this much on ill-conditioned faces
constexpr float kLostSum = 0.25F;           // coefficients whose sum is off by this came from no inverse
constexpr int kRefinements = 3;             // each gains the inverse's own accuracy once more
constexpr float kEnterShare = 0.25F;        // of the hardest pull
constexpr float kSameValue = 1e-6F;         // objectives closer than this differ by rounding
constexpr int kPatience = 3;                // exchanges that may pass without a better objective
constexpr int kMostExchanges = 24;          // in one frame; a cold start of 15 examples takes up to 12
constexpr int kChangesBeforeRebuild = 256;  // each leaves its rounding in the inverse

using Set = std::uint32_t;  // one bit an example
static_assert(kMaxRegionShapes <= 32);

bool finite(float x) {
    return std::fabs(x) <= std::numeric_limits<float>::max();
}

constexpr Set bit(std::size_t i) {
    return Set{1} << i;
}

// Takes the first member out of the set.
std::size_t take_first(Set& set) {
    const auto i = static_cast<std::size_t>(std::countr_zero(set));
    set &= set - 1;
    return i;
}

template <std::size_t kWidth>
class FaceWalk {
  public:
    FaceWalk(const SimplexQpProblem& problem, const SimplexQpConfig& config, SimplexQpState& state,
             SimplexQpWorkspace& ws, SimplexQpReport& report)
        : p_(problem), config_(config), s_(state), ws_(ws), report_(report), n_(problem.count) {}

    void run();

  private:
    using Row = Lanes<kWidth>;

    [[nodiscard]] const float* gram() const { return s_.all_rows ? p_.gram.data() : s_.gram.data(); }
    [[nodiscard]] const float* gram_row(std::size_t i) const { return gram() + i * kWidth; }
    [[nodiscard]] float* inverse_row(std::size_t i) { return s_.inverse.data() + i * kWidth; }

    bool adopt_rows();
    void weigh_rows(bool whole, bool& changed);
    void adopt_gram();
    void start_cold();
    bool exchange();
    bool sharpen();
    [[nodiscard]] float objective_at_aim() const;
    void take_out(Set leaving);
    bool bring_in(Set entering);
    bool aim_from(const float* point);
    void measure(const float* at);
    [[nodiscard]] Set wanted() const;
    float project(std::size_t i);
    bool add(std::size_t i);
    void remove(std::size_t i);
    void add_outer_to_inverse(float factor, const float* u);
    void rebuild();
    void mark(std::size_t i, bool in_use);
    void certify();
    void walk();

    const SimplexQpProblem& p_;
    const SimplexQpConfig& config_;
    SimplexQpState& s_;
    SimplexQpWorkspace& ws_;
    SimplexQpReport& report_;
    std::size_t n_;
    float enough_ = 0.0F;    // tolerance at the size of this frame's numbers
    float lambda_ = 0.0F;    // the pull that all examples in use share
    float residual_ = 0.0F;  // largest Jacobi move among them
    float aim_sum_ = 1.0F;
    Set negative_ = 0;  // of the aim
};

template <std::size_t kWidth>
void FaceWalk<kWidth>::run() {
    if (!adopt_rows()) return;
    if (!s_.warm) start_cold();
    if (!s_.has_inverse || s_.changes_since_rebuild > kChangesBeforeRebuild) rebuild();
    if (s_.has_inverse && exchange()) certify();
    if (!report_.optimal) walk();
}

// Which rows count, and G^T V g. The usual frame has every row and is read in place. False: no row is seen,
// and the last answer stays, or the mean of the examples where there is none.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::adopt_rows() {
    int strays = p_.row_weight.empty() ? 0 : 1;
    for (std::size_t r = 0; r < p_.rows; ++r) {
        strays += std::fabs(p_.target[r]) <= kMaxSimplexTarget ? 0 : 1;  // the int keeps this loop in vectors
    }
    const bool whole = strays == 0;
    const bool same = s_.warm && s_.version == p_.version && s_.count == n_ && s_.rows == p_.rows;
    if (!same) s_.warm = false;
    bool changed = !same || whole != s_.all_rows;
    weigh_rows(whole, changed);
    s_.all_rows = whole;
    if (report_.rows_used == 0) {
        report_.optimal = true;
        if (!s_.warm) {
            s_.coefficients.fill(0.0F);
            std::fill_n(s_.coefficients.begin(), n_, 1.0F / static_cast<float>(n_));
        }
        return false;
    }
    const float* target = whole ? p_.target.data() : ws_.weighted.data();
    combine_rows(p_.examples.data(), kWidth, target, p_.rows, kWidth, nullptr, ws_.linear.data());
    if (changed) adopt_gram();
    const float size = Row(ws_.linear.data()).magnitude().largest();
    enough_ = config_.tolerance * std::max(1.0F, size / s_.shift);
    return true;
}

template <std::size_t kWidth>
void FaceWalk<kWidth>::weigh_rows(bool whole, bool& changed) {
    report_.rows_used = static_cast<std::uint16_t>(p_.rows);
    if (whole) return;
    report_.rows_used = 0;
    for (std::size_t r = 0; r < p_.rows; ++r) {
        const bool seen = std::fabs(p_.target[r]) <= kMaxSimplexTarget;
        const float weight = !seen ? 0.0F : p_.row_weight.empty() ? 1.0F : p_.row_weight[r];
        changed |= weight != s_.row_weight[r];
        s_.row_weight[r] = weight;
        ws_.weighted[r] = weight > 0.0F ? weight * p_.target[r] : 0.0F;
        report_.rows_used = static_cast<std::uint16_t>(report_.rows_used + (weight > 0.0F ? 1 : 0));
    }
}

template <std::size_t kWidth>
void FaceWalk<kWidth>::adopt_gram() {
    if (!s_.all_rows) {
        build_simplex_gram(p_.examples, p_.rows, n_, {s_.row_weight.data(), p_.rows}, s_.gram);
    }
    float trace = 0.0F;
    for (std::size_t i = 0; i < n_; ++i) trace += gram_row(i)[i];
    // Any shift is right; this one has the size of the other eigenvalues.
    s_.shift = finite(trace) ? std::max(trace / static_cast<float>(n_), kLeastShift_mm2) : 1.0F;
    s_.inverse_diagonal.fill(0.0F);
    for (std::size_t i = 0; i < n_; ++i) s_.inverse_diagonal[i] = 1.0F / (gram_row(i)[i] + s_.shift);
    s_.version = p_.version;
    s_.count = static_cast<std::uint16_t>(n_);
    s_.rows = static_cast<std::uint16_t>(p_.rows);
    s_.has_inverse = false;
    s_.walk.has_gram = false;
}

// At the nearest single example.
template <std::size_t kWidth>
void FaceWalk<kWidth>::start_cold() {
    std::size_t best = 0;
    float least = kInfinity;
    for (std::size_t i = 0; i < n_; ++i) {
        const float value = 0.5F * gram_row(i)[i] - ws_.linear[i];
        if (value < least) {
            least = value;
            best = i;
        }
    }
    s_.coefficients.fill(0.0F);
    s_.coefficients[best] = 1.0F;
    s_.warm = true;
    s_.used = s_.settled = bit(best);
    s_.has_inverse = false;
}

// Yesterday's set, changed by several examples at once: all whose coefficient on its affine span is negative
// leave together; where none is, all that pull hardest come in. It goes on as long as every such feasible
// point is better than the one before, which cannot go round in circles. The coefficients are the best
// feasible point so far. True: optimal.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::exchange() {
    const int cap = std::min<int>(config_.iteration_cap, kMostExchanges);
    float best = kInfinity;
    int patience = kPatience;
    measure(s_.coefficients.data());
    Row(s_.coefficients.data()).store(ws_.point.data());
    while (report_.iterations < cap && aim_from(ws_.point.data())) {
        ++report_.iterations;
        if (negative_ != 0) {
            take_out(negative_);
            continue;
        }
        if (!sharpen()) return false;
        const float objective = objective_at_aim();
        if (!(objective <= best + kSameValue * std::fabs(objective))) return false;
        if (!(objective < best) && --patience == 0) return false;
        best = std::min(best, objective);
        const Row point = (1.0F / aim_sum_) * Row(ws_.aim.data());
        point.store(ws_.point.data());
        point.store(s_.coefficients.data());
        s_.settled = s_.used;
        const Set entering = wanted();
        if (entering == 0) return true;
        if (!bring_in(entering)) return false;
    }
    return false;
}

// Measures the aim and sharpens it until the inverse's error is gone. False when it stays.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::sharpen() {
    measure(ws_.aim.data());
    for (int i = 0; i < kRefinements && residual_ > enough_; ++i) {
        if (!aim_from(ws_.aim.data()) || negative_ != 0) return false;
        measure(ws_.aim.data());
    }
    return residual_ <= kAccepted * enough_;
}

template <std::size_t kWidth>
float FaceWalk<kWidth>::objective_at_aim() const {
    return -0.5F * (Row(ws_.aim.data()) * (Row(ws_.pull.data()) + Row(ws_.linear.data()))).sum();
}

// Their coefficients go from the point, which changes the pull of the others.
template <std::size_t kWidth>
void FaceWalk<kWidth>::take_out(Set leaving) {
    Row pull(ws_.pull.data());
    while (leaving != 0) {
        const std::size_t i = take_first(leaving);
        pull += ws_.point[i] * Row(gram_row(i));
        ws_.point[i] = 0.0F;
        remove(i);
    }
    pull.store(ws_.pull.data());
}

// Those that pull nearly as hard as the hardest; the others may not want to any more once these are in. False
// when the inverse does not take one.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::bring_in(Set entering) {
    float largest = 0.0F;
    for (Set set = entering; set != 0;) largest = std::max(largest, ws_.move[take_first(set)]);
    entering &= Row(ws_.move.data()).above(kEnterShare * largest);
    while (entering != 0) {
        if (!add(take_first(entering))) return false;
    }
    return true;
}

// aim := the minimum on the affine span of the examples in use: the point + inverse (pull - lambda 1), lambda
// such that it sums to 1. From a point near by, the inverse's own error hardly counts. False: the inverse is
// worn out.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::aim_from(const float* point) {
    const Row sums(s_.inverse_sums.data());
    Row aim(point);
    aim.add_rows(s_.inverse.data(), ws_.pull.data(), n_);
    aim += ((1.0F - aim.sum()) / sums.sum()) * sums;
    aim.store(ws_.aim.data());
    aim_sum_ = aim.sum();
    negative_ = (Row(0.0F) - aim).above(0.0F);
    return std::fabs(aim_sum_ - 1.0F) < kLostSum;  // refuses NaN as well
}

// pull and what follows from it at a point on the affine span of the examples in use.
template <std::size_t kWidth>
void FaceWalk<kWidth>::measure(const float* at) {
    const Row point(at);
    Row fitted(0.0F);
    fitted.add_rows(gram(), at, n_);
    const Row pull = Row(ws_.linear.data()) - fitted;
    lambda_ = (point * pull).sum();
    const Row move = (pull - Row(lambda_)) * Row(s_.inverse_diagonal.data());
    residual_ = (move.magnitude() * Row(s_.used_lane.data())).largest();
    pull.store(ws_.pull.data());
    move.store(ws_.move.data());
}

// Not in use, and would come in by more than the tolerance. The inverse diagonal of padding lanes is zero.
template <std::size_t kWidth>
Set FaceWalk<kWidth>::wanted() const {
    return Row(ws_.move.data()).above(enough_) & ~s_.used;
}

// projection := inverse (Gram_i + shift 1); returns what the diagonal keeps beyond it.
template <std::size_t kWidth>
float FaceWalk<kWidth>::project(std::size_t i) {
    const Row column = Row(gram_row(i)) + Row(s_.shift);
    column.store(ws_.column.data());
    Row projection(0.0F);
    projection.add_rows(s_.inverse.data(), ws_.column.data(), n_);
    projection.store(ws_.projection.data());
    return ws_.column[i] - (column * projection).sum();
}

// Bordering: inverse += u u^T / rest, u = projection - e_i. False when the example depends on those in use.
template <std::size_t kWidth>
bool FaceWalk<kWidth>::add(std::size_t i) {
    const float rest = project(i);
    if (!(rest * s_.inverse_diagonal[i] > kLeastRest)) return false;
    ws_.projection[i] = -1.0F;
    const float scale = 1.0F / rest;
    add_outer_to_inverse(scale, ws_.projection.data());
    const Row u(ws_.projection.data());
    (Row(s_.inverse_sums.data()) + (scale * u.sum()) * u).store(s_.inverse_sums.data());
    mark(i, true);
    ++report_.changes;
    ++s_.changes_since_rebuild;
    return true;
}

// Deflation: inverse -= m m^T / m_i, m its column i, which leaves row and column i zero.
template <std::size_t kWidth>
void FaceWalk<kWidth>::remove(std::size_t i) {
    const Row m(inverse_row(i));
    m.store(ws_.column.data());
    const float scale = -1.0F / ws_.column[i];
    (Row(s_.inverse_sums.data()) + (scale * s_.inverse_sums[i]) * m).store(s_.inverse_sums.data());
    add_outer_to_inverse(scale, ws_.column.data());
    for (std::size_t k = 0; k < n_; ++k) inverse_row(k)[i] = 0.0F;
    Row(0.0F).store(inverse_row(i));
    s_.inverse_sums[i] = 0.0F;
    mark(i, false);
    ++report_.changes;
    ++s_.changes_since_rebuild;
}

template <std::size_t kWidth>
void FaceWalk<kWidth>::add_outer_to_inverse(float factor, const float* u) {
    const Row scaled = factor * Row(u);
    for (std::size_t r = 0; r < n_; ++r) {
        float* row = inverse_row(r);
        (Row(row) + u[r] * scaled).store(row);
    }
}

template <std::size_t kWidth>
void FaceWalk<kWidth>::mark(std::size_t i, bool in_use) {
    s_.used = in_use ? s_.used | bit(i) : s_.used & ~bit(i);
    s_.used_lane[i] = in_use ? 1.0F : 0.0F;
}

// The inverse from nothing, over the examples in use at the coefficients, unless they depend on each other.
template <std::size_t kWidth>
void FaceWalk<kWidth>::rebuild() {
    ++report_.rebuilds;
    std::fill_n(s_.inverse.begin(), n_ * kWidth, 0.0F);
    s_.inverse_sums.fill(0.0F);
    s_.used_lane.fill(0.0F);
    s_.used = 0;
    s_.has_inverse = true;
    for (Set missing = s_.settled; missing != 0 && s_.has_inverse;) s_.has_inverse = add(take_first(missing));
    s_.changes_since_rebuild = 0;
}

template <std::size_t kWidth>
void FaceWalk<kWidth>::certify() {
    const Row c(s_.coefficients.data());
    const Row pull(ws_.pull.data());
    report_.kkt = (c - (c + Row(ws_.move.data())).above_zero()).magnitude().largest();
    float highest = lambda_;
    for (std::size_t i = 0; i < n_; ++i) highest = std::max(highest, ws_.pull[i]);
    report_.gap = highest - lambda_;
    report_.objective = -0.5F * (c * (pull + Row(ws_.linear.data()))).sum();
    report_.optimal = report_.kkt <= kAccepted * enough_;
}

// Goes on from the best feasible point in double, which is exact also where examples depend on each other.
template <std::size_t kWidth>
void FaceWalk<kWidth>::walk() {
    SimplexWalkProblem problem;
    problem.rows = p_.rows;
    problem.count = n_;
    problem.stride = kWidth;
    problem.examples = p_.examples;
    problem.target = p_.target;
    if (!s_.all_rows) problem.row_weight = {s_.row_weight.data(), p_.rows};
    const auto cap = static_cast<std::uint16_t>(config_.iteration_cap - report_.iterations);
    const SimplexWalkReport walked = walk_simplex(problem, static_cast<double>(config_.tolerance), cap,
                                                  s_.walk, ws_.walk, s_.settled, s_.coefficients);
    report_.iterations = static_cast<std::uint16_t>(report_.iterations + walked.iterations);
    report_.changes = static_cast<std::uint16_t>(report_.changes + walked.changes);
    report_.walked = true;
    report_.kkt = static_cast<float>(walked.kkt);
    report_.gap = static_cast<float>(walked.gap);
    report_.objective = static_cast<float>(walked.objective);
    report_.optimal = walked.optimal;
    s_.has_inverse = false;
}

template <std::size_t kWidth>
SimplexQpReport solve(const SimplexQpProblem& problem, const SimplexQpConfig& config, SimplexQpState& state,
                      SimplexQpWorkspace& workspace) {
    SimplexQpReport report;
    FaceWalk<kWidth>(problem, config, state, workspace, report).run();
    return report;
}

}  // namespace

void build_simplex_gram(std::span<const float> examples, std::size_t rows, std::size_t count,
                        std::span<const float> row_weight, std::span<float> gram) {
    const std::size_t stride = padded(count);
    RIG_CHECK(count > 0 && count <= kMaxRegionShapes && examples.size() >= rows * stride);
    RIG_CHECK(gram.size() >= count * stride && (row_weight.empty() || row_weight.size() >= rows));
    std::fill_n(gram.begin(), count * stride, 0.0F);
    alignas(64) std::array<float, kSimplexStride> scaled;
    for (std::size_t r = 0; r < rows; ++r) {
        const float weight = row_weight.empty() ? 1.0F : row_weight[r];
        if (!(weight > 0.0F)) continue;
        const float root = std::sqrt(weight);
        for (std::size_t i = 0; i < stride; ++i) scaled[i] = root * examples[r * stride + i];
        add_square(gram.data(), stride, count, scaled.data());
    }
}

SimplexQpReport solve_simplex_qp(const SimplexQpProblem& problem, const SimplexQpConfig& config,
                                 SimplexQpState& state, SimplexQpWorkspace& workspace, std::span<float> c) {
    RIG_CHECK(problem.count > 0 && problem.count <= kMaxRegionShapes);
    RIG_CHECK(problem.rows > 0 && problem.rows <= kMaxRows && problem.stride == padded(problem.count));
    RIG_CHECK(problem.examples.size() >= problem.rows * problem.stride);
    RIG_CHECK(problem.gram.size() >= problem.count * problem.stride);
    RIG_CHECK(problem.target.size() >= problem.rows && c.size() >= problem.count);
    RIG_CHECK(problem.row_weight.empty() || problem.row_weight.size() >= problem.rows);
    const SimplexQpReport report = problem.stride == kLaneFloats
                                       ? solve<kLaneFloats>(problem, config, state, workspace)
                                       : solve<kSimplexStride>(problem, config, state, workspace);
    std::copy_n(state.coefficients.begin(), problem.count, c.begin());
    return report;
}

}  // namespace rig
