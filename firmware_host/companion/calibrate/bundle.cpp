#include "firmware_host/companion/calibrate/bundle.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig::host {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

constexpr int kMostIterations = 100;
constexpr int kRimPoints = 24;      // of a circle, whose centroid is taken
constexpr double kHuber_px = 0.5;   // several times the noise of a measured corner
constexpr double kSettled = 1e-10;  // relative decrease of the cost
constexpr double kTermSigma = 1.0;  // distortion terms are of order 1; only degenerate combinations feel it
constexpr double kTermWeight_px2 = 1e-2;  // so the prior costs as much as one point that is off by 0.1 px
constexpr int kPoseSize = 6;

// The numbers of a lens that are fitted, in order.
std::vector<double*> lens_numbers(CameraModel& camera, LensTerms terms) {
    std::vector<double*> out{&camera.fx_px, &camera.fy_px, &camera.cx_px,
                             &camera.cy_px, &camera.k1,    &camera.k2};
    if (terms == LensTerms::kFisheye) {
        out.insert(out.end(), {&camera.k3, &camera.k4});
        return out;
    }
    out.insert(out.end(), {&camera.p1, &camera.p2, &camera.k3});
    if (terms == LensTerms::kRational) out.insert(out.end(), {&camera.k4, &camera.k5, &camera.k6});
    return out;
}

constexpr int kPlainNumbers = 4;  // focal lengths and centre come first

Vec3 board_point(const BoardPoint& point) {
    return {point.x_mm, point.y_mm, 0.0};
}

Vec2 seen_at(const CameraModel& camera, const Vec3& in_camera_mm) {
    const Projection projection = project_in_camera(camera, in_camera_mm);
    if (projection.z_mm > 1.0) return projection.pixel;
    return Vec2::Constant(std::numeric_limits<double>::quiet_NaN());
}

// Centroid of the area that the picture of a disc covers: of the polygon through its rim.
Vec2 disc_centroid(const CameraModel& camera, const Rigid& camera_from_board, const BoardPoint& centre,
                   double radius_mm) {
    std::array<Vec2, kRimPoints> rim;
    for (int i = 0; i < kRimPoints; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / kRimPoints;
        const Vec3 at{centre.x_mm + radius_mm * std::cos(angle), centre.y_mm + radius_mm * std::sin(angle),
                      0.0};
        rim[static_cast<std::size_t>(i)] = seen_at(camera, camera_from_board.apply(at));
    }
    const Vec2 origin = rim[0];
    double area = 0.0;
    Vec2 sum = Vec2::Zero();
    for (std::size_t i = 0; i < rim.size(); ++i) {
        const Vec2 a = rim[i] - origin;
        const Vec2 b = rim[(i + 1) % rim.size()] - origin;
        const double cross = a[0] * b[1] - a[1] * b[0];
        area += cross;
        sum += cross * (a + b);
    }
    return origin + sum / (3.0 * area);
}

Rigid camera_from_rig(const CameraModel& camera) {
    return {camera.camera_from_headset, -(camera.camera_from_headset * camera.centre_mm)};
}

Rigid joined(const Rigid& c_from_b, const Rigid& b_from_a) {
    return {c_from_b.rotation * b_from_a.rotation, c_from_b.apply(b_from_a.translation_mm)};
}

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
    return m;
}

// Slopes of one observation: its camera's numbers and pose, its view's pose.
struct Slopes {
    Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 18> camera;
    Eigen::Matrix<double, 2, 6> view;
};

class Adjustment {
  public:
    explicit Adjustment(BundleProblem& problem)
        : problem_(problem),
          lens_size_(static_cast<int>(lens_numbers(problem.cameras[0], problem.terms).size())),
          block_(lens_size_ + kPoseSize),
          camera_size_(block_ * static_cast<int>(problem.cameras.size())) {}

    BundleReport run() {
        BundleReport report;
        double damping = 1e-4;
        double cost = cost_of(problem_);
        RIG_CHECK(std::isfinite(cost));
        for (; report.iterations < kMostIterations && damping < 1e12; ++report.iterations) {
            linearise();
            BundleProblem next = problem_;
            double next_cost = std::numeric_limits<double>::infinity();
            if (step(damping, next)) next_cost = cost_of(next);
            if (!(next_cost < cost)) {
                damping *= 10.0;
                // Nothing better within rounding: this is the bottom.
                if (next_cost <= cost * (1.0 + 1e-12)) report.converged = true;
                if (report.converged) break;
                continue;
            }
            const double gain = (cost - next_cost) / cost;
            problem_ = next;
            cost = next_cost;
            damping = std::max(1e-12, 0.1 * damping);
            if (gain < kSettled) {
                report.converged = true;
                break;
            }
        }
        finish(report);
        return report;
    }

  private:
    static double weight_of(double error_px) { return error_px <= kHuber_px ? 1.0 : kHuber_px / error_px; }

    [[nodiscard]] double cost_of(BundleProblem& problem) const {
        double cost = 0.0;
        for (const BundleObservation& each : problem.observations) {
            const double error = (each.seen_px - predicted_pixel(problem, each)).norm();
            cost += error <= kHuber_px ? error * error : kHuber_px * (2.0 * error - kHuber_px);
        }
        for (CameraModel& camera : problem.cameras) {
            const auto numbers = lens_numbers(camera, problem.terms);
            for (std::size_t i = kPlainNumbers; i < numbers.size(); ++i)
                cost += kTermWeight_px2 * *numbers[i] * *numbers[i] / (kTermSigma * kTermSigma);
        }
        return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
    }

    Slopes slopes_of(const BundleObservation& each) {
        CameraModel& camera = problem_.cameras[each.camera];
        const Rigid& view = problem_.rig_from_board[each.view];
        const Vec3 turned = view.rotation * board_point(problem_.points[each.point]);
        const Vec3 in_rig = turned + view.translation_mm;
        const Vec3 in_camera = camera.camera_from_headset * (in_rig - camera.centre_mm);
        const PixelSlope slope = pixel_slope_in_camera(camera, in_camera);
        Slopes out;
        out.camera.resize(2, block_);
        const std::vector<double*> numbers = lens_numbers(camera, problem_.terms);
        for (int i = 0; i < lens_size_; ++i) {
            double& number = *numbers[static_cast<std::size_t>(i)];
            const double kept = number;
            const double pace = i < kPlainNumbers ? 1e-2 : 1e-5;
            number = kept + pace;
            const Vec2 ahead = seen_at(camera, in_camera);
            number = kept - pace;
            out.camera.col(i) = (ahead - seen_at(camera, in_camera)) / (2.0 * pace);
            number = kept;
        }
        out.camera.middleCols<3>(lens_size_) = -slope * cross_matrix(in_camera);
        out.camera.middleCols<3>(lens_size_ + 3) = slope;
        const PixelSlope along_rig = slope * camera.camera_from_headset;
        out.view.leftCols<3>() = -along_rig * cross_matrix(turned);
        out.view.rightCols<3>() = along_rig;
        return out;
    }

    // Normal equations: cameras, views, and what couples them.
    void linearise() {
        const auto views = problem_.rig_from_board.size();
        cameras_ = Matrix::Zero(camera_size_, camera_size_);
        camera_right_ = Vector::Zero(camera_size_);
        views_.assign(views, Mat6::Zero());
        view_right_.assign(views, Vec6::Zero());
        coupling_.assign(views, Matrix::Zero(camera_size_, kPoseSize));
        for (const BundleObservation& each : problem_.observations) {
            const Vec2 error = each.seen_px - predicted_pixel(problem_, each);
            const double weight = weight_of(error.norm());
            const Slopes slopes = slopes_of(each);
            const int at = block_ * static_cast<int>(each.camera);
            const auto transposed = slopes.camera.transpose();
            cameras_.block(at, at, block_, block_) += weight * transposed * slopes.camera;
            camera_right_.segment(at, block_) += weight * transposed * error;
            views_[each.view] += weight * slopes.view.transpose() * slopes.view;
            view_right_[each.view] += weight * slopes.view.transpose() * error;
            coupling_[each.view].middleRows(at, block_) += weight * transposed * slopes.view;
        }
        for (std::size_t c = 0; c < problem_.cameras.size(); ++c) {
            const auto numbers = lens_numbers(problem_.cameras[c], problem_.terms);
            for (int i = kPlainNumbers; i < lens_size_; ++i) {
                const int at = block_ * static_cast<int>(c) + i;
                const double weight = kTermWeight_px2 / (kTermSigma * kTermSigma);
                cameras_(at, at) += weight;
                camera_right_[at] -= weight * *numbers[static_cast<std::size_t>(i)];
            }
        }
        // Camera 0 is the frame.
        for (int i = lens_size_; i < block_; ++i) {
            cameras_.row(i).setZero();
            cameras_.col(i).setZero();
            cameras_(i, i) = 1.0;
            camera_right_[i] = 0.0;
            for (Matrix& coupling : coupling_) coupling.row(i).setZero();
        }
    }

    // Views eliminated. Empty when a view's own block is singular.
    bool reduce(double damping, Matrix& reduced, Vector& right) const {
        reduced = cameras_;
        reduced.diagonal() *= 1.0 + damping;
        right = camera_right_;
        for (std::size_t v = 0; v < views_.size(); ++v) {
            Mat6 own = views_[v];
            own.diagonal() *= 1.0 + damping;
            const Eigen::LDLT<Mat6> factor(own);
            if (factor.info() != Eigen::Success || !factor.isPositive()) return false;
            reduced -= coupling_[v] * factor.solve(coupling_[v].transpose());
            right -= coupling_[v] * factor.solve(view_right_[v]);
        }
        return true;
    }

    bool step(double damping, BundleProblem& next) const {
        Matrix reduced;
        Vector right;
        if (!reduce(damping, reduced, right)) return false;
        const Eigen::LDLT<Matrix> factor(reduced);
        if (factor.info() != Eigen::Success) return false;
        const Vector move = factor.solve(right);
        if (!move.allFinite()) return false;
        for (std::size_t c = 0; c < next.cameras.size(); ++c) {
            CameraModel& camera = next.cameras[c];
            const auto numbers = lens_numbers(camera, next.terms);
            const int at = block_ * static_cast<int>(c);
            for (int i = 0; i < lens_size_; ++i) *numbers[static_cast<std::size_t>(i)] += move[at + i];
            const Vec3 turn = move.segment<3>(at + lens_size_);
            const Vec3 shift = move.segment<3>(at + lens_size_ + 3);
            const Rigid pose = camera_from_rig(camera);
            const Mat3 turned = rotation_from_vector(turn);
            camera.camera_from_headset = orthonormalised(turned * pose.rotation);
            camera.centre_mm =
                -(camera.camera_from_headset.transpose() * (turned * pose.translation_mm + shift));
        }
        for (std::size_t v = 0; v < next.rig_from_board.size(); ++v) {
            Mat6 own = views_[v];
            own.diagonal() *= 1.0 + damping;
            const Vec6 pose = Eigen::LDLT<Mat6>(own).solve(view_right_[v] - coupling_[v].transpose() * move);
            Rigid& view = next.rig_from_board[v];
            view.rotation = orthonormalised(rotation_from_vector(pose.head<3>()) * view.rotation);
            view.translation_mm += pose.tail<3>();
        }
        return true;
    }

    void finish(BundleReport& report) {
        double sum = 0.0;
        for (const BundleObservation& each : problem_.observations) {
            report.residual_px.push_back(each.seen_px - predicted_pixel(problem_, each));
            sum += report.residual_px.back().squaredNorm();
        }
        const auto count = static_cast<double>(problem_.observations.size());
        report.rms_px = std::sqrt(sum / count);
        const double freedom = 2.0 * count - camera_size_ + kPoseSize -
                               kPoseSize * static_cast<double>(problem_.rig_from_board.size());
        report.uncertainty.resize(problem_.cameras.size());
        linearise();
        Matrix reduced;
        Vector right;
        if (freedom < 1.0 || !reduce(0.0, reduced, right)) return;
        const Matrix covariance =
            Eigen::LDLT<Matrix>(reduced).solve(Matrix::Identity(camera_size_, camera_size_)) *
            (sum / freedom);
        for (std::size_t c = 0; c < problem_.cameras.size(); ++c) {
            const int at = block_ * static_cast<int>(c);
            const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, covariance(at + i, at + i))); };
            report.uncertainty[c] = {sigma(0), sigma(1), sigma(2), sigma(3), 0.0};
            if (c > 0) report.uncertainty[c].baseline_mm = baseline_sigma_mm(c, covariance);
        }
    }

    // A shift d of the camera's translation moves its centre by -R^T d; turning it moves nothing.
    [[nodiscard]] double baseline_sigma_mm(std::size_t c, const Matrix& covariance) const {
        const CameraModel& camera = problem_.cameras[c];
        const Vec3 apart = camera.centre_mm - problem_.cameras[0].centre_mm;
        const Vec3 along = camera.camera_from_headset * (apart / apart.norm());
        const int at = block_ * static_cast<int>(c) + lens_size_ + 3;
        const Mat3 shift = covariance.block<3, 3>(at, at);
        return std::sqrt(std::max(0.0, along.dot(shift * along)));
    }

    BundleProblem& problem_;
    int lens_size_;
    int block_;
    int camera_size_;
    Matrix cameras_;
    Vector camera_right_;
    std::vector<Mat6> views_;
    std::vector<Vec6> view_right_;
    std::vector<Matrix> coupling_;
};

}  // namespace

Vec2 predicted_pixel(const BundleProblem& problem, const BundleObservation& each) {
    const CameraModel& camera = problem.cameras[each.camera];
    const Rigid camera_from_board = joined(camera_from_rig(camera), problem.rig_from_board[each.view]);
    const BoardPoint& point = problem.points[each.point];
    if (problem.point_radius_mm > 0.0)
        return disc_centroid(camera, camera_from_board, point, problem.point_radius_mm);
    return seen_at(camera, camera_from_board.apply(board_point(point)));
}

BundleReport adjust(BundleProblem& problem) {
    RIG_CHECK(!problem.cameras.empty() && !problem.observations.empty());
    return Adjustment(problem).run();
}

}  // namespace rig::host
