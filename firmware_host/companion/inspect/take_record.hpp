// What is known of a take, tick by tick and marker by marker: what the page of `headrig inspect` is made of.
// Not for: pixels (scene.hpp keeps those of a few moments) and weights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/base/face_state.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/inspect/scene.hpp"
#include "firmware_host/companion/report/pack_analysis.hpp"

namespace rig::host {

// Of one marker in one tick. Lost: not seen, and nothing stands behind its place either: no solve in this
// tick, or an inferred place that is hardly better known than a face's usual spread.
enum class Sighting : std::uint8_t { kLost = 0, kInferred = 1, kVisible = 2 };
inline constexpr float kLeastInferredConfidence = 0.1F;

struct InspectedMarker {
    std::string name;
    std::optional<FaceRegion> region;    // nothing where no pack tells the layout
    std::array<double, 3> neutral_mm{};  // face frame; zero without a pack
};

struct TakeTick {
    double time_s = 0.0;  // since the first tick
    TrackingState state = TrackingState::kSafe;
    bool solved = false;        // a solve stands behind this tick
    bool bootstrapped = false;  // identities were found anew
    bool reset = false;         // tracking was reset by hand just before
    FaultMap faults = 0;
    std::array<CameraStatus, kMaxCameras> cameras{};
    std::uint16_t swaps_repaired = 0;  // names that changed
    std::uint16_t names_rejected = 0;
    std::uint16_t ghosts =
        0;  // blobs or points that neither marker nor helmet mark took, while names were known
    double residual_rms_mm = std::numeric_limits<double>::quiet_NaN();  // over the coordinates solved with
    double slip_deg = std::numeric_limits<double>::quiet_NaN();
    double slip_mm = std::numeric_limits<double>::quiet_NaN();
    // How far the worst camera's picture has moved on the helmet; NaN on rigs without reference marks.
    double camera_shift_px = std::numeric_limits<double>::quiet_NaN();
};

// A marker that came off or slid.
struct MarkerIncident {
    std::size_t marker = 0;
    MarkerTrouble trouble = MarkerTrouble::kNone;
    double first_s = 0.0;
    double most_mm = 0.0;  // off its place, when it slid
};

// Equal bins over [low, high); what is outside falls into the first or last one.
struct Histogram {
    double low = 0.0;
    double high = 1.0;
    std::vector<std::uint64_t> counts;

    void add(double value);
    [[nodiscard]] std::uint64_t total() const;
};

struct TakeRecord {
    std::string name;    // of the take's file or folder
    std::string source;  // what it is, in words
    double rate_hz = 60.0;
    std::vector<std::string> cameras;  // names, in the pack's order
    std::vector<InspectedMarker> markers;
    std::vector<TakeTick> ticks;            // in order of time
    std::vector<Sighting> sightings;        // [ticks x markers]; empty when the take holds no markers
    std::vector<float> residuals_mm;        // [ticks x markers], NaN where not measured; empty when unknown
    std::vector<MarkerIncident> incidents;  // in order of time, one of each kind and marker
    std::uint64_t missing_ticks = 0;        // that the recording lacks
    bool counts_ghosts = false;             // unnamed blobs or points are known
    Histogram residual_mm{0.0, 1.5, std::vector<std::uint64_t>(30, 0)};
    Histogram diameter_px{0.0, 25.0, std::vector<std::uint64_t>(25, 0)};
    Histogram contrast{0.0, 1.0, std::vector<std::uint64_t>(25, 0)};
    std::vector<std::string> remarks;  // whole sentences for the reader
    std::string cut;                   // why the take's file ended early; empty when it is whole
    std::vector<Moment> moments;       // worst ones, in order of time

    [[nodiscard]] Sighting sighting(std::size_t tick, std::size_t marker) const {
        return sightings[tick * markers.size() + marker];
    }
    [[nodiscard]] float residual(std::size_t tick, std::size_t marker) const {
        return residuals_mm[tick * markers.size() + marker];
    }
};

// Named after the take's file or folder, with the pack's markers and without ticks.
[[nodiscard]] TakeRecord empty_record(const std::filesystem::path& take, const SolvePack& pack,
                                      std::string source);

// The markers of a pack with their regions.
[[nodiscard]] std::vector<InspectedMarker> markers_of(const SolvePack& pack);

// Degrees and millimetres of a slip, and from which angle the pipeline raises the alarm.
inline constexpr double kSlipAlarmDeg = kSlipAlarmRad * 180.0 / std::numbers::pi;
[[nodiscard]] double slip_angle_deg(const Slip& slip);
[[nodiscard]] double slip_distance_mm(const Slip& slip);

// Appends what the pipeline's last step told. `offered`: blobs or finite points that went in. The pipeline
// runs without smoothing, so that residuals are of the weights that the markers ask for: residual of a seen
// marker = | its stabilised place - (b0 + B w) |.
void add_tick(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
              const FrameReport& report, std::size_t offered, double time_s, TakeRecord& record);
// The same of images or observations, with the sizes of the blobs.
void add_camera_tick(const SolvePack& pack, const Pipeline& pipeline, const FaceState& state,
                     const FrameReport& report, double time_s, TakeRecord& record);

}  // namespace rig::host
