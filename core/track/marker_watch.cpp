#include "core/track/marker_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/bounded_vector.hpp"
#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr double kSamePlaceMm = 1.0;        // of a sighting from frame to frame
constexpr double kAstrayLearning = 0.05;    // per frame
constexpr int kAtRest = 3;                  // times as long as usual, beside a face that does not move
constexpr double kBorderPx = 8.0;           // a dot nearer to the picture's border is cut off
constexpr double kDepthInformation = 1e-3;  // 1/mm^2 of the expected place, along a single ray
constexpr std::uint16_t kMostTicks = 60000;
constexpr std::size_t kSeenNeighbours = 3;  // of kNeighbours

using MarkerSightings = BoundedVector<Sighting, kMaxCameras>;

std::uint16_t ticks_of(double seconds, double rate_hz) {
    return static_cast<std::uint16_t>(std::clamp(seconds * rate_hz, 1.0, static_cast<double>(kMostTicks)));
}

std::uint16_t one_more(std::uint16_t ticks) {
    return ticks < kMostTicks ? static_cast<std::uint16_t>(ticks + 1) : ticks;
}

bool is_inside_picture(const CameraModel& camera, const Vec3& at_mm) {
    const Projection seen = project(camera, at_mm);
    return seen.z_mm > 0.0 && seen.pixel[0] >= kBorderPx && seen.pixel[1] >= kBorderPx &&
           seen.pixel[0] <= camera.width_px - 1 - kBorderPx &&
           seen.pixel[1] <= camera.height_px - 1 - kBorderPx;
}

// In the picture of a camera that sees anything; a cloud has no border.
bool is_in_a_picture(const WatchedFrame& frame, std::size_t k) {
    if (!frame.sightings.from_cameras) return true;
    for (std::size_t view = 0; view < frame.sightings.view_count; ++view) {
        if (!frame.sightings.views[view].empty() &&
            is_inside_picture(frame.sightings.cameras[view], frame.expected_mm[k]))
            return true;
    }
    return false;
}

bool faces_a_view(const Topology& topology, double least_cosine, const WatchedFrame& frame, std::size_t k) {
    if (!frame.sightings.from_cameras) return true;
    const Vec3 normal = frame.fit.pose.rotation * topology.normal[k];
    for (std::size_t view = 0; view < frame.sightings.view_count; ++view) {
        if (frame.sightings.views[view].empty()) continue;
        const CameraModel& camera = frame.sightings.cameras[view];
        const Vec3 to_camera = camera.centre_mm - frame.expected_mm[k];
        const double along = normal.dot(to_camera);
        const double squared = to_camera.dot(to_camera);
        if (along > 0.0 && along * along >= least_cosine * least_cosine * squared &&
            is_inside_picture(camera, frame.expected_mm[k]))
            return true;
    }
    return false;
}

bool has_seen_neighbours(const Topology& topology, const WatchedFrame& frame, std::size_t k) {
    std::size_t seen = 0;
    for (const std::uint16_t neighbour : topology.nearest[k])
        seen += frame.named.markers[neighbour].seen ? 1U : 0U;
    return seen >= kSeenNeighbours;
}

struct AstraySighting {
    Triangulation point;
    bool depth_measured = false;  // by two views, or a cloud
};

// What stands near an unseen marker's place without a name, in every view; false: nothing.
bool find_astray(double reach_mm, const WatchedFrame& frame, std::size_t k, AstraySighting& astray) {
    MarkerSightings mine;
    for (std::size_t view = 0; view < frame.sightings.view_count; ++view) {
        const ViewSightings& seen = frame.sightings.views[view];
        double nearest = reach_mm * reach_mm;
        std::size_t at = seen.size();
        for (const std::uint16_t j : frame.left_over[view]) {
            const double d2 = seen[j].squared_distance_mm2(frame.expected_mm[k]);
            if (d2 >= nearest) continue;
            nearest = d2;
            at = j;
        }
        if (at == seen.size()) continue;
        const bool kept = mine.push_back(seen[at]);
        RIG_CHECK(kept);
    }
    if (mine.empty()) return false;
    astray.point = triangulate(mine.span(), frame.expected_mm[k], kDepthInformation);
    astray.depth_measured = mine.size() > 1 || !frame.sightings.from_cameras;
    return astray.point.gap_mm <= kSamePlaceMm;
}

// Whether a sighting that has kept its place beside a marker is the marker: it moves with the face. Of one
// ray a face at rest says nothing: motion along it would not show.
bool is_marker_astray(const MarkerWatchConfig& config, bool depth_measured, std::size_t k,
                      const MarkerWatchState& state) {
    const std::uint16_t enough = ticks_of(config.astray_s, config.rate_hz);
    if (state.astray_ticks[k] < enough) return false;
    if (state.astray_steps_mm2[k] >= config.astray_steps_mm2) return true;
    return depth_measured && state.astray_ticks[k] >= kAtRest * enough &&
           state.astray_steps_mm2[k] > -config.astray_steps_mm2;
}

// A marker that should be seen and is not may be the sighting beside its place that has no name.
void watch_astray(const MarkerWatchConfig& config, const WatchedFrame& frame,
                  std::span<const Vec3> neutral_offset_mm, std::size_t k, std::span<Vec3> bias_mm,
                  MarkerWatchState& state) {
    AstraySighting astray;
    std::uint16_t& ticks = state.astray_ticks[k];
    if (!find_astray(config.astray_mm, frame, k, astray)) {
        if (ticks > 0) --ticks;
        return;
    }
    const Vec3& position_mm = astray.point.position_mm;
    const Vec3 off_mm = frame.fit.pose.rotation.transpose() * (position_mm - frame.expected_mm[k]);
    const Vec3 step_mm = off_mm - state.astray_mm[k];
    if (ticks == 0 || step_mm.squaredNorm() > kSamePlaceMm * kSamePlaceMm) {
        state.astray_mm[k] = off_mm;
        state.astray_place_mm[k] = position_mm;
        state.astray_steps_mm2[k] = 0.0;
        ticks = 1;
        return;
    }
    const Vec3 moved_mm = position_mm - state.astray_place_mm[k];
    // The depth of a single ray is that of the expected place, and so moves with the face.
    const double moved = measured_length_mm(astray.point.information, moved_mm);
    const double step = measured_length_mm(astray.point.information, frame.fit.pose.rotation * step_mm);
    state.astray_steps_mm2[k] += moved * moved - step * step;
    state.astray_mm[k] += kAstrayLearning * step_mm;
    state.astray_place_mm[k] += kAstrayLearning * moved_mm;
    ticks = one_more(ticks);
    if (!is_marker_astray(config, astray.depth_measured, k, state)) return;
    ticks = 0;
    const Vec3 bias = bias_mm[k] + frame.fit.pose.rotation * state.astray_mm[k];
    if (off_its_place_mm(frame.fit.pose, neutral_offset_mm, bias, k) <= config.astray_mm) bias_mm[k] = bias;
}

void watch_unseen(const Topology& topology, const MarkerWatchConfig& config, const WatchedFrame& frame,
                  std::span<const Vec3> neutral_offset_mm, std::size_t k, std::span<Vec3> bias_mm,
                  MarkerWatchState& state) {
    if (!has_seen_neighbours(topology, frame, k) || !is_in_a_picture(frame, k)) {
        if (state.astray_ticks[k] > 0) --state.astray_ticks[k];
        return;
    }
    // A marker turned away from every camera may be hidden for long; one that is seen beside its place is
    // not.
    if (faces_a_view(topology, config.facing_cosine, frame, k)) {
        state.absent_ticks[k] = one_more(state.absent_ticks[k]);
        if (state.absent_ticks[k] >= ticks_of(config.fallen_s, config.rate_hz))
            state.trouble[k] = MarkerTrouble::kFallen;
    }
    watch_astray(config, frame, neutral_offset_mm, k, bias_mm, state);
}

bool is_new_expression(const ShapeModel& model, const MarkerWatchConfig& config, const ShapeFit& fit,
                       MarkerWatchState& state) {
    double squared = 0.0;
    for (std::size_t j = 0; j < model.mode_count; ++j) {
        const double moved = fit.coefficients[j] - state.last_expression[j];
        squared += moved * moved;
    }
    if (squared < config.new_expression * config.new_expression) return false;
    state.last_expression = fit.coefficients;
    return true;
}

// An expression for or against a seen marker that stands off.
void count_off(bool stands_off, const MarkerWatchConfig& config, std::size_t k, MarkerWatchState& state) {
    std::uint8_t& count = state.off_count[k];
    if (stands_off) {
        if (count < config.slid_expressions) ++count;
        if (count == config.slid_expressions) state.trouble[k] = MarkerTrouble::kSlid;
    } else if (count > 0 && --count == 0 && state.trouble[k] == MarkerTrouble::kSlid) {
        state.trouble[k] = MarkerTrouble::kNone;
    }
}

// Every seen marker, in an expression that counts. Those known to have slid do not hide others: the face does
// not bend after them any more.
void count_all_off(const ShapeModel& model, const MarkerWatchConfig& config, const WatchedFrame& frame,
                   std::span<const Vec3> neutral_offset_mm, std::span<const Vec3> bias_mm,
                   MarkerWatchState& state) {
    std::array<double, kMaxMarkers> off_mm{};
    std::size_t farthest = model.marker_count;
    double most_mm = 0.0;
    double next_mm = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!frame.named.markers[k].seen) continue;
        off_mm[k] = off_its_place_mm(frame.fit.pose, neutral_offset_mm, bias_mm[k], k);
        if (state.trouble[k] == MarkerTrouble::kSlid) continue;
        if (off_mm[k] > most_mm) {
            next_mm = most_mm;
            most_mm = off_mm[k];
            farthest = k;
        } else {
            next_mm = std::max(next_mm, off_mm[k]);
        }
    }
    const bool stands_out = most_mm > config.slid_alone_mm && most_mm >= config.alone_ratio * next_mm;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!frame.named.markers[k].seen) continue;
        // A flag that the lesser limit raised is not cleared by the greater one while the marker still stands
        // out; where many stand off, as right after a neutral of dots glued aside, it is.
        const bool still_out = state.trouble[k] == MarkerTrouble::kSlid && off_mm[k] > config.slid_alone_mm &&
                               off_mm[k] >= config.alone_ratio * most_mm;
        const bool off = off_mm[k] > config.slid_mm || still_out || (k == farthest && stands_out);
        count_off(off, config, k, state);
    }
}

}  // namespace

double off_its_place_mm(const Rigid& headset_from_face, std::span<const Vec3> neutral_offset_mm,
                        const Vec3& bias_mm, std::size_t marker) {
    Vec3 off = bias_mm;
    if (!neutral_offset_mm.empty()) off -= headset_from_face.rotation * neutral_offset_mm[marker];
    return std::sqrt(off.dot(off));
}

void watch_markers(const ShapeModel& model, const Topology& topology, const MarkerWatchConfig& config,
                   const WatchedFrame& frame, std::span<const Vec3> neutral_offset_mm,
                   std::span<Vec3> bias_mm, MarkerWatchState& state) {
    RIG_CHECK(frame.expected_mm.size() == model.marker_count && bias_mm.size() == model.marker_count);
    if (model.marker_count <= kNeighbours) return;
    const bool counts = is_new_expression(model, config, frame.fit, state);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!frame.named.markers[k].seen) {
            watch_unseen(topology, config, frame, neutral_offset_mm, k, bias_mm, state);
            continue;
        }
        state.absent_ticks[k] = 0;
        state.astray_ticks[k] = 0;
        if (state.trouble[k] == MarkerTrouble::kFallen) state.trouble[k] = MarkerTrouble::kNone;
    }
    if (counts) count_all_off(model, config, frame, neutral_offset_mm, bias_mm, state);
}

}  // namespace rig
