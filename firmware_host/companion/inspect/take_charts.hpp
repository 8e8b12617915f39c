// The pictures of a take: who was seen when, states and faults over time, curves, moments. All charts over
// time have the same axis and line up.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "firmware_host/companion/inspect/take_figures.hpp"
#include "firmware_host/companion/inspect/take_record.hpp"
#include "firmware_host/companion/report/svg_chart.hpp"

namespace rig::host {

// Columns of a picture over time: as many as ticks, at most kMaxTimeBins. A tick fills the time until the
// next one, but never more than one and a half periods: gaps stay gaps.
inline constexpr std::size_t kMaxTimeBins = 710;
struct TimeBins {
    double duration_s = 0.0;
    std::size_t count = 1;
    struct Span {
        std::size_t first = 0;
        std::size_t last = 0;  // included
    };
    std::vector<Span> of_tick;
};
[[nodiscard]] TimeBins time_bins(const TakeRecord& record);

// Rows of markers by region. A column of several ticks is split by the shares of visible, inferred and lost,
// and whatever occurs at all gets a pixel. Precondition: the record has ticks and sightings.
[[nodiscard]] std::string marker_timeline(const TakeRecord& record);

// Tracking state and cameras; a column shows the worst of its ticks. Precondition: the record has ticks.
[[nodiscard]] std::string state_ribbons(const TakeRecord& record);
// One ribbon a fault, with its code and sentence. Precondition: as above, and `faults` is not empty.
[[nodiscard]] std::string fault_ribbons(const TakeRecord& record, const std::vector<FaultSummary>& faults);

// A number of every tick over time: least and most of each column, so that peaks stay; breaks where it is not
// a number. With swaps, fresh bootstraps and resets marked on top.
[[nodiscard]] std::string tick_curve(const TakeRecord& record, const std::string& y_name,
                                     const std::function<double(const TakeTick&)>& value,
                                     const std::vector<ChartLevel>& levels);

// A view with its picture behind it; names of the markers beside their blobs.
[[nodiscard]] std::string scene_svg(const SceneView& view, const std::vector<InspectedMarker>& markers);

}  // namespace rig::host
