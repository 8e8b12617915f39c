// Zhang06 section 5.3: "subdividing the face into a number of small regions increases the variety of
// expressions that can be synthesized" from the same few examples.
#include <fmt/format.h>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/region_fit.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kExamples = 12;  // the source used 10 to 15

std::vector<std::string> row_of(const char* take, const std::string& regions, const RegionFit& fit,
                                double whole_mm) {
    return {take,
            regions,
            fmt::format("{:.3f}", fit.marker_rms_mm),
            fmt::format("{:.3f}", fit.marker_rms_mm / whole_mm),
            fmt::format("{:.1e}", fit.worst_kkt),
            std::to_string(fit.uncertified)};
}

}  // namespace

Result<ExperimentTable, FileError> zhang06_regions(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "102");
    if (!head) return failure(head.error());
    const Eigen::MatrixXd examples = face_examples(*head, head->range_of_motion, kExamples);
    const std::vector<MarkerRegion> face = whole_face(head->layout);
    const std::vector<MarkerRegion> surface = surface_regions(head->layout);
    ExperimentTable out;
    out.columns = {"take",      "regions",    "rms of a marker, mm", "of the whole face's",
                   "worst kkt", "uncertified"};
    for (const auto& [name, take] :
         {std::pair{"range of motion", &head->range_of_motion}, std::pair{"speech", &head->speech}}) {
        const RegionFit whole = fit_regions(*head, face, examples, *take);
        const RegionFit parts = fit_regions(*head, surface, examples, *take);
        out.rows.push_back(row_of(name, "1", whole, whole.marker_rms_mm));
        out.rows.push_back(row_of(name, std::to_string(surface.size()), parts, whole.marker_rms_mm));
        if (take == &head->range_of_motion) {
            out.bounds.push_back({fmt::format("error of {} regions against the whole face", surface.size()),
                                  parts.marker_rms_mm / whole.marker_rms_mm, 0.65});
        }
        out.bounds.push_back({fmt::format("{}: regions without a certificate", name),
                              static_cast<double>(whole.uncertified + parts.uncertified), 0.0});
    }
    out.remarks = {
        fmt::format(
            "102 markers without noise, every frame of both takes; {} examples of the range-of-motion "
            "take: the neutral face and the frames at the ends of its principal axes.",
            examples.rows()),
        "The speech take is another performer's, with these examples."};
    return out;
}

}  // namespace rig::host
