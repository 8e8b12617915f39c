// What `headrig fit` leaves behind: a rig folder with the layout as found, and what was done, round by round
// and marker by marker.
#pragma once

#include <filesystem>

#include "firmware_host/companion/fit/layout_fit.hpp"

namespace rig::host {

// Into `folder`: markers_<n>.csv with _neutral and _B; fit_rounds.csv
// `round,rms_mm,mean_mm,worst_mm,change_mm, moved`; fit_markers.csv
// `marker,name,frames,given_mm,rms_mm,walked_mm,ox_mm,oy_mm,oz_mm`; and, `with_rig`, the rig in the take's
// millimetres.
[[nodiscard]] Result<void, FileError> save_fit(const std::filesystem::path& folder, const Rig& rig,
                                               const LayoutFit& fit, bool with_rig);

}  // namespace rig::host
