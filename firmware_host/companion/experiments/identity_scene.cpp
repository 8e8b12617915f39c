#include "firmware_host/companion/experiments/identity_scene.hpp"

#include <cmath>

#include "core/base/math.hpp"

namespace rig::host {

namespace {

// A dot seen flatter than this is not found (issue's own bound for detection is 0.35).
constexpr double kLeastCosine = 0.25;
constexpr std::size_t kRunUpFrames = 30;  // a dropout mask hides nothing in its first frame

CameraModel model_of(const HelmetCamera& camera) {
    CameraModel model;
    model.width_px = camera.width_px;
    model.height_px = camera.height_px;
    model.fx_px = camera.f_px;
    model.fy_px = camera.f_px;
    model.cx_px = camera.cx_px;
    model.cy_px = camera.cy_px;
    model.k1 = camera.k1;
    model.k2 = camera.k2;
    for (Eigen::Index row = 0; row < 3; ++row) {
        for (Eigen::Index column = 0; column < 3; ++column)
            model.camera_from_headset(row, column) =
                camera.rotation[static_cast<std::size_t>(3 * row + column)];
        model.centre_mm[row] = camera.centre_mm[static_cast<std::size_t>(row)];
    }
    return model;
}

// Order of the sightings says nothing about their names.
template <class T>
void shuffle(std::vector<T>& sightings, std::vector<int>& truth, WhiteNoise& random) {
    for (std::size_t i = sightings.size(); i > 1; --i) {
        const auto j = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
        std::swap(sightings[i - 1], sightings[j]);
        std::swap(truth[i - 1], truth[j]);
    }
}

double between(double low, double high, WhiteNoise& random) {
    return low + (high - low) * random.uniform();
}

}  // namespace

Result<std::unique_ptr<IdentityScene>, FileError> load_identity_scene(const std::filesystem::path& data) {
    auto scene = std::make_unique<IdentityScene>();
    auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    scene->head = std::move(*head);
    scene->helmet = default_helmet(2);
    TrainOptions options;
    for (const HelmetCamera& camera : scene->helmet) options.cameras.push_back(model_of(camera));
    auto pack = train(scene->head.rig, scene->head.layout, options);
    if (!pack) return failure(pack.error());
    scene->pack = std::move(*pack);
    scene->view = scene->pack.view();
    return scene;
}

Rigid random_pose(double rotation_rad, double translation_mm, WhiteNoise& random) {
    Vec3 axis{random.next(), random.next(), random.next()};
    axis /= std::max(axis.norm(), 1e-9);
    Rigid pose;
    pose.rotation = rotation_from_vector(Vec3{between(-rotation_rad, rotation_rad, random) * axis});
    for (Eigen::Index i = 0; i < 3; ++i)
        pose.translation_mm[i] = between(-translation_mm, translation_mm, random);
    return pose;
}

std::vector<Vec3> face_markers(const MarkerModel& model, const Take& take, std::size_t frame) {
    const std::vector<float> x = marker_frame(model, take, frame, 0.0, 0);
    std::vector<Vec3> out;
    for (std::size_t k = 0; k < x.size(); k += 3)
        out.emplace_back(static_cast<double>(x[k]), static_cast<double>(x[k + 1]),
                         static_cast<double>(x[k + 2]));
    return out;
}

std::size_t nearest_neighbour(const MarkerLayout& layout, std::size_t marker) {
    const Vec3 from = point_at(layout.markers[marker].neutral_mm, 0);
    std::size_t nearest = marker == 0 ? 1 : 0;
    for (std::size_t k = 0; k < layout.markers.size(); ++k) {
        if (k == marker) continue;
        const double gap = (point_at(layout.markers[k].neutral_mm, 0) - from).norm();
        if (gap < (point_at(layout.markers[nearest].neutral_mm, 0) - from).norm()) nearest = k;
    }
    return nearest;
}

SightingSource::SightingSource(const IdentityScene& scene, const SightingOptions& options, std::size_t frames,
                               std::uint64_t seed)
    : scene_(scene), options_(options), random_(seed) {
    const std::size_t views = options.cameras ? scene.helmet.size() : 1;
    for (std::size_t v = 0; v < views; ++v)
        masks_.push_back(
            burst_dropout(scene.head.layout, frames + kRunUpFrames, options.dropout, 16 * seed + v));
}

std::size_t SightingSource::ghost_count() {
    std::size_t count = 0;
    for (double left = options_.ghosts_per_frame; left > 0.0; left -= 1.0)
        count += random_.uniform() < left ? 1U : 0U;
    return count;
}

void SightingSource::add_frame(std::size_t at, const Take& take, std::size_t take_frame, const Rigid& pose,
                               IdentityRun& run) {
    std::vector<Vec3> markers = face_markers(scene_.head.model, take, take_frame);
    for (Vec3& marker : markers) marker = pose.apply(marker);
    run.begin_frame();
    if (!options_.cameras) {
        add_cloud(at, markers, run);
        return;
    }
    for (std::size_t c = 0; c < scene_.helmet.size(); ++c) add_camera(at, c, markers, pose, run);
}

void SightingSource::add_cloud(std::size_t at, std::span<const Vec3> markers_mm, IdentityRun& run) {
    std::vector<Vec3> points;
    std::vector<int> truth;
    for (std::size_t k = 0; k < markers_mm.size(); ++k) {
        if (masks_[0].at(at + kRunUpFrames, k)) continue;
        points.push_back(markers_mm[k] +
                         options_.noise_mm * Vec3{random_.next(), random_.next(), random_.next()});
        truth.push_back(static_cast<int>(k));
    }
    // Where the ghosts of unlabelled.npy are: within 15 mm of the box around the face.
    for (std::size_t g = ghost_count(); g > 0; --g) {
        points.emplace_back(between(-86.0, 86.0, random_), between(-128.0, 82.0, random_),
                            between(-44.0, 82.0, random_));
        truth.push_back(-1);
    }
    shuffle(points, truth, random_);
    run.add_points(points, truth);
}

void SightingSource::add_camera(std::size_t at, std::size_t camera, std::span<const Vec3> markers_mm,
                                const Rigid& pose, IdentityRun& run) {
    const HelmetCamera& seen_by = scene_.helmet[camera];
    const Vec3 centre{seen_by.centre_mm[0], seen_by.centre_mm[1], seen_by.centre_mm[2]};
    std::vector<Observation> observations;
    std::vector<int> truth;
    const auto inside = [&](double x, double y) {
        return x > 2.0 && y > 2.0 && x < seen_by.width_px - 3.0 && y < seen_by.height_px - 3.0;
    };
    for (std::size_t k = 0; k < markers_mm.size(); ++k) {
        const Vec3& x = markers_mm[k];
        const Vec3 outward = pose.rotation * point_at(scene_.head.layout.markers[k].normal, 0);
        const Vec3 towards = centre - x;
        if (towards.dot(outward) < kLeastCosine * towards.norm()) continue;
        const PixelAt pixel = see(seen_by, {x[0], x[1], x[2]});
        const double x_px = pixel.x_px + options_.noise_px * random_.next();
        const double y_px = pixel.y_px + options_.noise_px * random_.next();
        if (masks_[camera].at(at + kRunUpFrames, k) || !inside(x_px, y_px)) continue;
        observations.push_back({static_cast<float>(x_px), static_cast<float>(y_px), 10.0F, 0.5F, 1.0F});
        truth.push_back(static_cast<int>(k));
    }
    for (std::size_t g = ghost_count(); g > 0; --g) {
        observations.push_back({static_cast<float>(between(3.0, seen_by.width_px - 4.0, random_)),
                                static_cast<float>(between(3.0, seen_by.height_px - 4.0, random_)), 10.0F,
                                0.5F, 1.0F});
        truth.push_back(-1);
    }
    shuffle(observations, truth, random_);
    run.add_view(camera, observations, truth);
}

}  // namespace rig::host
