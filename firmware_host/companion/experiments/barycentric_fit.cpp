#include "firmware_host/companion/experiments/barycentric_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware_host/companion/rig_folder/surface.hpp"
#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kNeutralFrames = 30;
constexpr double kNoiseMm = 0.1;
constexpr double kTakeScale = 1.06;  // the take's millimetres to one of the rig

Vec3 vector(const Float3& v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// Every marker moved along the skin by `far_mm`, in a direction of its own, and set on the mesh there.
MarkerLayout misplaced(const Rig& rig, const MarkerLayout& layout, double far_mm, WhiteNoise& dice) {
    const std::vector<Double3> normals = vertex_normals(rig);
    MarkerLayout out = layout;
    for (LayoutMarker& marker : out.markers) {
        const Vec3 normal = vector(marker.normal).normalized();
        const Vec3 u = normal.unitOrthogonal();
        const double angle = 2.0 * std::numbers::pi * dice.uniform();
        const Vec3 at =
            vector(marker.neutral_mm) + far_mm * (std::cos(angle) * u + std::sin(angle) * normal.cross(u));
        const SurfacePoint place = nearest_triangles(rig, {at[0], at[1], at[2]}, 1, {0}).front();
        LayoutMarker moved = marker;
        moved.vertices = rig.triangles[place.triangle];
        for (std::size_t c = 0; c < 3; ++c) moved.barycentric[c] = static_cast<float>(place.barycentric[c]);
        if (settle_on_mesh(rig, normals, moved)) marker = moved;
    }
    return out;
}

// Neutral frames, then the performance, as cameras in another frame and scale would have recorded it.
MarkerTake recorded(const Rig& rig, const MarkerLayout& truth, const Take& take,
                    const Similarity& take_from_face, WhiteNoise& dice) {
    const MarkerModel model = marker_model(rig, truth);
    const std::size_t n = rig.shapes.size();
    MarkerTake out{.frame_count = kNeutralFrames + take.frame_count,
                   .marker_count = truth.markers.size(),
                   .rate_hz = take.rate_hz,
                   .positions_mm = {}};
    for (std::size_t f = 0; f < out.frame_count; ++f) {
        for (std::size_t k = 0; k < out.marker_count; ++k) {
            Vec3 p;
            for (std::size_t a = 0; a < 3; ++a) {
                double x = static_cast<double>(model.neutral_mm[3 * k + a]) + kNoiseMm * dice.next();
                for (std::size_t i = 0; i < n && f >= kNeutralFrames; ++i) {
                    x += static_cast<double>(model.basis_mm[(3 * k + a) * n + i]) *
                         static_cast<double>(take.weights[(f - kNeutralFrames) * n + i]);
                }
                p[static_cast<Eigen::Index>(a)] = x;
            }
            out.positions_mm.push_back(take_from_face.apply(p));
        }
    }
    return out;
}

double place_error_mm(const MarkerLayout& found, double scale, const MarkerLayout& truth) {
    double sum = 0.0;
    for (std::size_t k = 0; k < truth.markers.size(); ++k) {
        sum +=
            (vector(found.markers[k].neutral_mm) / scale - vector(truth.markers[k].neutral_mm)).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(truth.markers.size()));
}

}  // namespace

Result<BarycentricFigures, FileError> measure_barycentric(const std::filesystem::path& data,
                                                          const BarycentricCase& which) {
    const auto rig = load_rig(data / "rig");
    if (!rig) return failure(rig.error());
    const auto truth = load_layout(data / "rig", "60", *rig);
    if (!truth) return failure(truth.error());
    const auto take = load_take(data / "takes" / "alex_rom_3_weights60.csv", *rig);
    if (!take) return failure(take.error());
    WhiteNoise dice(which.seed);
    const MarkerLayout rough = misplaced(*rig, *truth, which.misplaced_mm, dice);
    Similarity take_from_face;
    take_from_face.scale = kTakeScale;
    take_from_face.rotation = Eigen::AngleAxisd(0.4, Vec3(0.2, 0.9, -0.3).normalized()).toRotationMatrix();
    take_from_face.translation_mm = Vec3(35.0, -410.0, 620.0);
    const MarkerTake markers = recorded(*rig, *truth, *take, take_from_face, dice);
    FitOptions options;
    options.neutral_end = kNeutralFrames;
    options.stabilised = false;
    options.placement = which.placement;
    const auto fit = fit_layout(*rig, rough, markers, options);
    if (!fit) return failure(fit.error());
    BarycentricFigures out;
    out.given_mm = fit->rounds.front().rms_mm;
    out.fitted_mm = fit->rounds.back().rms_mm;
    out.final_mm = fit->final_rms_mm;
    out.rounds = fit->rounds.size() - 1;
    out.place_given_mm = place_error_mm(rough, 1.0, *truth);
    out.place_fitted_mm = place_error_mm(fit->layout, fit->rig_scale, *truth);
    out.scale_error = fit->rig_scale / kTakeScale - 1.0;
    out.history = fit->rounds;
    return out;
}

}  // namespace rig::host
