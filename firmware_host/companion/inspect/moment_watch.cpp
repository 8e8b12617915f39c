#include "firmware_host/companion/inspect/moment_watch.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rig::host {

namespace {

using Kind = WorstMoments::Kind;

constexpr double kNotableSlip = 0.5;  // of the alarm

struct Judged {
    Kind kind;
    double badness;  // 0: nothing to see
    std::string reason;
};

std::size_t hidden_of(const TakeRecord& record) {
    const auto count = static_cast<std::ptrdiff_t>(record.markers.size());
    if (record.sightings.empty()) return 0;
    return static_cast<std::size_t>(std::count_if(record.sightings.end() - count, record.sightings.end(),
                                                  [](Sighting s) { return s != Sighting::kVisible; }));
}

std::vector<Judged> judge_solved(const TakeRecord& record, const TakeTick& tick, bool first) {
    const std::size_t hidden = hidden_of(record);
    const int doubted = tick.swaps_repaired + tick.names_rejected;
    std::vector<Judged> all;
    if (first) all.push_back({Kind::kFirst, 1.0, "first face"});
    all.push_back({Kind::kHidden, static_cast<double>(hidden),
                   fmt::format("most markers hidden: {} of {}", hidden, record.markers.size())});
    all.push_back({Kind::kResidual, tick.residual_rms_mm,
                   fmt::format("largest residual: {:.3f} mm rms", tick.residual_rms_mm)});
    all.push_back({Kind::kRepair, static_cast<double>(doubted),
                   fmt::format("most names put right: {} changed, {} refused", tick.swaps_repaired,
                               tick.names_rejected)});
    all.push_back(
        {Kind::kGhosts, static_cast<double>(tick.ghosts), fmt::format("most ghosts: {}", tick.ghosts)});
    const double alarm = std::max(tick.slip_deg / kSlipAlarmDeg, tick.slip_mm / kSlipAlarmMm);
    all.push_back({Kind::kSlip, alarm > kNotableSlip ? alarm : 0.0,
                   fmt::format("largest slip: {:.1f} deg, {:.1f} mm", tick.slip_deg, tick.slip_mm)});
    return all;
}

}  // namespace

void MomentWatch::look(const TakeRecord& record, const std::function<std::vector<SceneView>()>& draw_up) {
    const TakeTick& tick = record.ticks.back();
    std::vector<Judged> judged;
    if (tick.solved) {
        judged = judge_solved(record, tick, !ever_solved_);
        ever_solved_ = true;
        last_solved_s_ = tick.time_s;
    } else if (ever_solved_) {
        const double lost_s = tick.time_s - last_solved_s_;
        judged.push_back(
            {Kind::kLoss, lost_s, fmt::format("longest loss: no face for {:.0f} ms", 1e3 * lost_s)});
    }
    std::erase_if(judged, [&](const Judged& each) { return !worst_.is_worst(each.kind, each.badness); });
    if (judged.empty()) return;
    const std::vector<SceneView> views = draw_up();
    for (Judged& each : judged) {
        worst_.keep(each.kind, each.badness, std::move(each.reason), record.ticks.size() - 1, tick.time_s,
                    views);
    }
}

}  // namespace rig::host
