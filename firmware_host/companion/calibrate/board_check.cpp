#include "firmware_host/companion/calibrate/board_check.hpp"

#include <Eigen/SVD>
#include <cmath>
#include <map>
#include <vector>

#include "core/geometry/triangulation.hpp"

namespace rig::host {

namespace {

// Sum of squared distances after the best rigid motion (Kabsch 1976).
double rigid_misfit_mm2(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
    Vec3 mean_from = Vec3::Zero();
    Vec3 mean_to = Vec3::Zero();
    for (std::size_t i = 0; i < from.size(); ++i) {
        mean_from += from[i] / static_cast<double>(from.size());
        mean_to += to[i] / static_cast<double>(from.size());
    }
    Mat3 spread = Mat3::Zero();
    for (std::size_t i = 0; i < from.size(); ++i)
        spread += (to[i] - mean_to) * (from[i] - mean_from).transpose();
    const Eigen::JacobiSVD<Mat3> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 sign = Mat3::Identity();
    sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Mat3 turn = svd.matrixU() * sign * svd.matrixV().transpose();
    double sum = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i)
        sum += (to[i] - mean_to - turn * (from[i] - mean_from)).squaredNorm();
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
        sum += rigid_misfit_mm2(flat, found);
        check.points += flat.size();
    }
    if (check.points > 0) check.rms_mm = std::sqrt(sum / static_cast<double>(check.points));
    return check;
}

}  // namespace rig::host
