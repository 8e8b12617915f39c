#include "firmware_host/companion/calibrate/headset_frame.hpp"

#include <Eigen/LU>
#include <cmath>
#include <optional>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "firmware_host/companion/fit/similarity.hpp"

namespace rig::host {

namespace {

constexpr double kAxisMm = 100.0;
const Vec3 kAimMm{0.0, -33.0, 20.0};  // between nose and lips, as the simulated helmet aims

void move_rig(std::vector<CameraModel>& cameras, const Mat3& turn, const Vec3& shift_mm) {
    for (CameraModel& camera : cameras) {
        camera.camera_from_headset = orthonormalised(camera.camera_from_headset * turn.transpose());
        camera.centre_mm = (turn * camera.centre_mm + shift_mm).eval();
    }
}

// Centre and the ends of the three axes.
std::vector<Vec3> marks_of(std::span<const CameraModel> cameras) {
    std::vector<Vec3> marks;
    for (const CameraModel& camera : cameras) {
        marks.push_back(camera.centre_mm);
        for (int axis = 0; axis < 3; ++axis)
            marks.push_back(camera.centre_mm + kAxisMm * camera.camera_from_headset.row(axis).transpose());
    }
    return marks;
}

}  // namespace

double align_to_reference(std::vector<CameraModel>& cameras, std::span<const CameraModel> reference) {
    RIG_CHECK(cameras.size() == reference.size() && !cameras.empty());
    const std::vector<Vec3> from = marks_of(cameras);
    const std::vector<Vec3> to = marks_of(reference);
    SimilarityFit fit;
    for (std::size_t i = 0; i < from.size(); ++i) fit.add(from[i], to[i]);
    const std::optional<Similarity> motion = fit.solve(/*scaled=*/false);
    RIG_CHECK(motion);  // a camera's three axes lie on no line
    move_rig(cameras, motion->rotation, motion->translation_mm);
    double sum = 0.0;
    for (std::size_t c = 0; c < cameras.size(); ++c)
        sum += (cameras[c].centre_mm - reference[c].centre_mm).squaredNorm();
    return std::sqrt(sum / static_cast<double>(cameras.size()));
}

void place_before_face(std::vector<CameraModel>& cameras, double distance_mm) {
    Vec3 forward = Vec3::Zero();
    Vec3 down = Vec3::Zero();
    for (const CameraModel& camera : cameras) {
        forward += camera.camera_from_headset.row(2).transpose();
        down += camera.camera_from_headset.row(1).transpose();
    }
    forward.normalize();
    down = (down - down.dot(forward) * forward).normalized();
    // Where the optical axes meet; a weak pull to the given distance decides what they leave open.
    constexpr double kPull = 1e-3;
    Mat3 system = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (const CameraModel& camera : cameras) {
        const Vec3 axis = camera.camera_from_headset.row(2).transpose();
        const Mat3 across = Mat3::Identity() - axis * axis.transpose();
        system += across + kPull * Mat3::Identity();
        right += across * camera.centre_mm + kPull * (camera.centre_mm + distance_mm * axis);
    }
    const Vec3 meet = system.inverse() * right;
    Mat3 turn;  // headset from rig: x to the performer's left is the cameras' right
    turn.row(0) = down.cross(forward).transpose();
    turn.row(1) = -down.transpose();
    turn.row(2) = -forward.transpose();
    move_rig(cameras, turn, kAimMm - turn * meet);
}

}  // namespace rig::host
