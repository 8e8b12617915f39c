#include "firmware_host/companion/calibrate/initial_cameras.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "core/base/math.hpp"

namespace rig::host {

namespace {

constexpr double kWidestAngle = 0.45 * std::numbers::pi;  // rays beyond are of no use on a plane
constexpr double kTurnMm = 200.0;  // a helmet's distances: what a turn of a radian moves, to compare the two

std::vector<cv::Point3f> board_side(const BoardPicture& picture, const std::vector<BoardPoint>& points) {
    std::vector<cv::Point3f> out;
    for (const std::size_t i : picture.points)
        out.emplace_back(static_cast<float>(points[i].x_mm), static_cast<float>(points[i].y_mm), 0.0F);
    return out;
}

CameraModel plain_camera(int width_px, int height_px, double f_px, LensModel lens) {
    CameraModel camera;
    camera.width_px = width_px;
    camera.height_px = height_px;
    camera.fx_px = camera.fy_px = f_px;
    camera.cx_px = 0.5 * (width_px - 1);
    camera.cy_px = 0.5 * (height_px - 1);
    camera.lens = lens;
    return camera;
}

std::optional<CameraModel> initial_by_planes(CameraModel camera, const std::vector<BoardPicture>& pictures,
                                             const std::vector<BoardPoint>& points) {
    std::vector<std::vector<cv::Point3f>> board;
    std::vector<std::vector<cv::Point2f>> image;
    for (const BoardPicture& picture : pictures) {
        board.push_back(board_side(picture, points));
        image.emplace_back();
        for (const Vec2& seen : picture.seen_px)
            image.back().emplace_back(static_cast<float>(seen[0]), static_cast<float>(seen[1]));
    }
    cv::Mat lens = cv::Mat::eye(3, 3, CV_64F);
    cv::Mat bend;
    std::vector<cv::Mat> turns;
    std::vector<cv::Mat> shifts;
    const int flags = cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3;
    try {
        cv::calibrateCamera(board, image, {camera.width_px, camera.height_px}, lens, bend, turns, shifts,
                            flags);
    } catch (const cv::Exception&) {
        return std::nullopt;
    }
    camera.fx_px = lens.at<double>(0, 0);
    camera.fy_px = lens.at<double>(1, 1);
    camera.cx_px = lens.at<double>(0, 2);
    camera.cy_px = lens.at<double>(1, 2);
    camera.k1 = bend.at<double>(0);
    camera.k2 = bend.at<double>(1);
    // A start beyond what the files may hold is none.
    if (!(camera.fx_px > 1.0) || !(camera.fy_px > 1.0) || !(std::abs(camera.k1) < 5.0) ||
        !(std::abs(camera.k2) < 10.0))
        return std::nullopt;
    return camera;
}

// Median distance of seen from projected points over all pictures; infinite when hardly any has a pose.
double misfit_px(const CameraModel& camera, const std::vector<BoardPicture>& pictures,
                 const std::vector<BoardPoint>& points) {
    std::vector<double> errors;
    std::size_t wanted = 0;
    for (const BoardPicture& picture : pictures) {
        wanted += picture.points.size();
        const auto pose = board_pose(camera, picture, points);
        if (!pose) continue;
        for (std::size_t i = 0; i < picture.points.size(); ++i) {
            const BoardPoint& point = points[picture.points[i]];
            const Projection at = project_in_camera(camera, pose->apply(Vec3{point.x_mm, point.y_mm, 0.0}));
            errors.push_back(at.z_mm > 0.0 ? (at.pixel - picture.seen_px[i]).norm() : 1e6);
        }
    }
    if (2 * errors.size() < wanted || errors.empty()) return std::numeric_limits<double>::infinity();
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
}

std::optional<CameraModel> initial_fisheye(int width_px, int height_px,
                                           const std::vector<BoardPicture>& pictures,
                                           const std::vector<BoardPoint>& points) {
    std::optional<CameraModel> best;
    double least = std::numeric_limits<double>::infinity();
    for (int degrees = 40; degrees <= 200; degrees += 8) {
        const double half_diagonal = 0.5 * std::hypot(width_px, height_px);
        const double f_px = half_diagonal / (0.5 * degrees * std::numbers::pi / 180.0);
        const CameraModel camera = plain_camera(width_px, height_px, f_px, LensModel::kFisheye);
        const double misfit = misfit_px(camera, pictures, points);
        if (misfit < least) {
            least = misfit;
            best = camera;
        }
    }
    return best;
}

double apart_mm(const Rigid& a, const Rigid& b) {
    const Mat3 turn = a.rotation.transpose() * b.rotation;
    return (a.translation_mm - b.translation_mm).norm() + kTurnMm * vector_from_rotation(turn).norm();
}

// The candidate nearest to all others.
Rigid middle_of(const std::vector<Rigid>& candidates) {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        double sum = 0.0;
        for (const Rigid& other : candidates) sum += apart_mm(candidates[i], other);
        if (sum < least) {
            least = sum;
            best = i;
        }
    }
    return candidates[best];
}

// b from a over every view both saw.
std::vector<Rigid> between(const std::vector<std::optional<Rigid>>& a,
                           const std::vector<std::optional<Rigid>>& b) {
    std::vector<Rigid> out;
    for (std::size_t v = 0; v < a.size(); ++v) {
        if (!a[v] || !b[v]) continue;
        const Mat3 rotation = b[v]->rotation * a[v]->rotation.transpose();
        out.push_back({rotation, b[v]->translation_mm - rotation * a[v]->translation_mm});
    }
    return out;
}

}  // namespace

std::optional<CameraModel> initial_camera(int width_px, int height_px,
                                          const std::vector<BoardPicture>& pictures,
                                          const std::vector<BoardPoint>& points, LensTerms terms) {
    if (terms == LensTerms::kFisheye) return initial_fisheye(width_px, height_px, pictures, points);
    return initial_by_planes(plain_camera(width_px, height_px, width_px, LensModel::kRational), pictures,
                             points);
}

std::optional<Rigid> board_pose(const CameraModel& camera, const BoardPicture& picture,
                                const std::vector<BoardPoint>& points) {
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> plane;
    for (std::size_t i = 0; i < picture.points.size(); ++i) {
        CameraModel still = camera;
        still.camera_from_headset = Mat3::Identity();
        const Vec3 ray = pixel_ray(still, picture.seen_px[i]);
        if (!(ray[2] > std::cos(kWidestAngle))) continue;
        plane.emplace_back(static_cast<float>(ray[0] / ray[2]), static_cast<float>(ray[1] / ray[2]));
        const BoardPoint& point = points[picture.points[i]];
        board.emplace_back(static_cast<float>(point.x_mm), static_cast<float>(point.y_mm), 0.0F);
    }
    if (board.size() < 4) return std::nullopt;
    cv::Mat turn;
    cv::Mat shift;
    try {
        if (!cv::solvePnP(board, plane, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, shift, false,
                          cv::SOLVEPNP_IPPE) ||
            !cv::solvePnP(board, plane, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, shift, true,
                          cv::SOLVEPNP_ITERATIVE)) {
            return std::nullopt;
        }
    } catch (const cv::Exception&) {
        return std::nullopt;
    }
    const Vec3 r{turn.at<double>(0), turn.at<double>(1), turn.at<double>(2)};
    const Vec3 t{shift.at<double>(0), shift.at<double>(1), shift.at<double>(2)};
    if (!r.allFinite() || !t.allFinite() || !(t[2] > 1.0)) return std::nullopt;
    return Rigid{rotation_from_vector(r), t};
}

std::vector<std::optional<Rigid>> chain_cameras(const std::vector<std::vector<std::optional<Rigid>>>& poses) {
    std::vector<std::optional<Rigid>> placed(poses.size());
    if (!placed.empty()) placed[0] = Rigid{};
    for (;;) {
        std::size_t from = 0;
        std::size_t to = 0;
        std::vector<Rigid> best;
        for (std::size_t a = 0; a < poses.size(); ++a) {
            for (std::size_t b = 0; b < poses.size(); ++b) {
                if (!placed[a] || placed[b]) continue;
                std::vector<Rigid> shared = between(poses[a], poses[b]);
                if (shared.size() <= best.size()) continue;
                best = std::move(shared);
                from = a;
                to = b;
            }
        }
        if (best.empty()) return placed;
        const Rigid step = middle_of(best);
        placed[to] = Rigid{step.rotation * placed[from]->rotation, step.apply(placed[from]->translation_mm)};
    }
}

}  // namespace rig::host
