#include "tests/unit/firmware_host/companion/fit/fit_scene.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "firmware_host/companion/rig_folder/surface.hpp"

namespace rig::test {

namespace {

using host::Float3;

Vec3 vector(const Float3& v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

void put(const host::Rig& rig, std::size_t triangle, const Vec3& b, host::LayoutMarker& marker) {
    marker.vertices = rig.triangles[triangle];
    for (std::size_t c = 0; c < 3; ++c)
        marker.barycentric[c] = static_cast<float>(b[static_cast<Eigen::Index>(c)]);
    static_cast<void>(host::settle_on_mesh(rig, host::vertex_normals(rig), marker));
}

void misplace(const FitSceneOptions& options, SeededRandom& random, FitScene& scene) {
    const host::Rig& rig = scene.tiny.rig;
    scene.rough = scene.tiny.layout;
    for (host::LayoutMarker& marker : scene.rough.markers) {
        const Vec3 u = vector(marker.normal).normalized().unitOrthogonal();
        const Vec3 v = vector(marker.normal).normalized().cross(u);
        const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
        const Vec3 at =
            vector(marker.neutral_mm) + options.misplaced_mm * (std::cos(angle) * u + std::sin(angle) * v);
        const host::SurfacePoint near = host::nearest_surface_point(rig, {at[0], at[1], at[2]});
        put(rig, near.triangle, {near.barycentric[0], near.barycentric[1], near.barycentric[2]}, marker);
    }
}

Rigid slip_at(const FitSceneOptions& options, std::size_t frame) {
    Rigid slip;
    const double phase = 0.02 * static_cast<double>(frame);
    slip.translation_mm =
        options.slip_mm * Vec3(std::sin(phase), std::cos(0.7 * phase) - 1.0, 0.5 * std::sin(1.3 * phase));
    slip.rotation =
        Eigen::AngleAxisd(0.01 * options.slip_mm * std::sin(phase), Vec3::UnitY()).toRotationMatrix();
    return slip;
}

void record(const FitSceneOptions& options, SeededRandom& random, FitScene& scene) {
    const host::MarkerModel model = host::marker_model(scene.tiny.rig, scene.tiny.layout);
    host::MarkerTake& take = scene.take;
    take.frame_count = options.neutral + options.frames;
    take.marker_count = options.markers;
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        const bool neutral = f < options.neutral;
        for (std::size_t k = 0; k < take.marker_count; ++k) {
            Vec3 p;
            for (std::size_t a = 0; a < 3; ++a) {
                const std::size_t row = 3 * k + a;
                double x = static_cast<double>(model.neutral_mm[row]) + random.normal(0.0, options.noise_mm);
                for (std::size_t i = 0; i < options.shapes && !neutral; ++i) {
                    x += static_cast<double>(model.basis_mm[row * options.shapes + i]) *
                         static_cast<double>(
                             scene.tiny.take.weights[(f - options.neutral) * options.shapes + i]);
                }
                p[static_cast<Eigen::Index>(a)] = x;
            }
            const bool hidden = !neutral && random.chance(options.hidden_share);
            const Vec3 seen = options.take_from_face.apply(slip_at(options, f).apply(p));
            take.positions_mm.push_back(hidden ? Vec3::Constant(std::numeric_limits<double>::quiet_NaN())
                                               : seen);
        }
    }
}

}  // namespace

FitScene fit_scene(const FitSceneOptions& options) {
    FitScene scene{tiny_rig(options.markers, options.shapes, options.frames), {}, {}};
    SeededRandom random(options.seed);
    for (host::LayoutMarker& marker : scene.tiny.layout.markers) {
        Vec3 b(random.uniform(0.1, 1.0), random.uniform(0.1, 1.0), random.uniform(0.1, 1.0));
        b /= b.sum();
        put(scene.tiny.rig, random.below(scene.tiny.rig.triangles.size()), b, marker);
    }
    misplace(options, random, scene);
    record(options, random, scene);
    return scene;
}

double layout_distance_mm(const host::MarkerLayout& a, const host::MarkerLayout& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.markers.size(); ++k)
        sum += (vector(a.markers[k].neutral_mm) - vector(b.markers[k].neutral_mm)).squaredNorm();
    return std::sqrt(sum / static_cast<double>(a.markers.size()));
}

}  // namespace rig::test
