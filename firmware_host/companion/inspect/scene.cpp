#include "firmware_host/companion/inspect/scene.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/math.hpp"

namespace rig::host {

namespace {

constexpr double kFrontScale_px = 3.0;    // per mm
constexpr double kFrontMargin_mm = 30.0;  // for expressions, slip and ghosts around the neutral layout
constexpr double kPointDiameter_px = 9.0;

Rigid headset_from_face(const Slip& slip) {
    return {rotation_from_vector(point_at(slip.rotation_rad, 0)), point_at(slip.translation_mm, 0)};
}

// Guesses of markers that the view has no blob for. A tick without a solve has none.
void add_guesses(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
                 const FrameReport& report, std::size_t camera, SceneView& view) {
    if (!report.solved) return;
    const Rigid worn = headset_from_face(state.slip);
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        if (pipeline.matches()[camera][k] >= 0) continue;
        const Projection at = project(pack.cameras[camera], worn.apply(report.face_markers_mm[k]));
        const bool inside = at.z_mm > 0.0 && at.pixel[0] >= 0.0 && at.pixel[1] >= 0.0 &&
                            at.pixel[0] < view.width_px && at.pixel[1] < view.height_px;
        if (!inside) continue;
        view.guesses.push_back(
            {at.pixel[0], at.pixel[1], static_cast<int>(k), pipeline.named_markers().markers[k].seen});
    }
}

}  // namespace

std::vector<SceneView> camera_views(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
                                    const FrameReport& report, const std::vector<std::string>& cameras,
                                    const std::vector<std::filesystem::path>& pictures) {
    std::vector<SceneView> views;
    for (std::size_t c = 0; c < pack.camera_count; ++c) {
        SceneView view;
        view.title = c < cameras.size() ? "camera " + cameras[c] : "camera " + std::to_string(c + 1);
        view.width_px = pack.cameras[c].width_px;
        view.height_px = pack.cameras[c].height_px;
        if (c < pictures.size()) view.picture = pictures[c];
        for (const Observation& seen : pipeline.observations(c)) {
            view.blobs.push_back({static_cast<double>(seen.x_px), static_cast<double>(seen.y_px),
                                  static_cast<double>(seen.diameter_px), -1});
        }
        for (std::size_t k = 0; k < pack.marker_count; ++k) {
            const std::int16_t at = pipeline.matches()[c][k];
            if (at >= 0 && static_cast<std::size_t>(at) < view.blobs.size())
                view.blobs[static_cast<std::size_t>(at)].marker = static_cast<int>(k);
        }
        add_guesses(pack, pipeline, state, report, c, view);
        views.push_back(std::move(view));
    }
    return views;
}

std::vector<SceneView> front_views(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
                                   const FrameReport& report, std::span<const Vec3> positions_mm,
                                   std::span<const std::int16_t> labels) {
    Vec2 low{1e9, 1e9};
    Vec2 high{-1e9, -1e9};
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const Vec2 at{static_cast<double>(pack.neutral_mm[3 * k]),
                      static_cast<double>(pack.neutral_mm[3 * k + 1])};
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
    }
    low.array() -= kFrontMargin_mm;
    high.array() += kFrontMargin_mm;
    SceneView view;
    view.title = "from the front";
    view.width_px = kFrontScale_px * (high[0] - low[0]);
    view.height_px = kFrontScale_px * (high[1] - low[1]);
    const auto place = [&](const Vec3& p) {
        return Vec2{kFrontScale_px * (p[0] - low[0]), kFrontScale_px * (high[1] - p[1])};
    };
    const auto shown = [&](const Vec2& at) {
        return at[0] >= 0.0 && at[1] >= 0.0 && at[0] < view.width_px && at[1] < view.height_px;
    };
    for (std::size_t s = 0; s < positions_mm.size(); ++s) {
        if (!positions_mm[s].allFinite() || !shown(place(positions_mm[s]))) continue;
        const Vec2 at = place(positions_mm[s]);
        view.blobs.push_back({at[0], at[1], kPointDiameter_px, s < labels.size() ? labels[s] : -1});
    }
    const Rigid worn = headset_from_face(state.slip);
    for (std::size_t k = 0; k < pack.marker_count && report.solved; ++k) {
        if (pipeline.named_markers().markers[k].seen) continue;
        const Vec2 at = place(worn.apply(report.face_markers_mm[k]));
        if (shown(at)) view.guesses.push_back({at[0], at[1], static_cast<int>(k), false});
    }
    return {std::move(view)};
}

bool WorstMoments::is_worst(Kind kind, double badness) const {
    return badness > kept_[static_cast<std::size_t>(kind)].badness;
}

void WorstMoments::keep(Kind kind, double badness, std::string reason, std::size_t tick, double time_s,
                        const std::vector<SceneView>& views) {
    Kept& kept = kept_[static_cast<std::size_t>(kind)];
    kept.badness = badness;
    kept.moment = {tick, time_s, {std::move(reason)}, views};
}

std::vector<Moment> WorstMoments::taken(double apart_s) const {
    std::vector<Moment> moments;
    for (const Kept& kept : kept_) {
        if (kept.badness <= 0.0) continue;
        const auto near = std::ranges::find_if(moments, [&](const Moment& other) {
            return std::abs(other.time_s - kept.moment.time_s) <= apart_s;
        });
        if (near == moments.end()) {
            moments.push_back(kept.moment);
        } else if (near->tick == kept.moment.tick) {
            near->reasons.push_back(kept.moment.reasons.front());
        }
    }
    std::ranges::stable_sort(moments, {}, &Moment::tick);
    return moments;
}

}  // namespace rig::host
