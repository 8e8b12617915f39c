// A take in numbers: the summary line of the page and its tables.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware_host/companion/inspect/take_record.hpp"

namespace rig::host {

struct Worst {
    double value = 0.0;
    double at_s = 0.0;
};

struct MarkerSummary {
    std::size_t marker = 0;
    double visible = 0.0;  // shares of the ticks, 0..1; they sum to 1
    double inferred = 0.0;
    double lost = 0.0;
    Worst longest_hidden_s;  // in a row not seen; and when that began
    double residual_rms_mm = 0.0;
    std::optional<Worst> residual_max_mm;  // nothing when it was never measured
};

struct FaultSummary {
    int number = 0;  // 1..64
    std::uint64_t ticks = 0;
    std::uint64_t times = 0;  // that it was raised
    double first_s = 0.0;
};

struct InspectFigures {
    std::size_t ticks = 0;
    double duration_s = 0.0;  // first tick to the end of the last
    double visible = 0.0;     // shares of markers x ticks, 0..1
    double inferred = 0.0;
    double lost = 0.0;
    std::uint64_t swaps_repaired = 0;  // names that changed
    std::uint64_t repair_ticks = 0;
    std::uint64_t names_rejected = 0;
    std::uint64_t ghosts = 0;
    std::uint64_t rebootstraps = 0;      // after the first
    std::optional<double> first_face_s;  // nothing when there never was one
    Worst longest_loss_ms;               // after the first face; until the end when it never came back
    std::optional<Worst> slip_max_deg;
    std::optional<Worst> slip_max_mm;
    std::optional<double> residual_median_mm;
    std::optional<Worst> residual_max_mm;
    std::uint64_t slip_alarm_ticks = 0;
    std::vector<MarkerSummary> markers;  // in the record's order; empty when the take holds none
    std::vector<FaultSummary> faults;    // by number
};

[[nodiscard]] InspectFigures figures_of(const TakeRecord& record);

// What happened to a marker, and the remedy.
[[nodiscard]] std::string incident_text(const TakeRecord& record, const MarkerIncident& incident);
// Facts for one line, each with its unit.
[[nodiscard]] std::vector<std::string> summary_facts(const TakeRecord& record, const InspectFigures& figures);

}  // namespace rig::host
