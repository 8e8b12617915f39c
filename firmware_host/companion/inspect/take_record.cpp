#include "firmware_host/companion/inspect/take_record.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rig::host {

namespace {

constexpr float kUnmeasured = std::numeric_limits<float>::quiet_NaN();

double length(const std::array<float, 3>& v) {
    return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

Vec3 solved_place(const SolvePack& pack, const FaceState& state, std::size_t marker) {
    Vec3 place = Vec3::Zero();
    const std::size_t n = pack.shape_count;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t row = 3 * marker + axis;
        double sum = static_cast<double>(pack.neutral_mm[row]);
        for (std::size_t i = 0; i < n; ++i) {
            sum += static_cast<double>(pack.basis_mm[row * n + i]) * static_cast<double>(state.weights[i]);
        }
        place[static_cast<Eigen::Index>(axis)] = sum;
    }
    return place;
}

Sighting sighting_of(bool solved, bool seen, float confidence) {
    if (!solved) return Sighting::kLost;
    if (seen) return Sighting::kVisible;
    return confidence >= kLeastInferredConfidence ? Sighting::kInferred : Sighting::kLost;
}

// Names given out in this tick, over all views.
std::size_t names_given(const SolvePack& pack, const Pipeline& pipeline) {
    std::size_t given = 0;
    for (const auto& view : pipeline.matches()) {
        given += static_cast<std::size_t>(std::count_if(view.begin(), view.begin() + pack.marker_count,
                                                        [](std::int16_t at) { return at >= 0; }));
    }
    return given;
}

void add_incidents(const SolvePack& pack, const FrameReport& report, double time_s, TakeRecord& record) {
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const MarkerTrouble trouble = report.marker_trouble[k];
        if (trouble == MarkerTrouble::kNone) continue;
        auto at =
            std::find_if(record.incidents.begin(), record.incidents.end(),
                         [&](const MarkerIncident& i) { return i.marker == k && i.trouble == trouble; });
        if (at == record.incidents.end())
            at = record.incidents.insert(at, MarkerIncident{k, trouble, time_s, 0.0});
        at->most_mm = std::max(at->most_mm, static_cast<double>(report.marker_off_mm[k]));
    }
}

}  // namespace

void Histogram::add(double value) {
    if (!std::isfinite(value) || counts.empty()) return;
    const double share = std::clamp((value - low) / (high - low), 0.0, 1.0);
    const auto bin = static_cast<std::size_t>(share * static_cast<double>(counts.size()));
    ++counts[std::min(bin, counts.size() - 1)];
}

std::uint64_t Histogram::total() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : counts) sum += count;
    return sum;
}

TakeRecord empty_record(const std::filesystem::path& take, const SolvePack& pack, std::string source) {
    TakeRecord record;
    record.name = (take.has_filename() ? take : take.parent_path()).filename().string();
    record.source = std::move(source);
    record.markers = markers_of(pack);
    return record;
}

std::vector<InspectedMarker> markers_of(const SolvePack& pack) {
    std::vector<InspectedMarker> markers(pack.marker_count);
    double lowest = 0.0;
    for (std::size_t k = 0; k < markers.size(); ++k) {
        markers[k].name = std::string(pack.marker_names[k]);
        for (std::size_t axis = 0; axis < 3; ++axis)
            markers[k].neutral_mm[axis] = static_cast<double>(pack.neutral_mm[3 * k + axis]);
        lowest = std::min(lowest, markers[k].neutral_mm[1]);
    }
    for (InspectedMarker& marker : markers)
        marker.region = region_of(marker.neutral_mm[0], marker.neutral_mm[1], std::max(1.0, -lowest));
    return markers;
}

double slip_angle_deg(const Slip& slip) {
    return length(slip.rotation_rad) * 180.0 / std::numbers::pi;
}

double slip_distance_mm(const Slip& slip) {
    return length(slip.translation_mm);
}

void add_tick(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
              const FrameReport& report, std::size_t offered, double time_s, TakeRecord& record) {
    TakeTick tick;
    tick.time_s = time_s;
    tick.state = state.state;
    tick.solved = report.solved;
    tick.bootstrapped = report.bootstrapped;
    tick.faults = state.faults;
    tick.cameras = state.cameras;
    tick.swaps_repaired = report.swaps_repaired;
    tick.names_rejected = report.names_rejected;
    std::size_t marks = 0;
    for (const MountDriftReport& mount : report.mounts) {
        marks += mount.marks_used;
        if (mount.marks_used > 0) tick.camera_shift_px = std::fmax(tick.camera_shift_px, mount.shift_px);
    }
    if (report.solved) {
        const std::size_t given = marks + names_given(pack, pipeline);
        tick.ghosts = static_cast<std::uint16_t>(offered > given ? offered - given : 0);
        tick.residual_rms_mm = report.residual_rms_mm;
        tick.slip_deg = slip_angle_deg(state.slip);
        tick.slip_mm = slip_distance_mm(state.slip);
    }
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const bool seen = pipeline.named_markers().markers[k].seen;
        record.sightings.push_back(sighting_of(report.solved, seen, report.marker_confidence[k]));
        float residual = kUnmeasured;
        if (report.solved && seen) {
            const Vec3 off = report.face_markers_mm[k] - solved_place(pack, state, k);
            residual = static_cast<float>(off.norm());
            record.residual_mm.add(static_cast<double>(residual));
        }
        record.residuals_mm.push_back(residual);
    }
    record.ticks.push_back(tick);
    add_incidents(pack, report, time_s, record);
}

void add_camera_tick(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
                     const FrameReport& report, double time_s, TakeRecord& record) {
    std::size_t offered = 0;
    for (std::size_t c = 0; c < pack.camera_count; ++c) {
        offered += report.observations[c];
        for (const Observation& seen : pipeline.observations(c)) {
            record.diameter_px.add(static_cast<double>(seen.diameter_px));
            record.contrast.add(static_cast<double>(seen.contrast));
        }
    }
    add_tick(pack, pipeline, state, report, offered, time_s, record);
}

}  // namespace rig::host
