// Puts the stages in order: a frame in, a FaceState and a FrameReport out. The only part of core that sees
// every stage. Not for: time, threads, files, links; those belong to the programs.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/result.hpp"
#include "core/detect/detector.hpp"
#include "core/filter/recovery_blend.hpp"
#include "core/filter/smoothing.hpp"
#include "core/infer/inference.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/pipeline/expected_markers.hpp"
#include "core/pipeline/frame_types.hpp"
#include "core/pipeline/ladder.hpp"
#include "core/solve/solver.hpp"
#include "core/stabilise/neutral_capture.hpp"
#include "core/stabilise/stabiliser.hpp"
#include "core/track/helmet_marks.hpp"
#include "core/track/tracker.hpp"

namespace rig {

// Slip beyond either of these raises kRigMoved: re-seat the rig. About 4 degrees.
inline constexpr double kSlipAlarmRad = 0.07;
inline constexpr double kSlipAlarmMm = 8.0;

// kFilter: a window, a kind of filter or the delay is outside its range.
enum class PipelineError : std::uint8_t { kPackLimits, kRate, kFilter };

// About 20 MB, all of it inside the object: a program places it before seal(), never on a stack. step() and
// idle() never allocate. The pack's bytes outlive it. One thread uses a pipeline.
class Pipeline {
  public:
    // `pack` as open_pack() returned it: its numbers are checked already. On failure, and before the first
    // success, the pipeline is in SAFE and every step yields the rest pose.
    [[nodiscard]] Result<void, PipelineError> configure(const SolvePack& pack, const PipelineConfig& config);

    // One tick each; `state` and `report` are overwritten. state.sequence is counted here; state.age_us is
    // the caller's to fill when it encodes.
    void step(const FrameSet& frame, FaceState& state, FrameReport& report);
    void step(const ObservationFrame& frame, FaceState& state, FrameReport& report);
    void step(const LabelledFrame& frame, FaceState& state, FrameReport& report);
    void step(const PointFrame& frame, FaceState& state, FrameReport& report);
    // A tick for which no input arrived at all.
    void idle(std::int64_t now_us, FaceState& state, FrameReport& report);

    // What an artist asks for, from the next step on; neutral after configure(). What is put out is inside
    // the ranges that were set from then on, also while it is held, decays or rests. kShape before
    // configure().
    [[nodiscard]] Result<void, ControlError> set_controls(const ControlSet& controls);

    // Forgets all that was learnt from frames: identities, slip, the temporal prior, the dots' polarity, size
    // and usual light, how the cameras sit. The next frames find it anew, as after configure(). What somebody
    // chose stays: the neutral and the controls.
    void reset_tracking();

    // "Basis": the next second of the face at rest becomes the neutral, as an offset of each marker; the
    // report's `neutral` tells how it goes and why it is refused. Nothing before configure(), after which
    // there are no offsets. reset_tracking() keeps them.
    void begin_neutral();
    void forget_neutral();

    // Of the last step, for recording and pictures.
    [[nodiscard]] const Observations& observations(std::size_t camera) const { return observations_[camera]; }
    [[nodiscard]] const NamedMarkers& named_markers() const { return named_; }
    // Which observation of each camera each marker was taken for, -1 none; of a stream, which of its finite
    // points.
    [[nodiscard]] const Matches& matches() const { return track_report_.matches; }
    // Of a regional pack, after a solved step: coefficients, residual and confidence of each region.
    [[nodiscard]] const RegionalOutput& regions() const { return solved_.regional; }
    [[nodiscard]] const DetectorReport& detector_report(std::size_t camera) const {
        return detector_reports_[camera];
    }

  private:
    void configure_stages(const PipelineConfig& config);
    void forget();
    void begin(std::int64_t capture_us, FaceState& state, FrameReport& report);
    void find_markers(std::size_t camera, const ImageView& image);
    void take_observations(std::size_t camera, std::span<const Observation> observations,
                           FrameReport& report);
    void track_sightings(FrameReport& report);
    void report_identity(FrameReport& report) const;
    void expect_neutral();
    void find_head_pose(FrameReport& report);
    void solve_named(std::int64_t capture_us, FrameReport& report);
    void finish(std::int64_t capture_us, bool usable, FaceState& state, FrameReport& report);
    void put_out(std::int64_t capture_us, bool usable, FaceState& state, FrameReport& report);
    void hold(std::int64_t capture_us, FaceState& state);
    void raise_faults(bool usable, const FrameReport& report, FaceState& state) const;
    [[nodiscard]] bool is_partial(const FaceState& state) const;

    bool configured_ = false;
    PipelineConfig config_;
    SolvePack pack_;
    ShapeModel model_;
    ShapeModelWorkspace model_workspace_;
    std::array<double, kMaxCameras> camera_depth_mm_{};

    std::array<Detector, kMaxCameras> detectors_;
    std::array<DetectorReport, kMaxCameras> detector_reports_{};
    std::array<Observations, kMaxCameras> observations_{};
    ExpectedMarkers expected_;
    HelmetMarkConfig mark_config_;
    std::array<MountDriftState, kMaxCameras> mounts_{};
    HelmetMarkOutput helmet_marks_;
    std::array<CameraModel, kMaxCameras> cameras_now_{};  // as they sit in this frame: what rays came from
    SightingSet sightings_;

    TrackerConfig tracker_config_;
    TrackerState tracker_;
    TrackerWorkspace tracker_workspace_;
    TrackerReport track_report_;
    NamedMarkers named_;

    BoundedVector<NamedPixel, kMaxPnpPoints> named_pixels_;
    HeadPose head_pose_;  // of the last frame that had one

    NeutralConfig neutral_config_;
    NeutralState neutral_;
    NamedMarkers centred_;  // named_ with the offsets of the neutral taken off

    StabiliserConfig stabiliser_config_;
    StabiliserState stabiliser_;
    StabiliserWorkspace stabiliser_workspace_;
    StabiliserOutput stabilised_;
    StabiliserReport stabiliser_report_;

    FaceGaussian face_gaussian_;
    FaceGaussianWorkspace face_gaussian_workspace_;
    InferenceWorkspace inference_workspace_;
    InferenceOutput completed_;

    SolverConfig solver_config_;
    SolverState solver_;
    SolverWorkspace solver_workspace_;
    SolverOutput solved_;
    SolverReport solver_report_;

    SmoothingConfig smoothing_config_;
    SmoothingState smoothing_;
    RecoveryConfig recovery_config_;
    RecoveryState recovery_;
    LadderConfig ladder_config_;
    LadderState ladder_;
    bool was_live_ = false;
    bool sent_any_ = false;  // some solve has been put out

    std::uint32_t sequence_ = 0;
    std::uint32_t window_ticks_ = 0;   // picture frames since tracking began anew
    std::int64_t last_usable_us_ = 0;  // when the silence began that the decay to rest counts from
    std::int64_t sent_us_ = 0;         // capture time of the frame behind sent_
    std::array<double, kMaxShapes> smoothed_{};
    std::array<double, kMaxShapes> sent_{};  // the weights last put out
    std::array<double, kMaxShapes>
        lost_from_{};  // ... when the face was lost: where the decay to rest starts
};

}  // namespace rig
