#include "core/geometry/pnp.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/bounded_vector.hpp"
#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kLeastDepthMm = 1.0;
constexpr double kMostNumber = 1e6;  // mm or px: beyond it a square is no use
constexpr int kRounds = 24;          // of reweighting, one Gauss-Newton step each
constexpr double kScaleFall = 0.6;   // of the weights' scale, a round

using Points = BoundedVector<NamedPixel, kMaxPnpPoints>;
using Mat6 = std::array<double, 36>;
using Vec6 = std::array<double, 6>;

template <class V>
bool usable(const V& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i)
        if (!is_finite(v[i]) || std::fabs(v[i]) > kMostNumber) return false;
    return true;
}

Vec3 centroid_of(const Points& points) {
    Vec3 sum = Vec3::Zero();
    for (const NamedPixel& point : points) sum += point.face_mm;
    return sum / static_cast<double>(points.size());
}

// Root of least over largest eigenvalue of the points' scatter.
double flatness(const Points& points, const Vec3& centroid) {
    std::array<double, 9> scatter{};
    for (const NamedPixel& point : points) {
        const Vec3 d = point.face_mm - centroid;
        for (std::size_t i = 0; i < 9; ++i)
            scatter[i] += d[static_cast<int>(i) / 3] * d[static_cast<int>(i) % 3];
    }
    std::array<double, 3> values{};
    std::array<double, 9> vectors{};
    symmetric_eigen(scatter.data(), 3, 3, values.data(), vectors.data());
    return values[0] > 0.0 ? std::sqrt(std::max(0.0, values[2]) / values[0]) : 0.0;
}

// The camera that most points are seen by.
const CameraModel* busiest_camera(const Points& points, std::size_t& count) {
    const CameraModel* best = nullptr;
    count = 0;
    for (const NamedPixel& candidate : points) {
        std::size_t same = 0;
        for (const NamedPixel& point : points) same += point.camera == candidate.camera ? 1U : 0U;
        if (same > count) {
            count = same;
            best = candidate.camera;
        }
    }
    return best;
}

// Normal matrix of the DLT: rows (p, 0, -u p) and (0, p, -v p) of the point p = (face - centroid, 1) / scale
// and its undistorted u, v. Rays behind the camera's plane cannot be u, v and are left out.
std::size_t sum_linear(const Points& points, const CameraModel& camera, const Vec3& centroid, double scale_mm,
                       std::array<double, 144>& normal) {
    normal.fill(0.0);
    std::size_t used = 0;
    for (const NamedPixel& point : points) {
        if (point.camera != &camera) continue;
        const Vec3 ray = camera.camera_from_headset * pixel_ray(camera, point.pixel);
        if (!(ray[2] > 0.05)) continue;
        const Vec3 q = (point.face_mm - centroid) / scale_mm;
        const std::array<double, 4> p{q[0], q[1], q[2], 1.0};
        for (int axis = 0; axis < 2; ++axis) {
            std::array<double, 12> row{};
            const double image = ray[axis] / ray[2];
            for (std::size_t i = 0; i < 4; ++i) {
                row[4U * static_cast<std::size_t>(axis) + i] = p[i];
                row[8 + i] = -image * p[i];
            }
            for (std::size_t i = 0; i < 12; ++i)
                for (std::size_t j = 0; j < 12; ++j) normal[12 * i + j] += row[i] * row[j];
        }
        ++used;
    }
    return used;
}

// reference_from_face from the linear solution, which is one up to scale and sign.
bool linear_start(const Points& points, const CameraModel& camera, const Vec3& centroid, Rigid& pose) {
    double spread = 0.0;
    for (const NamedPixel& point : points) spread += (point.face_mm - centroid).squaredNorm();
    const double scale_mm = std::sqrt(spread / static_cast<double>(points.size()));
    std::array<double, 144> normal{};
    if (sum_linear(points, camera, centroid, scale_mm, normal) < kMinPnpPoints) return false;
    std::array<double, 12> values{};
    std::array<double, 144> vectors{};
    symmetric_eigen(normal.data(), 12, 12, values.data(), vectors.data());
    Mat3 turned;
    Vec3 shift;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) turned(r, c) = vectors[12U * static_cast<std::size_t>(4 * r + c) + 11];
        shift[r] = vectors[12U * static_cast<std::size_t>(4 * r + 3) + 11];
    }
    if (shift[2] < 0.0) {
        turned = -turned;
        shift = -shift;
    }
    // Noise makes `turned` no rotation: the third row is the others' cross product, the mean length the
    // scale.
    const Vec3 first = turned.row(0).transpose();
    const Vec3 second = turned.row(1).transpose();
    const double length = 0.5 * (first.norm() + second.norm());
    const Vec3 x = first.normalized();
    const Vec3 y = (second - x.dot(second) * x).normalized();
    if (!(length > 1e-12) || !usable(x) || !usable(y)) return false;
    Mat3 camera_from_face;
    camera_from_face.row(0) = x.transpose();
    camera_from_face.row(1) = y.transpose();
    camera_from_face.row(2) = x.cross(y).transpose();
    const Vec3 at_camera = shift * (scale_mm / length);
    const Mat3 back = camera.camera_from_headset.transpose();
    pose.rotation = back * camera_from_face;
    const Vec3 centre = back * at_camera + camera.centre_mm;
    pose.translation_mm = centre - pose.rotation * centroid;
    return usable(centre);
}

struct PoseSums {
    Mat6 normal{};
    Vec6 right{};
    double weight = 0.0;  // sum of the weights
    double weighted_px2 = 0.0;
    double cost = 0.0;       // Geman-McClure, in units of the scale's square
    std::size_t inside = 0;  // residual under the scale
    bool in_front = true;
};

// Unknowns: turn about the reference's axes through the centroid, and the centroid's shift.
PoseSums sum_up(const Points& points, const Vec3& centroid, const Rigid& pose, double scale_px) {
    PoseSums sums;
    const double scale2 = scale_px * scale_px;
    for (const NamedPixel& point : points) {
        const CameraModel& camera = *point.camera;
        const Vec3 arm = pose.rotation * (point.face_mm - centroid);
        const Vec3 at_reference = pose.apply(point.face_mm);
        const Vec3 at = camera.camera_from_headset * (at_reference - camera.centre_mm);
        if (!(at[2] > kLeastDepthMm)) {
            sums.in_front = false;
            sums.cost += 1.0;
            continue;
        }
        const Vec2 error = point.pixel - project_in_camera(camera, at).pixel;
        const double e2 = error.dot(error);
        const double share = scale2 / (scale2 + e2);
        const double weight = share * share;
        sums.cost += e2 / (scale2 + e2);
        sums.inside += e2 <= scale2 ? 1U : 0U;
        sums.weight += weight;
        sums.weighted_px2 += weight * e2;
        const PixelSlope slope = pixel_slope_in_camera(camera, at) * camera.camera_from_headset;
        std::array<std::array<double, 6>, 2> rows{};
        for (int r = 0; r < 2; ++r) {
            const Vec3 along = slope.row(r).transpose();
            const Vec3 about = arm.cross(along);  // slope . (turn x arm) = turn . (arm x slope)
            for (int i = 0; i < 3; ++i) {
                rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(i)] = about[i];
                rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(3 + i)] = along[i];
            }
        }
        for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t j = 0; j < 6; ++j)
                sums.normal[6 * i + j] += weight * (rows[0][i] * rows[0][j] + rows[1][i] * rows[1][j]);
            sums.right[i] += weight * (rows[0][i] * error[0] + rows[1][i] * error[1]);
        }
    }
    return sums;
}

// The normal matrix has turns (1/rad^2) and shifts (1/mm^2): scaled to ones before its factor.
bool factor_of(const Mat6& normal, Mat6& factor, Vec6& scale) {
    for (std::size_t i = 0; i < 6; ++i) {
        if (!(normal[7 * i] > 0.0)) return false;
        scale[i] = 1.0 / std::sqrt(normal[7 * i]);
    }
    Mat6 scaled{};
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j < 6; ++j) scaled[6 * i + j] = scale[i] * normal[6 * i + j] * scale[j];
    return cholesky(scaled.data(), factor.data(), 6, 6, 1e-12);
}

bool step(const PoseSums& sums, const Vec3& centroid, Rigid& pose) {
    Mat6 factor{};
    Vec6 scale{};
    if (!factor_of(sums.normal, factor, scale)) return false;
    Vec6 x{};
    for (std::size_t i = 0; i < 6; ++i) x[i] = scale[i] * sums.right[i];
    solve_lower(factor.data(), 6, 6, x.data());
    solve_lower_transposed(factor.data(), 6, 6, x.data());
    for (std::size_t i = 0; i < 6; ++i) x[i] *= scale[i];
    Vec3 turn{x[0], x[1], x[2]};
    const Vec3 shift{x[3], x[4], x[5]};
    if (!usable(turn) || !usable(shift)) return false;
    constexpr double kMostTurn = 0.5;  // of one step: beyond it the slopes mean nothing
    const double length = turn.norm();
    if (length > kMostTurn) turn *= kMostTurn / length;
    const Vec3 centre = pose.apply(centroid) + shift;
    pose.rotation = orthonormalised(rotation_from_vector(turn) * pose.rotation);
    pose.translation_mm = centre - pose.rotation * centroid;
    return true;
}

struct Candidate {
    Rigid pose;
    PoseSums sums;
    bool ok = false;
};

Candidate refine(const Points& points, const Vec3& centroid, const PnpConfig& config, const Rigid& start) {
    Candidate best;
    best.pose = start;
    const double last_px = config.outlier_sigmas * config.sigma_px;
    // What the start leaves: the rms of residuals that are not cut off.
    const PoseSums first = sum_up(points, centroid, start, 1e5);
    if (!(first.weight > 0.0)) return best;
    double scale_px = std::max(last_px, 2.0 * std::sqrt(first.weighted_px2 / first.weight));
    for (int round = 0; round < kRounds; ++round) {
        if (!step(sum_up(points, centroid, best.pose, scale_px), centroid, best.pose)) return best;
        scale_px = std::max(last_px, kScaleFall * scale_px);
    }
    best.sums = sum_up(points, centroid, best.pose, last_px);
    best.ok = best.sums.in_front;
    return best;
}

void keep_better(const Candidate& other, Candidate& best) {
    if (other.ok && (!best.ok || other.sums.cost < best.sums.cost)) best = other;
}

// The points that a pose explains best, this share of them.
Points best_explained(const Points& points, const Rigid& pose, double share) {
    std::array<double, kMaxPnpPoints> squared_px{};
    std::array<double, kMaxPnpPoints> sorted{};
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Projection at = project(*points[i].camera, pose.apply(points[i].face_mm));
        const Vec2 error = points[i].pixel - at.pixel;
        squared_px[i] =
            at.z_mm > kLeastDepthMm && usable(error) ? error.dot(error) : 4.0 * kMostNumber * kMostNumber;
        sorted[i] = squared_px[i];
    }
    std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(points.size()));
    const auto last = static_cast<std::size_t>(share * static_cast<double>(points.size() - 1));
    Points kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (squared_px[i] > sorted[last]) continue;
        const bool fits = kept.push_back(points[i]);
        RIG_CHECK(fits);
    }
    return kept;
}

// Linear starts from all points, then from those that the last start explains: wrong names leave step by
// step.
Candidate from_nothing(const Points& points, const CameraModel& camera, const Vec3& centroid,
                       const PnpConfig& config) {
    constexpr int kStarts = 4;
    constexpr double kTrusted = 0.9;  // of the points explained: the start was good
    Candidate best;
    Points trusted = points;
    for (int trial = 0; trial < kStarts; ++trial) {
        Rigid start;
        if (!linear_start(trusted, camera, centroid, start)) break;
        keep_better(refine(points, centroid, config, start), best);
        if (best.ok && static_cast<double>(best.sums.inside) >= kTrusted * static_cast<double>(points.size()))
            break;
        trusted = best_explained(points, start, 0.85 - 0.1 * trial);
    }
    return best;
}

// Standard deviations of the answer; false when something is left open.
bool sigmas_of(const PoseSums& sums, const PnpConfig& config, HeadPose& answer) {
    Mat6 factor{};
    Vec6 scale{};
    if (!factor_of(sums.normal, factor, scale)) return false;
    for (std::size_t i = 0; i < 6; ++i) {
        Vec6 x{};
        x[i] = 1.0;
        solve_lower(factor.data(), 6, 6, x.data());
        double variance = 0.0;
        for (const double each : x) variance += each * each;
        const double sigma = config.sigma_px * scale[i] * std::sqrt(variance);
        if (i < 3) answer.rotation_sigma_rad[static_cast<int>(i)] = sigma;
        if (i >= 3) answer.translation_sigma_mm[static_cast<int>(i) - 3] = sigma;
    }
    return answer.rotation_sigma_rad.maxCoeff() <= config.most_sigma_rad;
}

HeadPose refused(PnpRefusal refusal) {
    HeadPose answer;
    answer.refusal = refusal;
    return answer;
}

}  // namespace

HeadPose solve_pnp(std::span<const NamedPixel> given, const PnpConfig& config, const HeadPose& before) {
    RIG_CHECK(given.size() <= kMaxPnpPoints);
    Points points;
    for (const NamedPixel& point : given) {
        if (!usable(point.face_mm) || !usable(point.pixel)) continue;
        const bool kept = points.push_back(point);
        RIG_CHECK(kept);
    }
    std::size_t most = 0;
    const CameraModel* camera = busiest_camera(points, most);
    if (most < kMinPnpPoints) return refused(PnpRefusal::kTooFew);
    const Vec3 centroid = centroid_of(points);
    if (!(flatness(points, centroid) >= config.flat_share)) return refused(PnpRefusal::kFlat);
    Candidate best = from_nothing(points, *camera, centroid, config);
    if (before.known) keep_better(refine(points, centroid, config, before.reference_from_face), best);
    if (!best.ok) return refused(PnpRefusal::kBehind);
    HeadPose answer;
    answer.reference_from_face = best.pose;
    answer.rms_px = std::sqrt(best.sums.weighted_px2 / best.sums.weight);
    answer.points_used = static_cast<std::uint16_t>(best.sums.inside);
    const double needed =
        std::max(static_cast<double>(kMinPnpPoints), config.least_share * static_cast<double>(points.size()));
    if (static_cast<double>(best.sums.inside) < needed || !(answer.rms_px <= config.most_rms_px))
        answer.refusal = PnpRefusal::kMistaken;
    else if (!sigmas_of(best.sums, config, answer))
        answer.refusal = PnpRefusal::kUncertain;
    answer.known = answer.refusal == PnpRefusal::kNone;
    return answer;
}

HeadPose track_pnp(std::span<const NamedPixel> points, const PnpConfig& config, HeadPose& last_known) {
    const HeadPose answer = solve_pnp(points, config, last_known);
    if (answer.known) last_known = answer;
    return answer;
}

}  // namespace rig
