#include "tests/support/board_scene/board_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/base/math.hpp"

namespace rig::test {

namespace {

constexpr int kSamples = 4;  // a pixel and axis
constexpr double kMarginMm = 6.0;
constexpr double kInk = 28.0;
constexpr double kPaper = 205.0;
constexpr double kBehind = 70.0;  // what is behind the board

struct Plane {
    double x;
    double y;
};

// The picture plane in units of the focal length, of a ray with the slopes x, y.
Plane bent(const CameraModel& c, const Plane& p) {
    const double r2 = p.x * p.x + p.y * p.y;
    if (c.lens == LensModel::kFisheye) {
        const double r = std::sqrt(r2);
        if (r < 1e-12) return p;
        const double t = std::atan(r);
        const double t2 = t * t;
        const double bent_radius =
            t + c.k1 * t * t2 + c.k2 * t * t2 * t2 + c.k3 * t * t2 * t2 * t2 + c.k4 * t * t2 * t2 * t2 * t2;
        return {p.x * bent_radius / r, p.y * bent_radius / r};
    }
    const double over = 1.0 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
    const double under = 1.0 + c.k4 * r2 + c.k5 * r2 * r2 + c.k6 * r2 * r2 * r2;
    return {p.x * over / under + 2.0 * c.p1 * p.x * p.y + c.p2 * (r2 + 2.0 * p.x * p.x),
            p.y * over / under + c.p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * c.p2 * p.x * p.y};
}

// The ray of a place in the picture plane, from the one of its neighbour, by Newton with numeric slopes.
Plane straightened(const CameraModel& camera, const Plane& target, Plane p) {
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 30; ++i) {
        const Plane at = bent(camera, p);
        const double ex = at.x - target.x;
        const double ey = at.y - target.y;
        if (std::abs(ex) + std::abs(ey) < 1e-11) break;
        const Plane dx = bent(camera, {p.x + kStep, p.y});
        const Plane dy = bent(camera, {p.x, p.y + kStep});
        const double a = (dx.x - at.x) / kStep;
        const double b = (dy.x - at.x) / kStep;
        const double c = (dx.y - at.y) / kStep;
        const double d = (dy.y - at.y) / kStep;
        const double determinant = a * d - b * c;
        p.x -= (d * ex - b * ey) / determinant;
        p.y -= (a * ey - c * ex) / determinant;
    }
    return p;
}

// At which squares and markers are whole pixels.
double resolution_of(const host::BoardSpec& board) {
    return std::ceil(20.0 * board.spacing_mm / 10.0) * 10.0 / board.spacing_mm;
}

}  // namespace

BoardScene::BoardScene(const host::BoardSpec& board, const CameraModel& camera)
    : board_(board), camera_(camera), px_per_mm_(resolution_of(board)) {
    print_ = host::draw_board(board, px_per_mm_, std::round(kMarginMm * px_per_mm_) / px_per_mm_);
    const std::size_t count = static_cast<std::size_t>(camera.width_px) *
                              static_cast<std::size_t>(camera.height_px) * kSamples * kSamples;
    slope_x_.reserve(count);
    slope_y_.reserve(count);
    for (int y = 0; y < camera.height_px * kSamples; ++y) {
        Plane ray{0.0, 0.0};
        for (int x = 0; x < camera.width_px * kSamples; ++x) {
            const double px = (x + 0.5) / kSamples - 0.5;
            const double py = (y + 0.5) / kSamples - 0.5;
            const Plane target{(px - camera.cx_px) / camera.fx_px, (py - camera.cy_px) / camera.fy_px};
            ray = straightened(camera, target, x == 0 ? target : ray);
            slope_x_.push_back(static_cast<float>(ray.x));
            slope_y_.push_back(static_cast<float>(ray.y));
        }
    }
}

// Between the four nearest printed pixels.
double BoardScene::paper_at(double x_mm, double y_mm) const {
    const double margin = std::round(kMarginMm * px_per_mm_);
    const double x = px_per_mm_ * x_mm + margin - 0.5;
    const double y = px_per_mm_ * y_mm + margin - 0.5;
    if (!(x >= 0.0 && y >= 0.0 && x < print_.width_px - 1 && y < print_.height_px - 1)) return -1.0;
    const auto column = static_cast<std::size_t>(x);
    const auto row = static_cast<std::size_t>(y);
    const auto stride = static_cast<std::size_t>(print_.width_px);
    const std::uint8_t* at = print_.pixels.data() + row * stride + column;
    const double fx = x - static_cast<double>(column);
    const double fy = y - static_cast<double>(row);
    return ((1 - fx) * at[0] + fx * at[1]) * (1 - fy) + ((1 - fx) * at[stride] + fx * at[stride + 1]) * fy;
}

host::GreyImage BoardScene::draw(const Rigid& rig_from_board, const BoardLook& look,
                                 SeededRandom& random) const {
    // The board's plane seen from the camera: a point of it is o + u x + v y.
    const Mat3 turn = camera_.camera_from_headset * rig_from_board.rotation;
    const Vec3 o = camera_.camera_from_headset * (rig_from_board.translation_mm - camera_.centre_mm);
    const Vec3 normal = turn.col(2);
    cv::Mat light(camera_.height_px, camera_.width_px, CV_32F, cv::Scalar(0));
    const auto sampled = [&](int x, int y) {
        const auto sample =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width_px * kSamples) +
            static_cast<std::size_t>(x);
        const Vec3 ray{static_cast<double>(slope_x_[sample]), static_cast<double>(slope_y_[sample]), 1.0};
        const double depth = normal.dot(o) / normal.dot(ray);
        if (!(depth > 0.0)) return -1.0;
        const Vec3 at = depth * ray - o;
        return paper_at(turn.col(0).dot(at), turn.col(1).dot(at));
    };
    for (int y = 0; y < camera_.height_px; ++y) {
        for (int x = 0; x < camera_.width_px; ++x) {
            double sum = 0.0;
            for (int i = 0; i < kSamples * kSamples; ++i) {
                const double value = sampled(x * kSamples + i % kSamples, y * kSamples + i / kSamples);
                sum += value < 0.0 ? kBehind : kInk + (kPaper - kInk) * value / 255.0;
                // A corner of the pixel beside the paper and one beside that: the margin is white, no edge is
                // lost.
                if (i == 0 && value < 0.0 && sampled((x + 1) * kSamples - 1, (y + 1) * kSamples - 1) < 0.0) {
                    sum = kBehind * kSamples * kSamples;
                    break;
                }
            }
            light.at<float>(y, x) = static_cast<float>(sum / (kSamples * kSamples));
        }
    }
    if (look.blur_px > 0.0) cv::GaussianBlur(light, light, {0, 0}, look.blur_px, look.blur_px);
    if (look.smear_px > 0.0) cv::GaussianBlur(light, light, {0, 1}, look.smear_px, 0.0);
    host::GreyImage image{camera_.width_px, camera_.height_px, {}};
    for (int y = 0; y < camera_.height_px; ++y) {
        for (int x = 0; x < camera_.width_px; ++x) {
            const double shade = 1.0 - look.uneven * 0.5 *
                                           (static_cast<double>(x) / camera_.width_px +
                                            static_cast<double>(y) / camera_.height_px);
            const double dn =
                shade * static_cast<double>(light.at<float>(y, x)) + random.normal(0.0, look.noise_dn);
            image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::round(dn), 0.0, 255.0)));
        }
    }
    return image;
}

std::vector<CameraModel> board_rig(LensModel lens, std::size_t camera_count) {
    const std::array<Vec3, 4> centres{Vec3{-45.0, -48.0, 228.0}, Vec3{45.0, -48.0, 228.0},
                                      Vec3{0.0, -100.0, 228.0}, Vec3{0.0, 30.0, 228.0}};
    const Vec3 aim{0.0, -33.0, 20.0};
    std::vector<CameraModel> cameras;
    for (std::size_t c = 0; c < camera_count; ++c) {
        const auto nth = static_cast<double>(c);
        CameraModel camera;
        camera.width_px = 480;
        camera.height_px = 640;
        camera.cx_px = 239.5 + 3.0 * nth - 4.0;
        camera.cy_px = 319.5 - 2.5 * nth + 3.0;
        camera.lens = lens;
        if (lens == LensModel::kFisheye) {
            camera.fx_px = 430.0 + 4.0 * nth;
            camera.fy_px = camera.fx_px + 0.7;
            camera.k1 = -0.02 - 0.003 * nth;
            camera.k2 = 0.008;
            camera.k3 = -0.003;
            camera.k4 = 0.0005;
        } else {
            camera.fx_px = 598.4 + 1.7 * nth;
            camera.fy_px = camera.fx_px - 0.9;
            camera.k1 = -0.11 - 0.02 * nth;
            camera.k2 = 0.018;
            camera.k3 = 0.004;
            camera.k4 = 0.05;
            camera.k5 = 0.02;
            camera.k6 = -0.005;
            camera.p1 = 6e-4;
            camera.p2 = -4e-4;
        }
        camera.centre_mm = camera_count == 1 ? Vec3{0.0, -48.0, 232.0} : centres[c];
        const Vec3 forward = (aim - camera.centre_mm).normalized();
        const Vec3 down = (Vec3{0.0, -1.0, 0.0} + forward[1] * forward).normalized();
        camera.camera_from_headset.row(0) = down.cross(forward).transpose();
        camera.camera_from_headset.row(1) = down.transpose();
        camera.camera_from_headset.row(2) = forward.transpose();
        cameras.push_back(camera);
    }
    return cameras;
}

std::vector<Rigid> waved_board(const host::BoardSpec& board, std::size_t count, double tilt_rad,
                               SeededRandom& random) {
    // Facing the cameras, which look along -z of the headset: the paper's y points down, its z away from
    // them.
    Mat3 facing;
    facing << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    const Vec3 middle{0.5 * host::board_width_mm(board), 0.5 * host::board_height_mm(board), 0.0};
    std::vector<Rigid> poses;
    for (std::size_t i = 0; i < count; ++i) {
        const double towards = random.uniform(0.0, 6.283185307179586);
        const double tilt = tilt_rad * std::sqrt(random.uniform(0.1, 1.0));
        const Mat3 tilted =
            rotation_from_vector(Vec3{tilt * std::cos(towards), tilt * std::sin(towards), 0.0});
        const Mat3 rolled = rotation_from_vector(Vec3{0.0, 0.0, random.uniform(-0.5, 0.5)});
        const Mat3 rotation = facing * rolled * tilted;
        const Vec3 centre{random.uniform(-38.0, 38.0), -33.0 + random.uniform(-60.0, 60.0),
                          20.0 + random.uniform(-30.0, 40.0)};
        poses.push_back({rotation, centre - rotation * middle});
    }
    return poses;
}

}  // namespace rig::test
