#include "firmware_host/companion/calibrate/board_check.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry/triangulation.hpp"
#include "firmware_host/companion/fit/similarity.hpp"

namespace rig::host {

namespace {

// Sum of squared distances after the best rigid motion; nothing where the points lie on a line.
std::optional<double> rigid_misfit_mm2(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
    SimilarityFit fit;
    for (std::size_t i = 0; i < from.size(); ++i) fit.add(from[i], to[i]);
    const std::optional<Similarity> motion = fit.solve(/*scaled=*/false);
    if (!motion) return std::nullopt;
    double sum = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) sum += (to[i] - motion->apply(from[i])).squaredNorm();
    return sum;
}

}  // namespace

TriangulationCheck check_triangulation(const BundleProblem& problem) {
    std::map<std::size_t, std::map<std::size_t, std::vector<PixelSighting>>> sightings;  // [view][point]
    BundleProblem centres = problem;
    centres.point_radius_mm = 0.0;
    for (const BundleObservation& each : problem.observations) {
        // What is seen of a circle is its centroid; what lies on the board is its centre.
        const Vec2 seen = each.seen_px - predicted_pixel(problem, each) + predicted_pixel(centres, each);
        sightings[each.view][each.point].push_back({&problem.cameras[each.camera], seen, 1.0});
    }
    TriangulationCheck check;
    double sum = 0.0;
    for (const auto& [view, points] : sightings) {
        std::vector<Vec3> flat;
        std::vector<Vec3> found;
        for (const auto& [point, seen] : points) {
            const PointFit fit = triangulate_pixels(seen);
            if (!fit.known) continue;
            flat.emplace_back(problem.points[point].x_mm, problem.points[point].y_mm, 0.0);
            found.push_back(fit.position_mm);
        }
        if (flat.size() < 4) continue;
        const std::optional<double> misfit_mm2 = rigid_misfit_mm2(flat, found);
        if (!misfit_mm2) continue;
        sum += *misfit_mm2;
        check.points += flat.size();
    }
    if (check.points > 0) check.rms_mm = std::sqrt(sum / static_cast<double>(check.points));
    return check;
}

}  // namespace rig::host
