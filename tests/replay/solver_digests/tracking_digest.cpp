#include "tests/replay/solver_digests/tracking_digest.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "core/base/math.hpp"
#include "core/infer/inference.hpp"
#include "core/stabilise/similarity_2d.hpp"
#include "core/stabilise/stabiliser.hpp"
#include "core/track/tracker.hpp"
#include "tests/support/random.hpp"

namespace rig {

namespace {

constexpr std::size_t kMarkers = 40;
constexpr std::size_t kShapes = 25;

void add(test::Digest& digest, const Vec3& v) {
    for (int i = 0; i < 3; ++i) digest.add(v[i]);
}

// Markers over half an ellipsoid, shapes that move their neighbourhood; drawn, so that no libm is asked.
struct RandomFace {
    explicit RandomFace(test::SeededRandom& random) {
        std::vector<float> neutral;
        std::vector<float> basis;
        for (std::size_t k = 0; k < kMarkers; ++k) {
            const double x = random.uniform(-60.0, 60.0);
            const double y = random.uniform(-80.0, 60.0);
            neutral_mm.push_back(Vec3{x, y, 60.0 - 0.008 * x * x - 0.004 * y * y});
        }
        std::vector<std::size_t> centres;
        for (std::size_t i = 0; i < kShapes; ++i) centres.push_back(random.below(kMarkers));
        for (const Vec3& at : neutral_mm) {
            for (int a = 0; a < 3; ++a) {
                neutral.push_back(static_cast<float>(at[a]));
                for (std::size_t i = 0; i < kShapes; ++i) {
                    const double gap2 = (at - neutral_mm[centres[i]]).squaredNorm();
                    basis.push_back(static_cast<float>(random.uniform(1.0, 8.0) / (1.0 + gap2 / 400.0)));
                }
            }
        }
        const std::vector<float> mean(kShapes, 0.1F);
        const std::vector<float> sigma(kShapes, 0.3F);
        auto scratch = std::make_unique<ShapeModelWorkspace>();
        build_shape_model(neutral, basis, mean, sigma, *scratch, *model);
        SolvePack pack;
        pack.marker_count = kMarkers;
        pack.noise_mm = 0.1F;
        auto gaussian_scratch = std::make_unique<FaceGaussianWorkspace>();
        build_face_gaussian(pack, *model, *gaussian_scratch, *gaussian);
    }

    std::vector<Vec3> neutral_mm;
    std::unique_ptr<ShapeModel> model = std::make_unique<ShapeModel>();
    std::unique_ptr<FaceGaussian> gaussian = std::make_unique<FaceGaussian>();
};

CameraModel camera_at(const Vec3& centre_mm) {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 430.0;
    camera.cx_px = 320.0;
    camera.cy_px = 240.0;
    camera.centre_mm = centre_mm;
    camera.camera_from_headset << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    return camera;
}

struct Stream {
    TrackerState tracker;
    TrackerWorkspace tracker_workspace;
    StabiliserState stabiliser;
    StabiliserWorkspace stabiliser_workspace;
    SightingSet sightings;
    NamedMarkers named;
    TrackerReport tracked;
    StabiliserOutput output;
    StabiliserReport stabilised;
    InferenceWorkspace inference;
    InferenceOutput completed;

    void step(const RandomFace& face, test::Digest& digest) {
        TrackerConfig config;
        config.bootstrap.accept_explained = 0.5;
        config.bootstrap.accept_residual_mm = 3.0;
        track(*face.model, config, sightings, tracker, tracker_workspace, named, tracked);
        stabilise(*face.model, {}, named, stabiliser, stabiliser_workspace, output, stabilised);
        digest.add(static_cast<double>(tracked.seen));
        digest.add(static_cast<double>(stabilised.doubted));
        digest.add(tracked.residual_mm);
        for (std::size_t k = 0; k < kMarkers; ++k) {
            digest.add(static_cast<double>(tracked.matches[0][k]));
            add(digest, output.markers[k].position_mm);
        }
        add(digest, output.headset_from_face.translation_mm);
        for (int i = 0; i < 9; ++i) digest.add(output.headset_from_face.rotation(i / 3, i % 3));
        for (std::size_t j = 0; j < face.model->mode_count; ++j) digest.add(output.fit.coefficients[j]);
        if (output.count == kMarkers) add_completed(face, digest);
    }

  private:
    void add_completed(const RandomFace& face, test::Digest& digest) {
        infer_missing(*face.gaussian, output, inference, completed);
        for (std::size_t k = 0; k < kMarkers; ++k) {
            add(digest, completed.position_mm[k]);
            digest.add(static_cast<double>(completed.deviation_mm[k]));
        }
    }
};

// What a marker does: the mean face, modes that swing, a creeping helmet, and now and then a stray.
std::vector<Vec3> seen_at(const RandomFace& face, int frame, test::SeededRandom& random) {
    std::array<double, kMaxModes> coefficients{};
    for (std::size_t j = 0; j < face.model->mode_count; ++j) {
        coefficients[j] = sin_cos(0.05 * frame * (1.0 + 0.1 * static_cast<double>(j))).sin;
    }
    const Rigid pose{rotation_from_vector(Vec3{0.0004 * frame, -0.0003 * frame, 0.0002 * frame}),
                     Vec3{0.02 * frame, frame > 60 ? 1.5 : 0.0, 0.01 * frame}};
    std::vector<Vec3> seen;
    for (std::size_t k = 0; k < kMarkers; ++k) {
        Vec3 at = pose.apply(face.model->face_position(k, coefficients));
        for (int a = 0; a < 3; ++a) at[a] += random.normal(0.0, 0.1);
        if (random.chance(0.01)) at[0] += 2.2;
        seen.push_back(at);
    }
    return seen;
}

void add_streams(test::Digest& digest) {
    test::SeededRandom random(21);
    const RandomFace face(random);
    const std::array<CameraModel, 2> cameras{camera_at({-70.0, -40.0, 220.0}),
                                             camera_at({70.0, -40.0, 220.0})};
    auto points = std::make_unique<Stream>();
    auto rays = std::make_unique<Stream>();
    for (int frame = 0; frame < 120; ++frame) {
        std::vector<Vec3> seen = seen_at(face, frame, random);
        rays->sightings.clear();
        for (const CameraModel& camera : cameras) {
            std::vector<Observation> observations;
            for (const Vec3& at : seen) {
                if (random.chance(0.05)) continue;
                const Vec2 pixel = project(camera, at).pixel;
                observations.push_back({static_cast<float>(pixel[0]), static_cast<float>(pixel[1])});
            }
            add_camera_view(camera, observations, 0.15, 220.0, rays->sightings);
        }
        rays->step(face, digest);
        random.shuffle(std::span<Vec3>(seen));
        seen.resize(kMarkers - random.below(6));
        points->sightings.clear();
        add_point_view(seen, 0.1, points->sightings);
        points->step(face, digest);
    }
}

void add_similarities(test::Digest& digest) {
    test::SeededRandom random(22);
    for (int round = 0; round < 100; ++round) {
        std::vector<PlanarMarker> markers;
        for (int k = 0; k < 30; ++k) {
            const Vec2 at{random.uniform(100.0, 500.0), random.uniform(100.0, 400.0)};
            const Vec2 off{random.normal(0.0, 0.3), random.chance(0.2) ? random.uniform(-80.0, 80.0) : 0.0};
            markers.push_back({at, Vec2{0.9 * at[0] - 0.2 * at[1], 0.2 * at[0] + 0.9 * at[1]} + off, 1.0});
        }
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(markers, {}, report);
        for (const double v : {fit.a, fit.b, fit.shift[0], fit.shift[1], fit.turn_rad(), report.spread})
            digest.add(v);
    }
}

}  // namespace

void add_tracking(test::Digest& digest) {
    add_streams(digest);
    add_similarities(digest);
}

}  // namespace rig
