#include "firmware_host/companion/fit/fit_files.hpp"

#include "firmware_host/companion/files/csv.hpp"

namespace rig::host {

namespace {

CsvWriter rounds_table(const LayoutFit& fit) {
    CsvWriter csv({"round", "rms_mm", "mean_mm", "worst_mm", "change_mm", "moved"});
    for (std::size_t r = 0; r < fit.rounds.size(); ++r) {
        const FitRound& round = fit.rounds[r];
        csv.integer(static_cast<std::int64_t>(r)).number(round.rms_mm, 4).number(round.mean_mm, 4);
        csv.number(round.worst_mm, 4).number(round.change_mm, 4);
        csv.integer(static_cast<std::int64_t>(round.moved)).end_row();
    }
    return csv;
}

CsvWriter markers_table(const LayoutFit& fit) {
    CsvWriter csv({"marker", "name", "frames", "given_mm", "rms_mm", "walked_mm", "ox_mm", "oy_mm", "oz_mm"});
    for (std::size_t k = 0; k < fit.markers.size(); ++k) {
        const FittedMarker& marker = fit.markers[k];
        csv.integer(static_cast<std::int64_t>(k)).text(fit.layout.markers[k].name);
        csv.integer(static_cast<std::int64_t>(marker.frames)).number(marker.given_mm, 4);
        csv.number(marker.rms_mm, 4).number(marker.walked_mm, 4);
        for (const float o_mm : fit.layout.markers[k].offset_mm) csv.number(static_cast<double>(o_mm), 4);
        csv.end_row();
    }
    return csv;
}

}  // namespace

Result<void, FileError> save_fit(const std::filesystem::path& folder, const Rig& rig, const LayoutFit& fit,
                                 bool with_rig) {
    const Rig scaled = scaled_rig(rig, fit.rig_scale);
    if (with_rig) {
        if (const auto ok = save_rig(folder, scaled); !ok) return ok;
    }
    if (const auto ok = save_layout(folder, fit.layout, scaled); !ok) return ok;
    if (const auto ok = rounds_table(fit).save(folder / "fit_rounds.csv"); !ok) return ok;
    return markers_table(fit).save(folder / "fit_markers.csv");
}

}  // namespace rig::host
