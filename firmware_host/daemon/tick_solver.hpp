// One tick: pictures in, a state that may be sent out, with its report and wear. The only caller of the
// pipeline.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/pipeline/pipeline.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "firmware_host/daemon/latest_box.hpp"
#include "firmware_host/daemon/output_gate.hpp"
#include "firmware_host/daemon/wear.hpp"
#include "firmware_host/take_log/observation_log.hpp"
#include "firmware_host/take_log/stream_digest.hpp"
#include "hal/clock.hpp"

namespace rig {

// What a tick hands to the link.
struct TickOutput {
    FaceState state;
    MarkerFrame markers;
    Health health;  // without the link's part
    // How the last taking of a neutral ended, and how many have: one that was replaced on the way is told by
    // the next output.
    std::uint32_t neutrals_ended = 0;
    bool neutral_taken = false;
    FixedText<120> neutral_text;
    FixedText<120> marker_trouble;  // which markers came off or slid; empty when none
};

struct TickSolverParts {
    Pipeline& pipeline;
    const Clock& wall;  // for how long a solve takes; in lockstep the rig's own clock stands still meanwhile
    ObservationLogWriter* log = nullptr;  // may be none
    const SolvePack* pack = nullptr;      // none: the pipeline is in SAFE
    double rate_hz = 60.0;
};

class TickSolver {
  public:
    explicit TickSolver(const TickSolverParts& parts);
    // `faults`: found on the way of the pictures here.
    void tick(const FrameSet& frames, FaultMap faults, TickOutput& output);
    // Any thread: before the next tick tracking begins anew.
    void request_reset() { reset_wanted_.store(true, std::memory_order_relaxed); }
    // Any thread: before the next tick a neutral begins to be taken, or is forgotten.
    void request_neutral() { neutral_wanted_.store(true, std::memory_order_relaxed); }
    void request_forget_neutral() { forget_neutral_wanted_.store(true, std::memory_order_relaxed); }
    // One thread, another one too: from the next tick on the solve goes by these. Checked against the pack.
    void request_controls(const ControlSet& controls);
    [[nodiscard]] const StreamDigest& digest() const { return digest_; }
    [[nodiscard]] const Health& health() const { return health_; }

  private:
    // What was asked for since the last tick.
    struct Wishes {
        bool reset = false;
        bool neutral = false;
        bool forget_neutral = false;
        const ControlSet* controls = nullptr;
    };
    [[nodiscard]] Wishes carry_out_wishes();
    void record(const FrameSet& frames, const Wishes& wishes);
    void note_neutral();
    [[nodiscard]] FixedText<120> trouble_text() const;
    void count(const FrameSet& frames, const FrameReport& report, std::int64_t solve_us);

    TickSolverParts parts_;
    std::atomic<bool> reset_wanted_{false};
    std::atomic<bool> neutral_wanted_{false};
    std::atomic<bool> forget_neutral_wanted_{false};
    std::uint32_t neutrals_ended_ = 0;
    bool neutral_taken_ = false;
    FixedText<120> neutral_text_;
    LatestBox<ControlSet> wanted_controls_;
    OutputGate gate_;
    StreamDigest digest_;
    FaceState state_;
    FrameReport report_;
    Health health_;
    FaultBook faults_;
    TimeBook solve_times_;
};

}  // namespace rig
