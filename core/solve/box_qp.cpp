#include "core/solve/box_qp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.hpp"
#include "core/solve/free_block.hpp"

namespace rig {

namespace {

constexpr std::size_t kNone = kMaxUnknowns;
constexpr double kAccepted = 10.0;  // tolerances: rounding leaves this much on ill-conditioned faces
constexpr double kRoughly = 1e3;    // tolerances: a face solved this well tells which bounds to leave
constexpr double kReleaseShare =
    0.1;                            // of the dearest wrong multiplier; cheaper ones wait for the next round
constexpr double kPullShare = 0.5;  // of a multiplier: what the step of those freed before has to leave of it
constexpr std::size_t kReleaseAtOnce = 16;
constexpr std::uint16_t kFacesUnwatched = 16;
constexpr std::uint8_t kSpared = 31;  // solves after a rebuild in vain
constexpr std::uint16_t kIdleFaces =
    3;  // in a row without descent: the inverse is made anew, or that was all

// Weights smaller than this are judged as if they were this large: in float, multipliers carry the rounding
// of terms of about 1.
template <typename Real>
constexpr Real kLeastScale = sizeof(Real) == sizeof(float) ? Real(1) : Real(0.01);

template <typename Real>
bool finite(Real x) {
    return std::fabs(x) <= std::numeric_limits<Real>::max();
}

// One solve. A face of the box is the set of points with the same variables at bounds; the minimum on it is
// one product with the inverse away. The state's answer is the point that walks; of the free variables it
// follows when the gradient is made.
template <typename Real>
class FaceWalk {
  public:
    using State = BoxQpState<Real>;
    using Where = typename State::Where;

    FaceWalk(const BoxQpProblem<Real>& problem, const BoxQpConfig& config, State& state,
             BoxQpWorkspace<Real>& workspace, std::span<Real> w)
        : p_(problem),
          config_(config),
          s_(state),
          ws_(workspace),
          w_(w),
          free_(problem, state, workspace, report_.work),
          tolerance_(static_cast<Real>(config.tolerance)) {}

    BoxQpReport run() {
        adopt_start();
        while (report_.iterations < config_.iteration_cap && !spent()) {
            ++report_.iterations;
            if (!step_descends()) {  // the inverse is worn out
                if (!rebuild_once()) break;
                continue;
            }
            if (!walk()) continue;
            refresh_gradient();
            if (!next_face()) break;
        }
        certify();
        return report_;
    }

  private:
    [[nodiscard]] bool spent() const { return report_.work >= box_qp_work_budget(p_.size); }
    [[nodiscard]] Real diagonal(std::size_t i) const { return p_.hessian[i * p_.stride + i]; }

    void adopt_start();
    [[nodiscard]] bool unmoved() const;
    bool adopt_point(bool same);
    void set_where(std::size_t i, Where where);
    void adopt_gradient();
    void skip(std::size_t i);
    [[nodiscard]] Where start_of(std::size_t i, bool same) const;
    void collect_pinned();
    void unpin(std::size_t i);
    void refresh_gradient();
    void find_moves();
    bool step_descends();
    [[nodiscard]] Real free_residual() const;
    bool walk();
    bool next_face();
    void judge_rebuild();
    bool stagnates();
    bool release();
    std::size_t choose_candidates();
    [[nodiscard]] bool still_pulls(std::size_t i);
    bool rebuild_once();
    void rebuild();
    void fix(std::size_t slot, Where where);
    bool slide(std::size_t i);
    Real room_along(Real sign, std::size_t& blocking) const;
    void scale_tolerance();
    [[nodiscard]] double objective() const;
    void certify();

    const BoxQpProblem<Real>& p_;
    const BoxQpConfig& config_;
    State& s_;
    BoxQpWorkspace<Real>& ws_;
    std::span<Real> w_;
    BoxQpReport report_;
    FreeBlock<Real> free_;
    Real tolerance_;                                              // of weights, see BoxQpConfig
    Real last_residual_ = std::numeric_limits<Real>::infinity();  // after the last full step on this face
    Real largest_move_ = Real(0);
    Real blunt_residual_ = Real(0);  // that no step lessened, when the inverse was made anew for it
    double least_objective_ = std::numeric_limits<double>::infinity();
    std::uint16_t faces_ = 0;       // solved
    std::uint16_t idle_faces_ = 0;  // since the objective last fell
    bool moved_ = true;             // since the last release
    bool has_step_ = false;         // ws_.step belongs to ws_.free_gradient
    bool fresh_ = false;            // ws_.gradient belongs to the answer
    bool has_moves_ = false;        // ws_.moves belongs to ws_.gradient
    bool skipped_ = false;          // a variable is closed that another start may free
    bool repaired_ = false;         // the inverse was made anew because it had worn out
};

// Where the start itself says: a state of other weights must not move them.
template <typename Real>
typename BoxQpState<Real>::Where FaceWalk<Real>::start_of(std::size_t i, bool same) const {
    const Real low = s_.low[i];
    const Real high = s_.high[i];
    if (low == high) return Where::kLow;
    if (same && s_.where[i] == Where::kFree) return Where::kFree;
    if (s_.answer[i] == low) return Where::kLow;
    if (s_.answer[i] == high) return Where::kHigh;
    return same ? Where::kHeld : Where::kFree;
}

template <typename Real>
void FaceWalk<Real>::adopt_start() {
    const std::size_t n = p_.size;
    const bool same = s_.warm && s_.size == n;
    if (!same || s_.hessian_version != p_.hessian_version) {
        for (std::size_t i = 0; i < n; ++i) {
            s_.scale[i] = Real(1) / std::max(diagonal(i), kLeastDiagonal<Real>);
            s_.price[i] = Real(1);
        }
        s_.hessian_version = p_.hessian_version;
        s_.spared = 0;
        s_.inverse_valid = false;
    }
    if (same && s_.inverse_valid && s_.settled && unmoved()) {
        s_.settled = false;
        adopt_gradient();
        scale_tolerance();
        return;
    }
    s_.settled = false;
    const bool moved = adopt_point(same);
    s_.warm = true;
    s_.size = static_cast<std::uint16_t>(n);
    scale_tolerance();
    const bool kept = s_.inverse_valid;
    if (!kept) rebuild();
    free_.gather_values();
    collect_pinned();
    if (kept && !moved) {
        adopt_gradient();
    } else {
        refresh_gradient();
    }
}

// The start is the last answer, and its bounds are what they were.
template <typename Real>
bool FaceWalk<Real>::unmoved() const {
    int equal = 1;
    for (std::size_t i = 0; i < p_.size; ++i) {
        equal &= static_cast<int>(w_[i] == s_.answer[i]) & static_cast<int>(p_.low[i] == s_.low[i]) &
                 static_cast<int>(p_.high[i] == s_.high[i]);
    }
    return equal != 0;
}

// True when the start is not the last answer.
template <typename Real>
bool FaceWalk<Real>::adopt_point(bool same) {
    const std::size_t n = p_.size;
    bool moved = !same;
    for (std::size_t i = 0; i < n; ++i) {
        s_.low[i] = p_.low[i];
        s_.high[i] = p_.high[i];
        const Real x = std::clamp(finite(w_[i]) ? w_[i] : Real(0), s_.low[i], s_.high[i]);
        moved = moved || x != s_.answer[i];
        s_.answer[i] = x;
        const Where where = start_of(i, same);
        if (!same || (where == Where::kFree) != (s_.where[i] == Where::kFree)) s_.inverse_valid = false;
        set_where(i, where);
    }
    for (auto* padding : {&s_.low, &s_.high, &s_.answer, &s_.scale, &s_.open}) {
        std::fill_n(padding->begin() + static_cast<std::ptrdiff_t>(n), padded(n) - n, Real(0));
    }
    return moved;
}

// At the last answer H w is known; its rounding is of no account, because every full step is followed by a
// gradient made from nothing.
template <typename Real>
void FaceWalk<Real>::adopt_gradient() {
    for (std::size_t i = 0; i < p_.size; ++i) ws_.gradient[i] = s_.product[i] + p_.linear[i];
    free_.gather_gradient();
    has_step_ = false;
}

template <typename Real>
void FaceWalk<Real>::set_where(std::size_t i, Where where) {
    s_.where[i] = where;
    s_.open[i] = s_.low[i] == s_.high[i] || where == Where::kFree ? Real(0) : Real(1);
}

template <typename Real>
void FaceWalk<Real>::skip(std::size_t i) {
    s_.open[i] = Real(0);
    skipped_ = true;
}

template <typename Real>
void FaceWalk<Real>::collect_pinned() {
    std::size_t count = 0;
    for (std::size_t i = 0; i < p_.size; ++i) {
        if (s_.where[i] == Where::kFree || s_.answer[i] == Real(0)) continue;
        s_.pinned[count++] = static_cast<std::uint16_t>(i);
    }
    s_.pinned_count = static_cast<std::uint16_t>(count);
}

template <typename Real>
void FaceWalk<Real>::unpin(std::size_t i) {
    for (std::size_t c = 0; c < s_.pinned_count; ++c) {
        if (s_.pinned[c] != i) continue;
        s_.pinned[c] = s_.pinned[--s_.pinned_count];
        return;
    }
}

// From nothing, over the variables that are not zero.
template <typename Real>
void FaceWalk<Real>::refresh_gradient() {
    const std::size_t k = free_.count();
    free_.spread_values();
    std::copy_n(s_.free.begin(), k, ws_.index.begin());
    std::copy_n(s_.value.begin(), k, ws_.moving.begin());
    std::size_t count = k;
    for (std::size_t c = 0; c < s_.pinned_count; ++c) {
        ws_.index[count] = s_.pinned[c];
        ws_.moving[count++] = s_.answer[s_.pinned[c]];
    }
    std::copy_n(p_.linear.begin(), p_.size, ws_.gradient.begin());
    for (std::size_t i = p_.size; i < padded(p_.size); ++i) ws_.gradient[i] = Real(0);
    report_.work += count * p_.size;
    combine_rows(p_.hessian.data(), p_.stride, ws_.index.data(), ws_.moving.data(), count, p_.size,
                 ws_.gradient.data(), ws_.gradient.data());
    free_.gather_gradient();
    fresh_ = true;
    has_moves_ = false;
    has_step_ = false;
}

template <typename Real>
void FaceWalk<Real>::find_moves() {
    if (has_moves_) return;
    has_moves_ = true;
    largest_move_ = projected_moves(
        {s_.answer.data(), ws_.gradient.data(), s_.scale.data(), s_.low.data(), s_.high.data()}, p_.size,
        ws_.moves.data());
}

// The Newton step on the face is -step. False when it does not descend.
template <typename Real>
bool FaceWalk<Real>::step_descends() {
    if (!has_step_) free_.find_step();
    has_step_ = true;
    const Real slope = padded_dot(ws_.step.data(), ws_.free_gradient.data(), padded(free_.count()));
    if (slope >= Real(0) && finite(slope)) return true;
    if (!(free_residual() <= tolerance_)) return false;
    std::fill_n(ws_.step.begin(), free_.count(), Real(0));  // nothing but rounding is left to descend
    return true;
}

// Largest move of a Jacobi step of the free variables.
template <typename Real>
Real FaceWalk<Real>::free_residual() const {
    return largest_product(ws_.free_gradient.data(), s_.free_scale.data(), free_.count());
}

// Along -step as far as the bounds allow. True for a full step; else the variable that met its bound is fixed
// and the step that is left belongs to the others.
template <typename Real>
bool FaceWalk<Real>::walk() {
    const std::size_t k = free_.count();
    Real* room = ws_.direction.data();
    fresh_ = false;
    const Real least =
        room_ahead({s_.value.data(), ws_.step.data(), s_.free_low.data(), s_.free_high.data()}, k, room);
    const Real length = std::min(least, Real(1));
    move_inside({s_.value.data(), ws_.step.data(), s_.free_low.data(), s_.free_high.data()}, length, k,
                s_.value.data());
    moved_ = moved_ || length > Real(0);
    if (!(least <= Real(1))) return true;
    std::size_t blocking = 0;
    while (room[blocking] != least) ++blocking;
    const Where where = ws_.step[blocking] < Real(0) ? Where::kHigh : Where::kLow;
    const Real left = Real(1) - length;
    for (std::size_t a = 0; a < padded(k); ++a) {
        ws_.free_gradient[a] *= left;
        ws_.step[a] *= left;
    }
    fix(blocking, where);
    return false;
}

template <typename Real>
void FaceWalk<Real>::fix(std::size_t slot, Where where) {
    const std::size_t i = s_.free[slot];
    set_where(i, where);
    s_.answer[i] = where == Where::kLow ? s_.low[i] : s_.high[i];
    if (s_.answer[i] != Real(0)) s_.pinned[s_.pinned_count++] = static_cast<std::uint16_t>(i);
    free_.remove(slot);
    last_residual_ = std::numeric_limits<Real>::infinity();
    ++report_.changes;
}

// After a full step: leaves the face where a multiplier has the wrong sign, sharpens its minimum, or is done.
template <typename Real>
bool FaceWalk<Real>::next_face() {
    if (stagnates()) {
        idle_faces_ = 0;
        return rebuild_once();
    }
    const Real residual = free_residual();
    const bool contracting = residual < Real(0.5) * last_residual_;
    last_residual_ = residual;
    if (residual <= static_cast<Real>(kRoughly) * tolerance_ || !contracting) {
        if (release()) {
            last_residual_ = std::numeric_limits<Real>::infinity();
            return true;
        }
        if (residual <= tolerance_) {
            const Real before = tolerance_;
            scale_tolerance();
            return tolerance_ < Real(0.5) * before;  // the weights have shrunk since: look closer
        }
    }
    if (contracting) return true;
    if (s_.spared > 0) return false;
    blunt_residual_ = residual;
    last_residual_ = std::numeric_limits<Real>::infinity();
    return rebuild_once();
}

// A rebuild that was not needed for the certificate, or did not bring it, was in vain: it is rounding that
// stops the residual, and the next frame's would be in vain too.
template <typename Real>
void FaceWalk<Real>::judge_rebuild() {
    if (s_.spared > 0) --s_.spared;
    if (blunt_residual_ == Real(0)) return;
    const bool needed = blunt_residual_ > static_cast<Real>(kAccepted) * tolerance_;
    if (!needed || !report_.optimal) s_.spared = kSpared;
}

// Whether the objective has stopped falling: what multipliers still say is rounding, and following them would
// go round in circles. Most solves end before this is worth its cost.
template <typename Real>
bool FaceWalk<Real>::stagnates() {
    if (++faces_ <= kFacesUnwatched) return false;
    const double now = objective();
    const double resolution = 2.0 * static_cast<double>(std::numeric_limits<Real>::epsilon());
    const bool falls = now < least_objective_ - resolution * std::fabs(now);
    least_objective_ = std::min(least_objective_, now);
    idle_faces_ = falls ? 0 : static_cast<std::uint16_t>(idle_faces_ + 1);
    return idle_faces_ >= kIdleFaces;
}

// The variables to free next, the dearest of those that pull first. When the last round moved nothing, that
// one only: it cannot be blocked at once, and so rounds do not repeat.
template <typename Real>
std::size_t FaceWalk<Real>::choose_candidates() {
    find_moves();
    if (!(largest_move_ > tolerance_)) return 0;
    for (std::size_t i = 0; i < padded(p_.size); ++i) {
        const Real pull = ws_.moves[i] * s_.open[i];
        ws_.moving[i] = pull > tolerance_ ? pull * s_.price[i] : Real(0);
    }
    const Real largest = largest_product(ws_.moving.data(), nullptr, p_.size);
    if (!(largest > Real(0))) return 0;
    const Real least = moved_ ? static_cast<Real>(kReleaseShare) * largest : largest;
    std::size_t count = 0;
    std::size_t best = 0;
    for (std::size_t i = 0; i < p_.size; ++i) {
        if (!(ws_.moving[i] >= least)) continue;
        if (ws_.moving[i] == largest) best = count;
        ws_.candidates[count++] = static_cast<std::uint16_t>(i);
    }
    std::swap(ws_.candidates[0], ws_.candidates[best]);
    return moved_ ? count : 1;
}

// Frees variables whose multipliers have the wrong sign; false when there are none. Several at once keep the
// descent: the free gradient is nearly zero and each of them pulls inwards.
template <typename Real>
bool FaceWalk<Real>::release() {
    for (std::size_t tries = 0; tries <= p_.size && !spent(); ++tries) {
        const std::size_t count = choose_candidates();
        if (count == 0) return false;
        moved_ = false;
        if (!has_step_) free_.find_step();
        has_step_ = true;
        std::size_t added = 0;
        for (std::size_t c = 0; c < count && added < kReleaseAtOnce; ++c) {
            const std::size_t i = ws_.candidates[c];
            if (added > 0 && !still_pulls(i)) continue;
            if (free_.add(i, s_.answer[i])) {
                set_where(i, Where::kFree);
                unpin(i);
                ++report_.changes;
                ++added;
            } else if (added == 0) {
                if (slide(i)) return true;
                break;  // skipped from now on: choose again
            }
        }
        if (added > 0) return true;
    }
    return false;
}

// Whether variable i would still leave its bound once those freed before it have made their step. Most of the
// others of a family would not, and would only be walked back.
template <typename Real>
bool FaceWalk<Real>::still_pulls(std::size_t i) {
    const Real before = ws_.gradient[i];
    const Real after = free_.gradient_after_step(i);
    const Real least = static_cast<Real>(kPullShare) * std::fabs(before);
    return before > Real(0) ? after > least : after < -least;
}

template <typename Real>
bool FaceWalk<Real>::rebuild_once() {
    if (repaired_) return false;
    repaired_ = true;
    free_.spread_values();
    rebuild();
    collect_pinned();
    refresh_gradient();
    return true;
}

// From nothing, one column after the other: triangular solves would wait for their own latency.
template <typename Real>
void FaceWalk<Real>::rebuild() {
    ++report_.rebuilds;
    free_.clear();
    for (std::size_t i = 0; i < p_.size; ++i) {
        if (s_.where[i] == Where::kFree && !free_.add(i, s_.answer[i])) set_where(i, Where::kHeld);
    }
    s_.inverse_valid = true;
    has_step_ = false;
}

// How far w may go along sign (e_i - column) before a bound; `blocking` the slot that meets it, or kNone.
// Negative when the column is no number.
template <typename Real>
Real FaceWalk<Real>::room_along(Real sign, std::size_t& blocking) const {
    Real length = std::numeric_limits<Real>::infinity();
    blocking = kNone;
    for (std::size_t a = 0; a < free_.count(); ++a) {
        const Real d = -sign * ws_.column[a];
        if (!finite(d)) return Real(-1);
        if (std::fabs(d) < tolerance_) continue;
        const Real room = ((d > Real(0) ? s_.free_high[a] : s_.free_low[a]) - s_.value[a]) / d;
        if (room < length) {
            length = std::max(Real(0), room);
            blocking = a;
        }
    }
    return length;
}

// Variable i depends on the free ones (ws_.column says how), so along e_i - column there is next to no
// curvature and its multiplier says which way gains. It goes until a bound stops it, or as far as the largest
// curvature that it could have allows; the one that is stopped leaves and i may come in.
template <typename Real>
bool FaceWalk<Real>::slide(std::size_t i) {
    const Real sign = ws_.gradient[i] > Real(0) ? Real(-1) : Real(1);
    const Real curvature = kDependentShare<Real> * diagonal(i);
    const Real own = sign > Real(0) ? s_.high[i] - s_.answer[i] : s_.answer[i] - s_.low[i];
    const Real gain = diagonal(i) > kLeastDiagonal<Real> ? std::fabs(ws_.gradient[i]) / curvature
                                                         : std::numeric_limits<Real>::infinity();
    std::size_t blocking = kNone;
    const Real room = room_along(sign, blocking);
    const Real length = std::min({room, own, gain});
    if (!finite(length) || !(length >= Real(0))) {
        skip(i);
        return false;
    }
    const bool to_high = blocking != kNone && -sign * ws_.column[blocking] > Real(0);
    move_inside({s_.value.data(), ws_.column.data(), s_.free_low.data(), s_.free_high.data()}, sign * length,
                free_.count(), s_.value.data());
    s_.answer[i] = std::clamp(s_.answer[i] + sign * length, s_.low[i], s_.high[i]);
    moved_ = moved_ || length > Real(0);
    if (length > Real(0)) set_where(i, Where::kHeld);
    bool stuck = false;
    if (length == room) {
        fix(blocking, to_high ? Where::kHigh : Where::kLow);
        stuck = !free_.add(i, s_.answer[i]);
        if (!stuck) set_where(i, Where::kFree);
        report_.changes = static_cast<std::uint16_t>(report_.changes + (stuck ? 0 : 1));
    } else if (length == own) {
        set_where(i, sign > Real(0) ? Where::kHigh : Where::kLow);
        ++report_.changes;
    } else {
        stuck = true;
    }
    if (stuck) skip(i);
    collect_pinned();
    refresh_gradient();
    return true;
}

template <typename Real>
void FaceWalk<Real>::scale_tolerance() {
    const Real largest = std::max(kLeastScale<Real>, largest_product(s_.answer.data(), nullptr, p_.size));
    tolerance_ = static_cast<Real>(config_.tolerance) * largest;
}

// Of a fresh gradient; in double, four sums at a time: one would wait for itself.
template <typename Real>
double FaceWalk<Real>::objective() const {
    std::array<double, 4> parts{};
    const auto add = [&](std::size_t i) {
        parts[i % 4] +=
            static_cast<double>(s_.answer[i]) * static_cast<double>(ws_.gradient[i] + p_.linear[i]);
    };
    const std::size_t whole = p_.size / 4 * 4;
    for (std::size_t i = 0; i < whole; i += 4) {
        for (std::size_t c = 0; c < 4; ++c) add(i + c);
    }
    for (std::size_t i = whole; i < p_.size; ++i) add(i);
    return 0.5 * ((parts[0] + parts[1]) + (parts[2] + parts[3]));
}

template <typename Real>
void FaceWalk<Real>::certify() {
    free_.settle_inverse();
    if (!fresh_) refresh_gradient();
    find_moves();
    scale_tolerance();
    int sound = 1;
    for (std::size_t i = 0; i < p_.size; ++i) {
        sound &= static_cast<int>(std::fabs(ws_.gradient[i]) <= std::numeric_limits<Real>::max()) &
                 static_cast<int>(ws_.moves[i] <= std::numeric_limits<Real>::max());
        s_.product[i] = ws_.gradient[i] - p_.linear[i];
        w_[i] = s_.answer[i];
    }
    report_.kkt = sound != 0 ? static_cast<double>(largest_move_) : std::numeric_limits<double>::max();
    report_.objective = sound != 0 ? objective() : 0.0;
    report_.optimal = report_.kkt <= kAccepted * static_cast<double>(tolerance_);
    judge_rebuild();
    s_.settled = !skipped_;
    if (sound == 0) s_.warm = false;  // nothing of this is worth keeping
}

template <typename Real>
BoxQpReport solve_checked(const BoxQpProblem<Real>& problem, const BoxQpConfig& config,
                          BoxQpState<Real>& state, BoxQpWorkspace<Real>& workspace, std::span<Real> w) {
    const std::size_t n = problem.size;
    RIG_CHECK(n <= kMaxUnknowns && problem.stride >= padded(n) && problem.stride % kLaneFloats == 0);
    RIG_CHECK(problem.hessian.size() >= n * problem.stride && problem.linear.size() >= n && w.size() >= n);
    RIG_CHECK(problem.low.size() >= n && problem.high.size() >= n);
    return FaceWalk<Real>(problem, config, state, workspace, w).run();
}

}  // namespace

BoxQpReport solve_box_qp(const BoxQpProblem<float>& problem, const BoxQpConfig& config,
                         BoxQpState<float>& state, BoxQpWorkspace<float>& workspace, std::span<float> w) {
    return solve_checked(problem, config, state, workspace, w);
}
BoxQpReport solve_box_qp(const BoxQpProblem<double>& problem, const BoxQpConfig& config,
                         BoxQpState<double>& state, BoxQpWorkspace<double>& workspace, std::span<double> w) {
    return solve_checked(problem, config, state, workspace, w);
}

}  // namespace rig
