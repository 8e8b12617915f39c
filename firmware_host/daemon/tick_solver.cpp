#include "firmware_host/daemon/tick_solver.hpp"

#include "firmware_host/daemon/marker_trouble_text.hpp"
#include "firmware_host/daemon/neutral_text.hpp"

namespace rig {

TickSolver::TickSolver(const TickSolverParts& parts) : parts_(parts) {
    if (parts_.pack != nullptr) gate_.configure(parts_.pack->weight_low, parts_.pack->weight_high);
}

void TickSolver::tick(const FrameSet& frames, FaultMap faults, TickOutput& output) {
    const Wishes wishes = carry_out_wishes();
    const std::int64_t began_us = parts_.wall.now_us();
    parts_.pipeline.step(frames, state_, report_);
    const std::int64_t solve_us = parts_.wall.now_us() - began_us;
    record(frames, wishes);
    note_neutral();
    static_cast<void>(gate_.pass(state_));
    digest_.add(state_);
    state_.faults |= faults;
    if (static_cast<double>(solve_us) * parts_.rate_hz > 1e6) state_.faults |= fault_bit(Fault::kOverrun);
    count(frames, report_, solve_us);
    output.state = state_;
    output.markers = marker_frame(parts_.pipeline.named_markers(), state_.sequence);
    output.health = health_;
    output.neutrals_ended = neutrals_ended_;
    output.neutral_taken = neutral_taken_;
    output.neutral_text = neutral_text_;
    output.marker_trouble = trouble_text();
}

TickSolver::Wishes TickSolver::carry_out_wishes() {
    Wishes wishes;
    wishes.reset = reset_wanted_.exchange(false, std::memory_order_relaxed);
    wishes.neutral = neutral_wanted_.exchange(false, std::memory_order_relaxed);
    wishes.forget_neutral = forget_neutral_wanted_.exchange(false, std::memory_order_relaxed);
    wishes.controls = wanted_controls_.take();
    if (wishes.reset) parts_.pipeline.reset_tracking();
    if (wishes.forget_neutral) parts_.pipeline.forget_neutral();
    if (wishes.neutral) parts_.pipeline.begin_neutral();
    if (wishes.controls != nullptr) {
        const auto set = parts_.pipeline.set_controls(*wishes.controls);
        RIG_CHECK(set.has_value());
    }
    return wishes;
}

void TickSolver::note_neutral() {
    const NeutralReport& neutral = report_.neutral;
    if (neutral.phase != NeutralPhase::kTaken && neutral.phase != NeutralPhase::kRefused) return;
    ++neutrals_ended_;
    neutral_taken_ = neutral.phase == NeutralPhase::kTaken;
    const bool known = parts_.pack != nullptr && neutral.marker < parts_.pack->marker_count;
    const std::string_view name = known ? parts_.pack->marker_names[neutral.marker] : std::string_view{};
    neutral_text_ = neutral_text(neutral, name.empty() ? "a marker" : name);
}

FixedText<120> TickSolver::trouble_text() const {
    if ((state_.faults & fault_bit(Fault::kMarkerDrift)) == 0 || parts_.pack == nullptr) return {};
    return marker_trouble_text(report_,
                               std::span(parts_.pack->marker_names).first(parts_.pack->marker_count));
}

void TickSolver::request_controls(const ControlSet& controls) {
    wanted_controls_.back() = controls;
    static_cast<void>(wanted_controls_.publish());  // the newest set is the whole truth
}

void TickSolver::record(const FrameSet& frames, const Wishes& wishes) {
    if (parts_.log == nullptr) return;
    ObservationTick tick;
    tick.number = state_.sequence;
    tick.capture_us = frames.capture_us;
    tick.reset_before = wishes.reset;
    tick.neutral_before = wishes.neutral;
    tick.neutral_forgotten_before = wishes.forget_neutral;
    tick.new_controls = wishes.controls;
    tick.status = state_.cameras;
    for (std::size_t c = 0; c < kMaxCameras; ++c) tick.cameras[c] = parts_.pipeline.observations(c).span();
    parts_.log->append(tick);
}

void TickSolver::count(const FrameSet& frames, const FrameReport& report, std::int64_t solve_us) {
    solve_times_.add(solve_us);
    static_cast<void>(faults_.look(state_.faults));
    ++health_.ticks;
    ++(report.solved ? health_.solved : health_.held);
    if ((state_.faults & fault_bit(Fault::kOverrun)) != 0) ++health_.overruns;
    for (std::size_t c = 0; c < frames.camera_count; ++c) {
        ++(frames.images[c].empty() ? health_.camera_missing[c] : health_.camera_good[c]);
    }
    health_.observations = report.observations;
    health_.markers_seen = report.markers_seen;
    health_.swaps_repaired += report.swaps_repaired;
    health_.bootstraps += report.bootstrapped ? 1 : 0;
    health_.solve = solve_times_.spread();
    health_.state = state_.state;
    health_.faults = state_.faults;
    health_.fault_counts = faults_.counts();
}

}  // namespace rig
