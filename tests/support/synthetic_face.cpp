#include "tests/support/synthetic_face.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/math.hpp"

namespace rig::test {

namespace {

constexpr double kHalfWidthMm = 70.0;
constexpr double kHalfHeightMm = 95.0;
constexpr double kHalfDepthMm = 85.0;
const Vec3 kCentreMm{0.0, -30.0, -65.0};

float number(double x) {
    return static_cast<float>(x);
}

Vec3 point_on_face(double u, double v) {  // u, v in [-1, 1]: left to right and bottom to top of the front
    const double x = 0.9 * u;
    const double y = 0.9 * v * std::sqrt(1.0 - 0.45 * u * u);
    const double z = std::sqrt(std::max(0.05, 1.0 - x * x - y * y));
    return {x, y, z};
}

}  // namespace

std::unique_ptr<ShapeModel> shape_model_of(const SolvePack& pack) {
    auto model = std::make_unique<ShapeModel>();
    const auto workspace = std::make_unique<ShapeModelWorkspace>();
    build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma, *workspace, *model);
    return model;
}

SyntheticFace::SyntheticFace(const SyntheticFaceOptions& options) : options_(options) {
    SeededRandom random(options.seed);
    place_markers(random);
    make_shapes(random);
    make_cameras();
    const std::size_t n = options_.shape_count;
    low_.assign(n, 0.0F);
    high_.assign(n, 1.0F);
    mean_.assign(n, 0.1F);
    sigma_.assign(n, 0.3F);
    gamma_.assign(n, number(options_.temporal_gamma_mm2));
    for (std::size_t i = 0; i < n; ++i) {
        names_.push_back("shape" + std::to_string(i));
        curves_.push_back({random.uniform(0.15, 0.9), random.uniform(0.0, 6.28), random.uniform(0.6, 1.0)});
    }
}

// The farthest of many random candidates each time: evenly spread but not regular, as a layout of dots is.
void SyntheticFace::place_markers(SeededRandom& random) {
    constexpr int kCandidates = 40;
    for (std::size_t k = 0; k < options_.marker_count; ++k) {
        Vec3 best = Vec3::Zero();
        double best_gap = -1.0;
        for (int c = 0; c < kCandidates; ++c) {
            const Vec3 unit = point_on_face(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
            double gap = 1e9;
            for (const Vec3& other : outward_) gap = std::min(gap, (unit - other).norm());
            if (gap > best_gap) {
                best_gap = gap;
                best = unit;
            }
        }
        outward_.push_back(best);
    }
    for (Vec3& unit : outward_) {
        const Vec3 at =
            kCentreMm + Vec3{kHalfWidthMm * unit[0], kHalfHeightMm * unit[1], kHalfDepthMm * unit[2]};
        unit = Vec3{unit[0] / kHalfWidthMm, unit[1] / kHalfHeightMm, unit[2] / kHalfDepthMm}.normalized();
        for (Eigen::Index axis = 0; axis < 3; ++axis) neutral_mm_.push_back(number(at[axis]));
    }
    for (std::size_t k = 0; k < options_.marker_count; ++k) {
        neutral_.emplace_back(static_cast<double>(neutral_mm_[3 * k]),
                              static_cast<double>(neutral_mm_[3 * k + 1]),
                              static_cast<double>(neutral_mm_[3 * k + 2]));
    }
}

void SyntheticFace::make_shapes(SeededRandom& random) {
    const std::size_t m = options_.marker_count;
    const std::size_t n = options_.shape_count;
    const std::size_t special =
        options_.duplicate_columns + options_.zero_columns + options_.dependent_columns;
    basis_mm_.assign(3 * m * n, 0.0F);
    for (std::size_t i = 0; i < n - special; ++i) {
        const Vec3 centre = neutral_[random.below(m)];
        const double radius_mm = random.uniform(14.0, 34.0);
        Vec3 direction{random.normal(0.0, 1.0), random.normal(0.0, 1.0), 0.6 * random.normal(0.0, 1.0)};
        direction *= random.uniform(3.0, 11.0) / direction.norm();
        for (std::size_t k = 0; k < m; ++k) {
            const double d2 = (neutral_[k] - centre).squaredNorm();
            const double share = std::exp(-0.5 * d2 / (radius_mm * radius_mm));
            if (share < 0.02) continue;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                basis_mm_[(3 * k + axis) * n + i] =
                    number(share * direction[static_cast<Eigen::Index>(axis)]);
            }
        }
    }
    for (std::size_t s = 0; s < options_.duplicate_columns + options_.dependent_columns; ++s) {
        const std::size_t i = n - special + s;
        const std::size_t from = 2 * s % (n - special);
        const std::size_t other = (2 * s + 1) % (n - special);
        for (std::size_t r = 0; r < 3 * m; ++r) {
            basis_mm_[r * n + i] = basis_mm_[r * n + from];
            if (s >= options_.duplicate_columns) basis_mm_[r * n + i] += basis_mm_[r * n + other];
        }
    }
}

void SyntheticFace::make_cameras() {
    const std::array<Vec3, kMaxCameras> centres{Vec3{-70.0, -45.0, 200.0}, Vec3{70.0, -45.0, 200.0},
                                                Vec3{-25.0, -120.0, 180.0}, Vec3{25.0, 60.0, 190.0}};
    for (std::size_t c = 0; c < options_.camera_count; ++c) {
        CameraModel& camera = cameras_[c];
        camera.width_px = 640;
        camera.height_px = 480;
        camera.fx_px = 430.0 + 3.0 * static_cast<double>(c);
        camera.fy_px = 431.0 + 3.0 * static_cast<double>(c);
        camera.cx_px = 318.0;
        camera.cy_px = 242.0;
        camera.k1 = -0.18;
        camera.k2 = 0.05;
        camera.p1 = 0.0007;
        camera.p2 = -0.0011;
        camera.k3 = -0.004;
        camera.centre_mm = options_.camera_count == 1 ? Vec3{0.0, -40.0, 210.0} : centres[c];
        const Vec3 forward = (Vec3{0.0, -30.0, 0.0} - camera.centre_mm).normalized();
        const Vec3 right = forward.cross(Vec3{0.0, 1.0, 0.0}).normalized();
        const Vec3 down = forward.cross(right);
        camera.camera_from_headset.row(0) = right.transpose();
        camera.camera_from_headset.row(1) = down.transpose();
        camera.camera_from_headset.row(2) = forward.transpose();
    }
}

SolvePack SyntheticFace::pack() const {
    SolvePack pack;
    pack.marker_count = static_cast<std::uint16_t>(options_.marker_count);
    pack.shape_count = static_cast<std::uint16_t>(options_.shape_count);
    pack.solver = options_.solver;
    pack.neutral_mm = neutral_mm_;
    pack.basis_mm = basis_mm_;
    pack.weight_low = low_;
    pack.weight_high = high_;
    pack.prior_mean = mean_;
    pack.prior_sigma = sigma_;
    pack.temporal_gamma = gamma_;
    pack.noise_mm = number(options_.noise_mm);
    pack.ridge_mm2 = number(options_.ridge_mm2);
    pack.camera_count = static_cast<std::uint8_t>(options_.camera_count);
    pack.cameras = cameras_;
    for (std::size_t i = 0; i < names_.size(); ++i) pack.shape_names[i] = names_[i];
    return pack;
}

std::vector<double> SyntheticFace::weights_at(double time_s) const {
    std::vector<double> weights;
    for (const auto& [frequency_hz, phase_rad, height] : curves_) {
        const double wave = std::sin(2.0 * std::numbers::pi * frequency_hz * time_s + phase_rad);
        weights.push_back(wave > 0.0 ? height * wave * wave : 0.0);
    }
    return weights;
}

std::vector<double> SyntheticFace::random_weights(SeededRandom& random) const {
    std::vector<double> weights;
    for (std::size_t i = 0; i < shape_count(); ++i)
        weights.push_back(std::clamp(random.normal(0.1, 0.3), 0.0, 1.0));
    return weights;
}

std::vector<Vec3> SyntheticFace::positions(std::span<const double> weights) const {
    std::vector<Vec3> result = neutral_;
    for (std::size_t k = 0; k < marker_count(); ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double sum = 0.0;
            for (std::size_t i = 0; i < shape_count(); ++i) {
                sum += static_cast<double>(basis_mm_[(3 * k + axis) * shape_count() + i]) * weights[i];
            }
            result[k][static_cast<Eigen::Index>(axis)] += sum;
        }
    }
    return result;
}

double SyntheticFace::marker_rms(std::span<const double> a, std::span<const double> b) const {
    const std::vector<Vec3> at_a = positions(a);
    const std::vector<Vec3> at_b = positions(b);
    double sum = 0.0;
    for (std::size_t k = 0; k < at_a.size(); ++k) sum += (at_a[k] - at_b[k]).squaredNorm();
    return std::sqrt(sum / (3.0 * static_cast<double>(at_a.size())));
}

double SyntheticFace::column_length(std::size_t shape) const {
    double sum = 0.0;
    for (std::size_t r = 0; r < 3 * marker_count(); ++r) {
        const auto b = static_cast<double>(basis_mm_[r * shape_count() + shape]);
        sum += b * b;
    }
    return std::sqrt(sum);
}

SyntheticFace::View SyntheticFace::observe(std::size_t camera, std::span<const Vec3> headset_mm,
                                           double sigma_px, double hide_probability, int false_dots,
                                           SeededRandom& random) const {
    constexpr double kGrazing = 0.2;  // cosine below which a dot on the skin is not seen
    const CameraModel& model = cameras_[camera];
    std::vector<std::pair<Observation, int>> seen;
    const auto add = [&seen](double x, double y, int marker) {
        seen.push_back({Observation{number(x), number(y), 8.0F, 0.5F, 0.9F}, marker});
    };
    for (std::size_t k = 0; k < headset_mm.size(); ++k) {
        const Vec3 to_camera = (model.centre_mm - headset_mm[k]).normalized();
        if (to_camera.dot(outward_[k]) < kGrazing || random.chance(hide_probability)) continue;
        const ReferencePixel p = reference_project(model, headset_mm[k]);
        const double x = static_cast<double>(p.x_px) + random.normal(0.0, sigma_px);
        const double y = static_cast<double>(p.y_px) + random.normal(0.0, sigma_px);
        if (x < 0.0 || y < 0.0 || x > model.width_px - 1.0 || y > model.height_px - 1.0) continue;
        add(x, y, static_cast<int>(k));
    }
    for (int i = 0; i < false_dots; ++i) add(random.uniform(0.0, 639.0), random.uniform(0.0, 479.0), -1);
    random.shuffle(std::span<std::pair<Observation, int>>(seen));
    View view;
    for (const auto& [observation, marker] : seen) {
        view.observations.push_back(observation);
        view.marker.push_back(marker);
    }
    return view;
}

Rigid creeping_slip(double time_s) {
    const double t = 2.0 * std::numbers::pi * time_s;
    Vec3 turn{0.02 * std::sin(0.05 * t), 0.015 * std::sin(0.08 * t + 1.0), 0.012 * std::sin(0.06 * t + 2.0)};
    Vec3 shift{1.5 * std::sin(0.07 * t), 2.0 * std::sin(0.05 * t + 0.5), 1.0 * std::sin(0.09 * t + 1.5)};
    if (time_s >= 2.0) shift += Vec3{1.5, -2.0, 0.8};  // two jolts that stay
    if (time_s >= 3.5) turn += Vec3{-0.015, 0.01, 0.02};
    return {rotation_from_vector(turn), shift};
}

Rigid random_slip(SeededRandom& random, double rotation_rad, double translation_mm) {
    const auto draw = [&random](double reach) {
        return Vec3{random.uniform(-reach, reach), random.uniform(-reach, reach),
                    random.uniform(-reach, reach)};
    };
    const Vec3 turn = draw(rotation_rad);
    return {rotation_from_vector(turn), draw(translation_mm)};
}

std::vector<Vec3> moved(const Rigid& pose, std::span<const Vec3> points) {
    std::vector<Vec3> result;
    for (const Vec3& point : points) result.push_back(pose.apply(point));
    return result;
}

void add_noise(std::span<Vec3> points, double sigma_mm, SeededRandom& random) {
    for (Vec3& point : points) {
        for (Eigen::Index axis = 0; axis < 3; ++axis) point[axis] += random.normal(0.0, sigma_mm);
    }
}

ReferencePixel reference_project(const CameraModel& camera, const Vec3& headset_point_mm) {
    std::array<long double, 3> in{};
    for (Eigen::Index r = 0; r < 3; ++r) {
        for (Eigen::Index c = 0; c < 3; ++c) {
            in[static_cast<std::size_t>(r)] += static_cast<long double>(camera.camera_from_headset(r, c)) *
                                               (static_cast<long double>(headset_point_mm[c]) -
                                                static_cast<long double>(camera.centre_mm[c]));
        }
    }
    const auto pixel = [&](long double xd, long double yd) {
        return ReferencePixel{
            static_cast<long double>(camera.fx_px) * xd + static_cast<long double>(camera.cx_px),
            static_cast<long double>(camera.fy_px) * yd + static_cast<long double>(camera.cy_px), in[2]};
    };
    const long double x = in[0] / in[2];
    const long double y = in[1] / in[2];
    const auto k = [](double value) { return static_cast<long double>(value); };
    if (camera.lens == LensModel::kFisheye) {
        const long double r = std::sqrt(x * x + y * y);
        const long double t = std::atan(r);
        const long double t2 = t * t;
        const long double bent = t * (1.0L + k(camera.k1) * t2 + k(camera.k2) * t2 * t2 +
                                      k(camera.k3) * t2 * t2 * t2 + k(camera.k4) * t2 * t2 * t2 * t2);
        return r > 0.0L ? pixel(bent * x / r, bent * y / r) : pixel(0.0L, 0.0L);
    }
    const long double r2 = x * x + y * y;
    const long double radial =
        (1.0L + k(camera.k1) * r2 + k(camera.k2) * r2 * r2 + k(camera.k3) * r2 * r2 * r2) /
        (1.0L + k(camera.k4) * r2 + k(camera.k5) * r2 * r2 + k(camera.k6) * r2 * r2 * r2);
    const long double p1 = k(camera.p1);
    const long double p2 = k(camera.p2);
    return pixel(x * radial + 2.0L * p1 * x * y + p2 * (r2 + 2.0L * x * x),
                 y * radial + p1 * (r2 + 2.0L * y * y) + 2.0L * p2 * x * y);
}

}  // namespace rig::test
