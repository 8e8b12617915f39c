#include "firmware_host/companion/inspect/take_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/links/fault_text.hpp"

namespace rig::host {

namespace {

void worsen(std::optional<Worst>& worst, double value, double at_s) {
    if (!std::isfinite(value)) return;
    if (!worst || value > worst->value) worst = Worst{value, at_s};
}

// The time that a tick stands for ends where the next one begins.
double end_of(const TakeRecord& record, std::size_t tick) {
    if (tick + 1 < record.ticks.size()) return record.ticks[tick + 1].time_s;
    return record.ticks[tick].time_s + 1.0 / record.rate_hz;
}

MarkerSummary marker_summary(const TakeRecord& record, std::size_t marker) {
    MarkerSummary out;
    out.marker = marker;
    const auto ticks = static_cast<double>(record.ticks.size());
    double squares = 0.0;
    std::uint64_t measured = 0;
    double hidden_since_s = 0.0;
    bool hidden = false;
    for (std::size_t t = 0; t < record.ticks.size(); ++t) {
        const Sighting sighting = record.sighting(t, marker);
        (sighting == Sighting::kVisible    ? out.visible
         : sighting == Sighting::kInferred ? out.inferred
                                           : out.lost) += 1.0 / ticks;
        if (sighting == Sighting::kVisible) {
            hidden = false;
        } else {
            if (!hidden) hidden_since_s = record.ticks[t].time_s;
            hidden = true;
            const double length_s = end_of(record, t) - hidden_since_s;
            if (length_s > out.longest_hidden_s.value) out.longest_hidden_s = {length_s, hidden_since_s};
        }
        if (record.residuals_mm.empty() || !std::isfinite(record.residual(t, marker))) continue;
        const auto residual = static_cast<double>(record.residual(t, marker));
        squares += residual * residual;
        ++measured;
        worsen(out.residual_max_mm, residual, record.ticks[t].time_s);
    }
    if (measured > 0) out.residual_rms_mm = std::sqrt(squares / static_cast<double>(measured));
    return out;
}

void add_losses(const TakeRecord& record, InspectFigures& out) {
    double lost_since_s = 0.0;
    bool lost = false;
    for (std::size_t t = 0; t < record.ticks.size(); ++t) {
        const TakeTick& tick = record.ticks[t];
        if (tick.solved && !out.first_face_s) out.first_face_s = tick.time_s;
        if (!out.first_face_s) continue;
        if (tick.solved) {
            lost = false;
            continue;
        }
        if (!lost) lost_since_s = tick.time_s;
        lost = true;
        const double length_ms = 1e3 * (end_of(record, t) - lost_since_s);
        if (length_ms > out.longest_loss_ms.value) out.longest_loss_ms = {length_ms, lost_since_s};
    }
}

void add_tick_figures(const TakeRecord& record, InspectFigures& out) {
    std::vector<double> residuals;
    bool found = false;
    for (const TakeTick& tick : record.ticks) {
        out.swaps_repaired += tick.swaps_repaired;
        out.repair_ticks += tick.swaps_repaired > 0 ? 1 : 0;
        out.names_rejected += tick.names_rejected;
        out.ghosts += tick.ghosts;
        out.rebootstraps += tick.bootstrapped && found ? 1 : 0;
        found = found || tick.bootstrapped;
        worsen(out.slip_max_deg, tick.slip_deg, tick.time_s);
        worsen(out.slip_max_mm, tick.slip_mm, tick.time_s);
        worsen(out.residual_max_mm, tick.residual_rms_mm, tick.time_s);
        out.slip_alarm_ticks += tick.slip_deg > kSlipAlarmDeg || tick.slip_mm > kSlipAlarmMm ? 1 : 0;
        if (std::isfinite(tick.residual_rms_mm)) residuals.push_back(tick.residual_rms_mm);
    }
    if (residuals.empty()) return;
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::ranges::nth_element(residuals, middle);
    out.residual_median_mm = *middle;
}

std::vector<FaultSummary> faults_in(const TakeRecord& record) {
    std::vector<FaultSummary> all;
    for (int number = 1; number <= 64; ++number) {
        const FaultMap bit = FaultMap{1} << (number - 1);
        FaultSummary fault{.number = number};
        bool before = false;
        for (const TakeTick& tick : record.ticks) {
            const bool now = (tick.faults & bit) != 0;
            if (now && fault.ticks == 0) fault.first_s = tick.time_s;
            fault.ticks += now ? 1 : 0;
            fault.times += now && !before ? 1 : 0;
            before = now;
        }
        if (fault.ticks > 0) all.push_back(fault);
    }
    return all;
}

std::string at(const Worst& worst) {
    return fmt::format(" (at {:.1f} s)", worst.at_s);
}

}  // namespace

InspectFigures figures_of(const TakeRecord& record) {
    InspectFigures out;
    out.ticks = record.ticks.size();
    if (record.ticks.empty()) return out;
    out.duration_s = end_of(record, record.ticks.size() - 1);
    add_losses(record, out);
    add_tick_figures(record, out);
    out.faults = faults_in(record);
    if (record.sightings.empty()) return out;
    const auto count = static_cast<double>(record.markers.size());
    for (std::size_t k = 0; k < record.markers.size(); ++k) {
        out.markers.push_back(marker_summary(record, k));
        out.visible += out.markers.back().visible / count;
        out.inferred += out.markers.back().inferred / count;
        out.lost += out.markers.back().lost / count;
    }
    return out;
}

std::string incident_text(const TakeRecord& record, const MarkerIncident& incident) {
    const std::string& name = record.markers[incident.marker].name;
    if (incident.trouble == MarkerTrouble::kFallen) {
        return fmt::format("marker {} has come off (noticed at {:.2f} s): put a new dot there", name,
                           incident.first_s);
    }
    return fmt::format(
        "marker {} has slid by {:.1f} mm (noticed at {:.2f} s): press it back or run `headrig neutral`", name,
        incident.most_mm, incident.first_s);
}

std::vector<std::string> summary_facts(const TakeRecord& record, const InspectFigures& f) {
    std::vector<std::string> facts;
    facts.push_back(fmt::format("{} frames at {:.4g} Hz, {:.1f} s", f.ticks, record.rate_hz, f.duration_s));
    if (!record.sightings.empty()) {
        facts.push_back(fmt::format("markers visible {:.2f} %, inferred {:.2f} %, lost {:.2f} %",
                                    100.0 * f.visible, 100.0 * f.inferred, 100.0 * f.lost));
    }
    if (!record.residuals_mm.empty()) {
        facts.push_back(fmt::format("swaps repaired: {} names in {} frames; names refused: {}",
                                    f.swaps_repaired, f.repair_ticks, f.names_rejected));
    }
    for (const MarkerIncident& incident : record.incidents) facts.push_back(incident_text(record, incident));
    if (record.counts_ghosts) {
        facts.push_back(
            fmt::format("ghosts rejected: {} ({:.2f} a frame)", f.ghosts,
                        static_cast<double>(f.ghosts) / std::max(1.0, static_cast<double>(f.ticks))));
    }
    if (f.ticks > 0 && !f.first_face_s) facts.emplace_back("no face was ever found");
    if (f.first_face_s && *f.first_face_s > 0.0)
        facts.push_back(fmt::format("first face after {:.0f} ms", 1e3 * *f.first_face_s));
    if (f.first_face_s) {
        facts.push_back(f.longest_loss_ms.value > 0.0
                            ? fmt::format("longest loss {:.0f} ms", f.longest_loss_ms.value) +
                                  at(f.longest_loss_ms)
                            : std::string("longest loss 0 ms"));
    }
    if (f.rebootstraps > 0) facts.push_back(fmt::format("identities found anew {} times", f.rebootstraps));
    if (f.slip_max_deg && f.slip_max_mm) {
        facts.push_back(fmt::format("slip at most {:.2f} deg", f.slip_max_deg->value) + at(*f.slip_max_deg) +
                        fmt::format(" and {:.2f} mm", f.slip_max_mm->value) + at(*f.slip_max_mm));
    }
    if (f.residual_median_mm && f.residual_max_mm) {
        facts.push_back(fmt::format("residual rms median {:.3f} mm, most {:.3f} mm", *f.residual_median_mm,
                                    f.residual_max_mm->value) +
                        at(*f.residual_max_mm));
    }
    if (record.missing_ticks > 0) facts.push_back(fmt::format("{} frames missing", record.missing_ticks));
    return facts;
}

}  // namespace rig::host
