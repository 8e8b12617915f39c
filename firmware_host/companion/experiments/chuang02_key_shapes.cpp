// Chuang02 section 4.2 and Fig. 6: "using the maximum spread along the principle components results in the
// smallest reconstruction error among the three methods. In addition, the error decreases monotonically as
// the number of key shapes increases".
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/key_shapes.hpp"

namespace rig::host {

namespace {

constexpr std::array<std::size_t, 2> kImageAxes{0, 1};  // what one camera in front sees
constexpr std::array kMethods{KeyShapeMethod::kSpread, KeyShapeMethod::kClusters2,
                              KeyShapeMethod::kClusters3};
constexpr std::size_t kFewest = 4;
constexpr std::size_t kMost = 24;
constexpr std::size_t kBoundedTo = 12;
constexpr double kRounding = 1e-6;

// Of a marker in the image plane.
double marker_rms_mm(const KeyShapeError& error) {
    return error.rms_mm * std::sqrt(2.0);
}

struct Curves {
    double largest_rise = -1.0;  // of the spread, relative, from one count to the next
    double least_lead = -1.0;    // of the spread over the better clustering, up to kBoundedTo
    double largest_weight = 0.0;
};

Curves measure(const std::string& name, const RegionMotion& motion, ExperimentTable& out) {
    Curves curves;
    double before = 0.0;
    for (std::size_t count = kFewest; count <= kMost; count += 2) {
        std::array<double, kMethods.size()> rms{};
        std::vector<std::string> row{name, std::to_string(count)};
        for (std::size_t m = 0; m < kMethods.size(); ++m) {
            const KeyShapes shapes = choose_key_shapes(motion, kMethods[m], count);
            const KeyShapeError error = key_shape_error(motion.positions_mm, shapes);
            rms[m] = marker_rms_mm(error);
            curves.largest_weight = std::max(curves.largest_weight, error.largest_weight);
            row.push_back(fmt::format("{:.3f}", rms[m]));
        }
        out.rows.push_back(std::move(row));
        if (count > kFewest) curves.largest_rise = std::max(curves.largest_rise, rms[0] / before - 1.0);
        if (count <= kBoundedTo)
            curves.least_lead = std::max(curves.least_lead, rms[0] / std::min(rms[1], rms[2]) - 1.0);
        before = rms[0];
    }
    const KeyShapes hull = choose_key_shapes(motion, KeyShapeMethod::kHull, 0);
    out.rows.push_back({name, fmt::format("{}, hull", hull.frames.size()),
                        fmt::format("{:.3f}", marker_rms_mm(key_shape_error(motion.positions_mm, hull))), "",
                        ""});
    return curves;
}

}  // namespace

Result<ExperimentTable, FileError> chuang02_key_shapes(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "102");
    if (!head) return failure(head.error());
    ExperimentTable out;
    out.columns = {"take, region", "key shapes", "spread", "clusters, 2D", "clusters, 3D"};
    const MarkerRegion lips = lip_region(head->layout);
    const std::vector<MarkerRegion> features = feature_regions(head->layout);
    const auto mouth = std::ranges::find(features, "mouth", &MarkerRegion::name);
    const auto motion_of = [&](const MarkerRegion& region, const Take& take) {
        return region_motion(region, head->model.neutral_mm, head->model.basis_mm, std::span(&take, 1),
                             kImageAxes);
    };
    const Curves speech = measure("speech, lips", motion_of(lips, head->speech), out);
    const Curves range = measure("range of motion, lips", motion_of(lips, head->range_of_motion), out);
    Curves wide;
    if (mouth != features.end()) wide = measure("speech, mouth", motion_of(*mouth, head->speech), out);
    out.bounds = {{"largest rise of the spread from one even count to the next, relative",
                   std::max({speech.largest_rise, range.largest_rise, wide.largest_rise}), kRounding},
                  {fmt::format("spread above the better clustering, speech, lips, {} to {} shapes, relative",
                               kFewest, kBoundedTo),
                   speech.least_lead, 0.0}};
    out.remarks = {
        fmt::format("Rms distance of a marker in the image plane, mm; 102 markers, of which {} around the "
                    "lips, the source's choice; largest weight {:.2f}.",
                    lips.markers.size(), std::max(speech.largest_weight, range.largest_weight)),
        "The mouth region that a pack has reaches up to the nose and down to the jaw; its frames lie along "
        "more axes than few spread shapes can hold.",
        "The picture: headrig keyshapes --region lips --axes xy --layout 102 --out DIR."};
    return out;
}

}  // namespace rig::host
