#include "firmware_host/companion/fit/layout_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "firmware_host/companion/fit/take_moments.hpp"
#include "firmware_host/companion/fit/take_solve.hpp"
#include "firmware_host/companion/fit/vertex_motion.hpp"
#include "firmware_host/companion/rig_folder/rig_checks.hpp"
#include "firmware_host/companion/rig_folder/surface.hpp"
#include "firmware_host/companion/train/train.hpp"

namespace rig::host {

namespace {

using Eigen::MatrixXd;

constexpr std::size_t kLeastFrames = 10;  // that show a marker: fewer say nothing about how it moves
constexpr int kFirstAlignments = 6;       // over the take, of the layout as given
constexpr double kFarOffMm = 20.0;        // a marker lies on the skin; more is a wrong rig, unit or order

Double3 triple(const Vec3& v) {
    return {v[0], v[1], v[2]};
}

Vec3 vector(const Float3& v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// What a round changes.
struct Placed {
    MarkerLayout layout;
    Similarity face_from_take;
    SolvedTake solved;
    std::vector<MarkerMoments> moments;
    std::vector<double> marker_rms_mm;
    double noise_mm = 0.1;  // of one coordinate as the solver should see it: misplacement included
};

struct Fitting {
    const Rig& rig;
    const FitOptions& options;
    MarkerTake take;               // as recorded
    std::vector<Vec3> neutral_mm;  // of each marker in the neutral frames, as recorded
    VertexMotion motion;
    std::vector<Double3> normals;
    std::vector<std::vector<std::uint8_t>> parts;  // of the mesh that each marker may sit on

    Placed now;
};

Result<std::vector<Vec3>, FileError> neutral_positions(const MarkerLayout& layout, const MarkerTake& take,
                                                       const FitOptions& options) {
    if (options.neutral_end > take.frame_count) {
        return failure(FileError{fmt::format("the neutral frames {}:{} are not in the take of {} frames",
                                             options.neutral_begin, options.neutral_end, take.frame_count)});
    }
    std::vector<Vec3> neutral(take.marker_count, Vec3::Zero());
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        double count = 0.0;
        for (std::size_t f = options.neutral_begin; f < options.neutral_end; ++f) {
            if (!take.seen(f, k)) continue;
            neutral[k] += take.at(f, k);
            count += 1.0;
        }
        if (count <= 0.0) {
            return failure(FileError{fmt::format(
                "marker '{}' is not seen in the neutral frames {}:{}; name frames that show all markers with "
                "--neutral BEGIN:END",
                printable(layout.markers[k].name), options.neutral_begin, options.neutral_end)});
        }
        neutral[k] /= count;
    }
    return neutral;
}

Result<Similarity, FileError> align_landmarks(const MarkerLayout& rough, const std::vector<Vec3>& neutral_mm,
                                              const FitOptions& options) {
    SimilarityFit fit;
    for (std::size_t k = 0; k < rough.markers.size(); ++k) {
        const bool wanted =
            options.landmarks.empty() ||
            std::ranges::find(options.landmarks, rough.markers[k].name) != options.landmarks.end();
        if (wanted) fit.add(neutral_mm[k], vector(rough.markers[k].neutral_mm));
    }
    const auto found = fit.solve(options.scaled);
    if (!found) {
        return failure(FileError{
            fmt::format("the {} landmarks do not fix a rotation: at least three are needed, not on one line",
                        fit.count())});
    }
    return *found;
}

Result<void, FileError> check_inputs(const Rig& rig, const MarkerLayout& rough, const MarkerTake& take,
                                     const FitOptions& options) {
    if (const std::string fault = fault_of_options(options); !fault.empty()) return failure(FileError{fault});
    if (const auto ok = check_layout("layout", rough, rig); !ok) return ok;
    if (take.marker_count != rough.markers.size()) {
        return failure(
            FileError{fmt::format("the take has {} markers a frame, the layout {}; they must be the "
                                  "same markers in the same order",
                                  take.marker_count, rough.markers.size())});
    }
    for (const std::string& name : options.landmarks) {
        if (std::ranges::find(rough.markers, name, &LayoutMarker::name) == rough.markers.end())
            return failure(FileError{fmt::format("landmark '{}' is not in the layout", printable(name))});
    }
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        std::size_t seen = 0;
        for (std::size_t f = 0; f < take.frame_count; ++f) seen += take.seen(f, k) ? 1U : 0U;
        if (seen < kLeastFrames) {
            return failure(
                FileError{fmt::format("marker '{}' is seen in {} frames of the take; {} are needed",
                                      printable(rough.markers[k].name), seen, kLeastFrames)});
        }
    }
    return {};
}

// Parts of the triangles around the place as given: a lip's marker stays on the skin, off the teeth.
std::vector<std::uint8_t> parts_around(const Rig& rig, const LayoutMarker& marker) {
    std::vector<std::uint8_t> parts;
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        const bool touches = std::ranges::any_of(rig.triangles[t], [&](std::int32_t v) {
            return std::ranges::find(marker.vertices, v) != marker.vertices.end();
        });
        if (touches && std::ranges::find(parts, rig.triangle_part[t]) == parts.end())
            parts.push_back(rig.triangle_part[t]);
    }
    return parts;
}

MatrixXd motion_of(const Fitting& fitting, const LayoutMarker& marker) {
    MatrixXd motion = static_cast<double>(marker.barycentric[0]) *
                      fitting.motion.at(static_cast<std::size_t>(marker.vertices[0]));
    for (std::size_t c = 1; c < 3; ++c) {
        motion += static_cast<double>(marker.barycentric[c]) *
                  fitting.motion.at(static_cast<std::size_t>(marker.vertices[c]));
    }
    motion.col(0) += vector(marker.offset_mm);
    return motion;
}

// The take in the rig's frame and scale.
MarkerTake aligned(const Fitting& fitting) {
    MarkerTake out = fitting.take;
    for (Vec3& p : out.positions_mm) p = fitting.now.face_from_take.apply(p);
    return out;
}

// Solves the take with the layout as it stands and judges it.
Result<FitRound, FileError> solve_round(Fitting& fitting, const std::function<void(double)>& progress) {
    TrainOptions training;
    training.solver = SolverKind::kBoxQp;
    training.noise_mm = fitting.now.noise_mm;
    training.rate_hz = std::max(1.0, fitting.take.rate_hz);
    training.temporal.mode = TemporalPull::Mode::kOff;  // a pull this noisy would damp the motion
    const auto pack = train(fitting.rig, fitting.now.layout, training);
    if (!pack) return failure(pack.error());
    const MarkerTake in_face = aligned(fitting);
    fitting.now.solved = solve_take(pack->view(), in_face, fitting.options.stabilised, progress);
    fitting.now.moments = take_moments(in_face, fitting.now.solved);
    FitRound round;
    double sum = 0.0;
    double count = 0.0;
    const std::vector<double> before = std::move(fitting.now.marker_rms_mm);
    fitting.now.marker_rms_mm.clear();
    for (std::size_t k = 0; k < fitting.take.marker_count; ++k) {
        const MarkerMoments& moments = fitting.now.moments[k];
        const double mean_square = moments.mean_square_mm2(motion_of(fitting, fitting.now.layout.markers[k]));
        const double rms = std::sqrt(mean_square);
        fitting.now.marker_rms_mm.push_back(rms);
        sum += mean_square * moments.count;
        count += moments.count;
        round.mean_mm += rms / static_cast<double>(fitting.take.marker_count);
        round.worst_mm = std::max(round.worst_mm, rms);
        if (!before.empty()) round.change_mm = std::max(round.change_mm, std::abs(rms - before[k]));
    }
    round.rms_mm = count > 0.0 ? std::sqrt(sum / count) : 0.0;
    fitting.now.noise_mm = std::clamp(round.rms_mm / std::sqrt(3.0), fitting.options.noise_mm, 100.0);
    return round;
}

void put(const Fitting& fitting, std::size_t triangle, const Vec3& b, LayoutMarker& marker) {
    LayoutMarker moved = marker;
    moved.vertices = fitting.rig.triangles[triangle];
    for (std::size_t c = 0; c < 3; ++c)
        moved.barycentric[c] = static_cast<float>(b[static_cast<Eigen::Index>(c)]);
    if (settle_on_mesh(fitting.rig, fitting.normals, moved)) marker = moved;  // a flat triangle is no place
}

// Step 1-2 of the source: the nearest point of the mesh to the marker in the neutral frames.
std::size_t project_markers(Fitting& fitting) {
    std::size_t moved = 0;
    for (std::size_t k = 0; k < fitting.take.marker_count; ++k) {
        LayoutMarker& marker = fitting.now.layout.markers[k];
        const Vec3 at = fitting.now.face_from_take.apply(fitting.neutral_mm[k]);
        const auto nearest = nearest_triangles(fitting.rig, triple(at), 1, fitting.parts[k]);
        if (nearest.empty()) continue;  // a mesh without triangles: the place as given is all there is
        const Int3 before = marker.vertices;
        const Double3& b = nearest.front().barycentric;
        put(fitting, nearest.front().triangle, {b[0], b[1], b[2]}, marker);
        moved += marker.vertices != before ? 1U : 0U;
    }
    return moved;
}

// Step 4-5: among the Q nearest triangles the one with the lowest error over the take.
std::size_t choose_places(Fitting& fitting) {
    std::size_t moved = 0;
    for (std::size_t k = 0; k < fitting.take.marker_count; ++k) {
        LayoutMarker& marker = fitting.now.layout.markers[k];
        const MarkerMoments& moments = fitting.now.moments[k];
        if (moments.count <= 0.0) continue;
        const bool by_take = fitting.options.placement == Placement::kTake;
        // Where the take puts the marker's neutral position, or where the neutral frames saw it.
        const Vec3 at = by_take
                            ? vector(marker.neutral_mm) + moments.mean_error_mm(motion_of(fitting, marker))
                            : fitting.now.face_from_take.apply(fitting.neutral_mm[k]);
        double least = moments.mean_square_mm2(motion_of(fitting, marker));
        const Int3 before = marker.vertices;
        for (const SurfacePoint& near :
             nearest_triangles(fitting.rig, triple(at), fitting.options.candidates, fitting.parts[k])) {
            std::array<MatrixXd, 3> corners;
            for (std::size_t c = 0; c < 3; ++c) {
                corners[c] =
                    fitting.motion.at(static_cast<std::size_t>(fitting.rig.triangles[near.triangle][c]));
            }
            const TriangleQuadratic quadratic = triangle_quadratic(moments, corners);
            const Vec3 b = by_take ? quadratic.best_place()
                                   : Vec3(near.barycentric[0], near.barycentric[1], near.barycentric[2]);
            const double error = quadratic.at(b);
            if (!(error < least)) continue;
            least = error;
            put(fitting, near.triangle, b, marker);
        }
        moved += marker.vertices != before ? 1U : 0U;
    }
    return moved;
}

// The similarity that fits the solved model best over the take: landmarks were only the start.
void align_again(Fitting& fitting) {
    std::vector<MatrixXd> motions;
    for (const LayoutMarker& marker : fitting.now.layout.markers)
        motions.push_back(motion_of(fitting, marker));
    SimilarityFit fit;
    Eigen::VectorXd z(fitting.now.solved.weights.cols() + 1);
    for (std::size_t f = 0; f < fitting.take.frame_count; ++f) {
        if (!fitting.now.solved.solved[f]) continue;
        z[0] = 1.0;
        z.tail(fitting.now.solved.weights.cols()) =
            fitting.now.solved.weights.row(static_cast<Eigen::Index>(f)).transpose();
        for (std::size_t k = 0; k < fitting.take.marker_count; ++k) {
            if (!fitting.take.seen(f, k)) continue;
            const Vec3 x = fitting.now.solved.headset_from_face[f].apply_inverse(
                fitting.now.face_from_take.apply(fitting.take.at(f, k)));
            fit.add(x, motions[k] * z);
        }
    }
    // A change of frame before the slip is a change of frame after another slip, which is found anew.
    if (const auto step = fit.solve(fitting.options.scaled)) {
        fitting.now.face_from_take = compose(*step, fitting.now.face_from_take);
    }
}

Result<void, FileError> check_distance(const Fitting& fitting) {
    for (std::size_t k = 0; k < fitting.now.marker_rms_mm.size(); ++k) {
        if (fitting.now.marker_rms_mm[k] <= kFarOffMm) continue;
        return failure(FileError{
            fmt::format("marker '{}' stays {:.1f} mm from the mesh over the take; check that take "
                        "and layout name the same "
                        "markers in the same order, the neutral frames, and the rig",
                        printable(fitting.now.layout.markers[k].name), fitting.now.marker_rms_mm[k])});
    }
    return {};
}

// Where the round's markers start from: step 1 and 2, then step 4 to 6 of the source.
std::size_t place_markers(Fitting& fitting, std::size_t round) {
    if (round == 0) return 0;
    if (round == 1) return project_markers(fitting);
    const std::size_t moved = choose_places(fitting);
    align_again(fitting);
    return moved;
}

Result<void, FileError> run_rounds(Fitting& fitting, const FitProgress& progress, LayoutFit& out) {
    const FitOptions& options = fitting.options;
    const Similarity landmarks = fitting.now.face_from_take;
    Placed given;
    for (std::size_t r = 0; r <= options.most_rounds && !out.converged; ++r) {
        const auto tell = [&](double share) {
            if (progress)
                progress((static_cast<double>(r) + share) / static_cast<double>(options.most_rounds + 1),
                         fmt::format("round {}", r));
        };
        tell(0.0);
        const std::size_t moved = place_markers(fitting, r);
        // The layout as given at its best, should the neutral frames turn out not to be neutral: landmarks in
        // an expression align badly, the whole take does not mind.
        const int solves = r == 0 ? 1 + kFirstAlignments : 1;
        auto round = solve_round(fitting, [&](double share) { tell(share / solves); });
        for (int again = 1; again < solves && round; ++again) {
            align_again(fitting);
            round = solve_round(fitting, [&](double share) { tell((again + share) / solves); });
        }
        if (!round) return failure(round.error());
        round->moved = moved;
        if (r == 0) round->change_mm = 0.0;
        out.rounds.push_back(*round);
        if (r == 0) {
            given = fitting.now;
            fitting.now.face_from_take = landmarks;  // the projection trusts the neutral frames
            for (const double rms_mm : given.marker_rms_mm) out.markers.push_back({.given_mm = rms_mm});
        }
        // Neutral frames that are not neutral put every marker where the expression had it.
        out.projection_refused = out.projection_refused || (r == 1 && round->rms_mm > out.rounds[0].rms_mm);
        if (r == 1 && out.projection_refused) fitting.now = std::move(given);
        out.converged = r > 1 && round->change_mm < options.threshold_mm;
    }
    return {};
}

// The offsets, the scale of the rig and what is told of each marker.
Result<void, FileError> finish(Fitting& fitting, const MarkerLayout& rough, LayoutFit& out) {
    const double scale = 1.0 / fitting.now.face_from_take.scale;
    for (std::size_t k = 0; k < fitting.now.layout.markers.size(); ++k) {
        LayoutMarker& marker = fitting.now.layout.markers[k];
        FittedMarker& told = out.markers[k];
        told.rms_mm = fitting.now.marker_rms_mm[k];
        told.walked_mm = (vector(marker.neutral_mm) - vector(rough.markers[k].neutral_mm)).norm();
        told.frames = static_cast<std::size_t>(fitting.now.moments[k].count);
        const Vec3 offset = fitting.now.moments[k].mean_error_mm(motion_of(fitting, marker));
        for (std::size_t a = 0; a < 3; ++a)
            marker.offset_mm[a] = static_cast<float>(offset[static_cast<Eigen::Index>(a)]);
    }
    const auto last = solve_round(fitting, {});
    if (!last) return failure(last.error());
    out.final_rms_mm = last->rms_mm;
    out.layout = fitting.now.layout;
    out.rig_scale = scale;
    out.face_from_take = fitting.now.face_from_take;
    for (LayoutMarker& marker : out.layout.markers) {
        for (std::size_t a = 0; a < 3; ++a) {
            marker.neutral_mm[a] = static_cast<float>(static_cast<double>(marker.neutral_mm[a]) * scale);
            marker.offset_mm[a] = static_cast<float>(static_cast<double>(marker.offset_mm[a]) * scale);
        }
    }
    return {};
}

}  // namespace

std::string fault_of_options(const FitOptions& options) {
    if (options.neutral_begin >= options.neutral_end) return "the neutral frames are empty";
    if (options.candidates < 1 || options.candidates > kMostTriangles)
        return fmt::format("the triangles looked at for each marker are 1 to {}", kMostTriangles);
    if (options.most_rounds < 1 || options.most_rounds > 100) return "the rounds are 1 to 100";
    if (!(options.threshold_mm >= 0.0 && options.threshold_mm <= 100.0))
        return "the threshold is outside 0 to 100 mm";
    if (!(options.noise_mm >= 1e-4 && options.noise_mm <= 100.0))
        return "the marker noise is outside 0.0001 to 100 mm";
    if (!options.landmarks.empty() && options.landmarks.size() < 3)
        return "at least three landmarks are needed, or none for all markers";
    return {};
}

Result<LayoutFit, FileError> fit_layout(const Rig& rig, const MarkerLayout& rough, const MarkerTake& take,
                                        const FitOptions& options, const FitProgress& progress) {
    if (const auto ok = check_inputs(rig, rough, take, options); !ok) return failure(ok.error());
    auto neutral = neutral_positions(rough, take, options);
    if (!neutral) return failure(neutral.error());
    const auto landmarks = align_landmarks(rough, *neutral, options);
    if (!landmarks) return failure(landmarks.error());
    Fitting fitting{.rig = rig,
                    .options = options,
                    .take = thinned(take, kMostFitFrames),
                    .neutral_mm = std::move(*neutral),
                    .motion = VertexMotion(rig),
                    .normals = vertex_normals(rig),
                    .parts = {},
                    .now = {.layout = rough,
                            .face_from_take = *landmarks,
                            .solved = {},
                            .moments = {},
                            .marker_rms_mm = {},
                            .noise_mm = options.noise_mm}};
    for (LayoutMarker& marker : fitting.now.layout.markers) {
        marker.offset_mm = {};
        fitting.parts.push_back(parts_around(rig, marker));
    }
    LayoutFit out;
    if (const auto ok = run_rounds(fitting, progress, out); !ok) return failure(ok.error());
    if (const auto ok = check_distance(fitting); !ok) return failure(ok.error());
    if (const auto ok = finish(fitting, rough, out); !ok) return failure(ok.error());
    return out;
}

Rig scaled_rig(const Rig& rig, double scale) {
    Rig out = rig;
    const auto multiply = [&](Float3& v) {
        for (float& x : v) x = static_cast<float>(static_cast<double>(x) * scale);
    };
    for (Float3& v : out.vertices_mm) multiply(v);
    for (SparseShape& shape : out.shapes) {
        for (Float3& v : shape.delta_mm) multiply(v);
    }
    return out;
}

}  // namespace rig::host
