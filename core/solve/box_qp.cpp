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
    0.25;  // of the largest wrong multiplier; smaller ones wait for the next round
constexpr std::size_t kReleaseAtOnce = 8;

// Weights smaller than this are judged as if they were this large: in float, multipliers carry the rounding
// of terms of about 1.
template <typename Real>
constexpr Real kLeastScale = sizeof(Real) == sizeof(float) ? Real(1) : Real(0.01);

template <typename Real>
bool finite(Real x) {
    return std::fabs(x) <= std::numeric_limits<Real>::max();
}

// One solve. A face of the box is the set of points with the same variables at bounds; the minimum on it is
// one product with the inverse away.
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
          free_(problem, state, workspace),
          tolerance_(static_cast<Real>(config.tolerance)) {}

    BoxQpReport run() {
        adopt_start();
        while (report_.iterations < config_.iteration_cap) {
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
    [[nodiscard]] Real diagonal(std::size_t i) const { return p_.hessian[i * p_.stride + i]; }

    void adopt_start();
    void set_where(std::size_t i, Where where);
    void adopt_gradient();
    void skip(std::size_t i) { ws_.may_rise[i] = ws_.may_fall[i] = Real(0); }
    [[nodiscard]] Where start_of(std::size_t i, bool same) const;
    void refresh_gradient();
    bool step_descends();
    [[nodiscard]] Real free_residual() const;
    bool walk();
    [[nodiscard]] Real length_to_bound(std::size_t& blocking) const;
    bool next_face();
    bool release();
    std::size_t choose_candidates();
    bool rebuild_once();
    void rebuild();
    void fix(std::size_t slot, Where where);
    bool slide(std::size_t i);
    Real room_along(Real sign, std::size_t& blocking) const;
    void scale_tolerance();
    void certify();

    const BoxQpProblem<Real>& p_;
    const BoxQpConfig& config_;
    State& s_;
    BoxQpWorkspace<Real>& ws_;
    std::span<Real> w_;
    FreeBlock<Real> free_;
    BoxQpReport report_;
    Real tolerance_;                                              // of weights, see BoxQpConfig
    Real last_residual_ = std::numeric_limits<Real>::infinity();  // after the last full step on this face
    bool moved_ = true;                                           // since the last release
    bool has_step_ = false;                                       // ws_.step belongs to ws_.free_gradient
    bool fresh_ = false;                                          // ws_.gradient belongs to w
    bool repaired_ = false;  // the inverse was made anew because it had worn out
};

// Where the start itself says: a state of other weights must not move them.
template <typename Real>
typename BoxQpState<Real>::Where FaceWalk<Real>::start_of(std::size_t i, bool same) const {
    const Real low = p_.low[i];
    const Real high = p_.high[i];
    if (low == high) return Where::kLow;
    if (same && s_.where[i] == Where::kFree) return Where::kFree;
    if (w_[i] == low) return Where::kLow;
    if (w_[i] == high) return Where::kHigh;
    return same ? Where::kHeld : Where::kFree;
}

template <typename Real>
void FaceWalk<Real>::adopt_start() {
    const std::size_t n = p_.size;
    const bool same = s_.warm && s_.size == n;
    if (!same || s_.hessian_version != p_.hessian_version) {
        for (std::size_t i = 0; i < n; ++i) {
            s_.scale[i] = Real(1) / std::max(diagonal(i), kLeastDiagonal<Real>);
        }
        s_.hessian_version = p_.hessian_version;
        s_.inverse_valid = false;
    }
    const bool kept = same && s_.inverse_valid;
    bool unmoved = kept;
    for (std::size_t i = 0; i < n; ++i) {
        unmoved = unmoved && w_[i] == s_.answer[i];
        if (!finite(w_[i])) w_[i] = Real(0);
        w_[i] = std::clamp(w_[i], p_.low[i], p_.high[i]);
        const Where where = start_of(i, same);
        if (!same || (where == Where::kFree) != (s_.where[i] == Where::kFree)) s_.inverse_valid = false;
        unmoved = unmoved && w_[i] == s_.answer[i];
        set_where(i, where);
    }
    s_.warm = true;
    s_.size = static_cast<std::uint16_t>(n);
    scale_tolerance();
    if (!s_.inverse_valid) rebuild();
    free_.gather_values(w_);
    if (unmoved && s_.inverse_valid) {
        adopt_gradient();
    } else {
        refresh_gradient();
    }
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
    const bool fixed = p_.low[i] == p_.high[i] || where == Where::kFree;
    s_.where[i] = where;
    ws_.may_rise[i] = !fixed && where != Where::kHigh ? Real(1) : Real(0);
    ws_.may_fall[i] = !fixed && where != Where::kLow ? Real(1) : Real(0);
}

template <typename Real>
void FaceWalk<Real>::refresh_gradient() {
    std::size_t count = 0;
    for (std::size_t i = 0; i < p_.size; ++i) {
        ws_.index[count] = static_cast<std::uint16_t>(i);
        ws_.moving[count] = w_[i];
        count += w_[i] != Real(0) ? 1 : 0;
        ws_.gradient[i] = p_.linear[i];
    }
    for (std::size_t i = p_.size; i < padded(p_.size); ++i) ws_.gradient[i] = Real(0);
    combine_rows(p_.hessian.data(), p_.stride, ws_.index.data(), ws_.moving.data(), count, padded(p_.size),
                 ws_.gradient.data(), ws_.gradient.data());
    free_.gather_gradient();
    fresh_ = true;
    has_step_ = false;
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
    Real residual(0);
    for (std::size_t a = 0; a < free_.count(); ++a) {
        const Real move = std::fabs(ws_.free_gradient[a]) * s_.scale[s_.free[a]];
        if (!(move <= residual)) residual = move;
    }
    return residual;
}

// Along -step as far as the bounds allow. True for a full step; else the variable that met its bound is fixed
// and the step that is left belongs to the others.
template <typename Real>
bool FaceWalk<Real>::walk() {
    const std::size_t k = free_.count();
    int outside = 0;
    for (std::size_t a = 0; a < k; ++a) {
        const Real aim = ws_.value[a] - ws_.step[a];
        outside |= static_cast<int>(!(aim >= ws_.free_low[a])) | static_cast<int>(!(aim <= ws_.free_high[a]));
    }
    std::size_t blocking = kNone;
    const Real length = outside != 0 ? length_to_bound(blocking) : Real(1);
    for (std::size_t a = 0; a < k; ++a) {
        const Real aim = ws_.value[a] - length * ws_.step[a];
        ws_.value[a] = std::min(std::max(aim, ws_.free_low[a]), ws_.free_high[a]);
    }
    for (std::size_t a = 0; a < k; ++a) w_[s_.free[a]] = ws_.value[a];
    fresh_ = false;
    moved_ = moved_ || length > Real(0);
    if (blocking == kNone) return true;
    const Where where = ws_.step[blocking] < Real(0) ? Where::kHigh : Where::kLow;
    const Real left = Real(1) - length;
    for (std::size_t a = 0; a < k; ++a) {
        ws_.free_gradient[a] *= left;
        ws_.step[a] *= left;
    }
    fix(blocking, where);
    return false;
}

// The share of the step after which the first variable, `blocking`, meets its bound.
template <typename Real>
Real FaceWalk<Real>::length_to_bound(std::size_t& blocking) const {
    Real length(1);
    for (std::size_t a = 0; a < free_.count(); ++a) {
        const Real d = -ws_.step[a];
        const Real aim = ws_.value[a] + length * d;
        if (aim >= ws_.free_low[a] && aim <= ws_.free_high[a]) continue;
        const Real room = (d > Real(0) ? ws_.free_high[a] : ws_.free_low[a]) - ws_.value[a];
        length = std::clamp(room / d, Real(0), length);
        blocking = a;
    }
    return length;
}

template <typename Real>
void FaceWalk<Real>::fix(std::size_t slot, Where where) {
    const std::size_t i = s_.free[slot];
    set_where(i, where);
    w_[i] = where == Where::kLow ? p_.low[i] : p_.high[i];
    free_.remove(slot);
    last_residual_ = std::numeric_limits<Real>::infinity();
    ++report_.changes;
}

// After a full step: leaves the face where a multiplier has the wrong sign, sharpens its minimum, or is done.
template <typename Real>
bool FaceWalk<Real>::next_face() {
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
    last_residual_ = std::numeric_limits<Real>::infinity();
    return rebuild_once();
}

// The variables to free next, the one that pulls most first. When the last round moved nothing, that one
// only: it cannot be blocked at once, and so rounds do not repeat.
template <typename Real>
std::size_t FaceWalk<Real>::choose_candidates() {
    for (std::size_t i = 0; i < p_.size; ++i) {  // how far a Jacobi step would take it off its bound
        const Real move = ws_.gradient[i] * s_.scale[i];
        const Real fall = move * ws_.may_fall[i];
        const Real rise = -move * ws_.may_rise[i];
        ws_.moving[i] = fall > rise ? fall : rise;
    }
    Real largest(0);
    std::size_t best = kNone;
    for (std::size_t i = 0; i < p_.size; ++i) {
        if (!(ws_.moving[i] > largest)) continue;
        largest = ws_.moving[i];
        best = i;
    }
    if (!(largest > tolerance_)) return 0;
    std::size_t count = 0;
    ws_.candidates[count++] = static_cast<std::uint16_t>(best);
    const Real least = std::max(tolerance_, static_cast<Real>(kReleaseShare) * largest);
    for (std::size_t i = 0; moved_ && i < p_.size && count < kReleaseAtOnce; ++i) {
        if (i != best && ws_.moving[i] > least) ws_.candidates[count++] = static_cast<std::uint16_t>(i);
    }
    return count;
}

// Frees variables whose multipliers have the wrong sign; false when there are none. Several at once keep the
// descent: the free gradient is nearly zero and each of them pulls inwards.
template <typename Real>
bool FaceWalk<Real>::release() {
    for (std::size_t tries = 0; tries <= p_.size; ++tries) {
        const std::size_t count = choose_candidates();
        if (count == 0) return false;
        moved_ = false;
        if (!has_step_) free_.find_step();
        has_step_ = true;
        std::size_t added = 0;
        for (std::size_t c = 0; c < count; ++c) {
            const std::size_t i = ws_.candidates[c];
            if (free_.add(i, w_[i])) {
                set_where(i, Where::kFree);
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

template <typename Real>
bool FaceWalk<Real>::rebuild_once() {
    if (repaired_) return false;
    repaired_ = true;
    rebuild();
    refresh_gradient();
    return true;
}

// From nothing, one column after the other: triangular solves would wait for their own latency.
template <typename Real>
void FaceWalk<Real>::rebuild() {
    ++report_.rebuilds;
    free_.clear();
    for (std::size_t i = 0; i < p_.size; ++i) {
        if (s_.where[i] == Where::kFree && !free_.add(i, w_[i])) set_where(i, Where::kHeld);
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
        const std::size_t j = s_.free[a];
        const Real room = ((d > Real(0) ? p_.high[j] : p_.low[j]) - w_[j]) / d;
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
    const Real own = sign > Real(0) ? p_.high[i] - w_[i] : w_[i] - p_.low[i];
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
    for (std::size_t a = 0; a < free_.count(); ++a) {
        const Real aim = ws_.value[a] - sign * length * ws_.column[a];
        ws_.value[a] = std::clamp(aim, ws_.free_low[a], ws_.free_high[a]);
        w_[s_.free[a]] = ws_.value[a];
    }
    w_[i] = std::clamp(w_[i] + sign * length, p_.low[i], p_.high[i]);
    moved_ = moved_ || length > Real(0);
    if (length > Real(0)) set_where(i, Where::kHeld);
    bool stuck = false;
    if (length == room) {
        fix(blocking, to_high ? Where::kHigh : Where::kLow);
        stuck = !free_.add(i, w_[i]);
        if (!stuck) set_where(i, Where::kFree);
        report_.changes = static_cast<std::uint16_t>(report_.changes + (stuck ? 0 : 1));
    } else if (length == own) {
        set_where(i, sign > Real(0) ? Where::kHigh : Where::kLow);
        ++report_.changes;
    } else {
        stuck = true;
    }
    if (stuck) skip(i);
    refresh_gradient();
    return true;
}

template <typename Real>
void FaceWalk<Real>::scale_tolerance() {
    Real largest = kLeastScale<Real>;
    for (std::size_t i = 0; i < p_.size; ++i) largest = std::max(largest, std::fabs(w_[i]));
    tolerance_ = static_cast<Real>(config_.tolerance) * largest;
}

template <typename Real>
void FaceWalk<Real>::certify() {
    if (!fresh_) refresh_gradient();
    scale_tolerance();
    const std::size_t n = p_.size;
    int sound = 1;
    for (std::size_t i = 0; i < n; ++i) {
        const Real target = std::min(std::max(w_[i] - ws_.gradient[i] * s_.scale[i], p_.low[i]), p_.high[i]);
        const Real move = std::fabs(w_[i] - target);
        sound &= static_cast<int>(std::fabs(ws_.gradient[i]) <= std::numeric_limits<Real>::max()) &
                 static_cast<int>(move <= std::numeric_limits<Real>::max());
        ws_.moving[i] = move;
        s_.answer[i] = w_[i];
        s_.product[i] = ws_.gradient[i] - p_.linear[i];
        ws_.column[i] = ws_.gradient[i] + p_.linear[i];
    }
    Real move(0);
    for (std::size_t i = 0; i < n; ++i) move = ws_.moving[i] > move ? ws_.moving[i] : move;
    std::array<double, 4> parts{};  // in double, four at a time: one sum would wait for itself
    for (std::size_t i = 0; i < n; ++i) {
        parts[i % 4] += static_cast<double>(w_[i]) * static_cast<double>(ws_.column[i]);
    }
    const double objective = 0.5 * ((parts[0] + parts[1]) + (parts[2] + parts[3]));
    report_.kkt = sound != 0 ? static_cast<double>(move) : std::numeric_limits<double>::max();
    report_.objective = sound != 0 ? objective : 0.0;
    report_.optimal = report_.kkt <= kAccepted * static_cast<double>(tolerance_);
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
