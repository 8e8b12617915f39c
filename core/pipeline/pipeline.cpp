#include "core/pipeline/pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/elapsed.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kNominalDepthMm = 200.0;       // helmet camera to face, when the calibration does not tell
constexpr std::uint32_t kWholeImageEvery = 32;  // frames, of each camera
constexpr std::int64_t kDecayUs = 400'000;      // to the rest pose, policy kDecay
constexpr float kObservable = 0.5F;    // confidence, everything visible, from which a shape counts as seen
constexpr float kPartialShare = 0.5F;  // of that confidence, under which its region is not seen any more

// Of a head before cameras that stand: where it is about, and how far it goes in a frame.
constexpr double kHeadSigmaRad = 0.8;
constexpr double kHeadSigmaMm = 200.0;
constexpr double kHeadStepRad = 0.02;
constexpr double kHeadStepMm = 3.0;
constexpr double kHeadSigmaPx = 0.3;  // of a named pixel about the fitted face
constexpr double kNeutralS = 1.0;     // of a face at rest that becomes the neutral ...
constexpr int kNeutralPatience = 3;   // ... within so many times as long

double rest(const SolvePack& pack, std::size_t i) {
    return std::clamp(0.0, static_cast<double>(pack.weight_low[i]), static_cast<double>(pack.weight_high[i]));
}

void write_slip(const Rigid& pose, Slip& slip) {
    const Vec3 turn = vector_from_rotation(pose.rotation);
    for (std::size_t i = 0; i < 3; ++i) {
        slip.rotation_rad[i] = static_cast<float>(turn[static_cast<Eigen::Index>(i)]);
        slip.translation_mm[i] = static_cast<float>(pose.translation_mm[static_cast<Eigen::Index>(i)]);
    }
}

// Refusals in the order of the wire.
HeadStatus head_status(const HeadPose& pose) {
    static_assert(static_cast<int>(PnpRefusal::kTooFew) + 1 == static_cast<int>(HeadStatus::kTooFew));
    static_assert(static_cast<int>(PnpRefusal::kMistaken) + 1 == static_cast<int>(HeadStatus::kMistaken));
    if (pose.known) return HeadStatus::kKnown;
    if (pose.refusal == PnpRefusal::kNone) return HeadStatus::kUnknown;
    return static_cast<HeadStatus>(static_cast<int>(pose.refusal) + 1);
}

void write_head(const HeadPose& pose, std::int64_t capture_us, HeadPlace& head) {
    head = HeadPlace{};
    head.status = head_status(pose);
    head.capture_us = capture_us;
    if (!pose.known) return;
    head.points_used = pose.points_used;
    Slip place;
    write_slip(pose.reference_from_face, place);
    head.rotation_rad = place.rotation_rad;
    head.translation_mm = place.translation_mm;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<Eigen::Index>(i);
        head.rotation_sigma_rad[i] = static_cast<float>(pose.rotation_sigma_rad[axis]);
        head.translation_sigma_mm[i] = static_cast<float>(pose.translation_sigma_mm[axis]);
    }
    head.rms_px = static_cast<float>(pose.rms_px);
}

}  // namespace

Result<void, PipelineError> Pipeline::configure(const SolvePack& pack, const PipelineConfig& config) {
    configured_ = false;
    const bool counts = pack.marker_count >= kMinMarkers && pack.marker_count <= kMaxMarkers &&
                        pack.shape_count >= 1 && pack.shape_count <= kMaxShapes &&
                        pack.camera_count <= kMaxCameras;
    const std::size_t rows = 3U * pack.marker_count;
    if (!counts || pack.neutral_mm.size() != rows || pack.basis_mm.size() != rows * pack.shape_count) {
        return failure(PipelineError::kPackLimits);
    }
    if (!(config.rate_hz >= 1.0 && config.rate_hz <= 1000.0)) return failure(PipelineError::kRate);
    if (!is_valid(config.smoothing, pack.shape_count)) return failure(PipelineError::kFilter);
    config_ = config;
    pack_ = pack;
    build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma, model_workspace_,
                      model_);
    build_face_gaussian(pack, model_, face_gaussian_workspace_, face_gaussian_);
    reset_inference(inference_workspace_);
    configure_solver(pack, config.rate_hz, solver_workspace_, solver_config_);
    configure_stages(config);
    for (std::size_t i = 0; i < pack.shape_count; ++i) sent_[i] = rest(pack, i);
    reset_tracking();
    ladder_ = LadderState{};
    was_live_ = false;
    sent_any_ = false;
    configured_ = true;
    return {};
}

void Pipeline::configure_stages(const PipelineConfig& config) {
    DetectorConfig detector;
    detector.polarity = config.polarity;
    for (Detector& each : detectors_) {
        const auto accepted = each.configure(detector);
        RIG_CHECK(accepted.has_value());
        each.reset();
    }
    for (std::size_t c = 0; c < pack_.camera_count; ++c) {
        const Vec3& centre = pack_.cameras[c].centre_mm;
        const double distance = std::sqrt(centre.dot(centre));
        camera_depth_mm_[c] = distance > 1.0 ? distance : kNominalDepthMm;
    }
    mounts_.fill(MountDriftState{});
    tracker_config_ = TrackerConfig{};
    tracker_config_.rate_hz = config.rate_hz;
    reset_neutral(neutral_);
    neutral_config_ = NeutralConfig{};
    neutral_config_.frames = static_cast<std::uint16_t>(std::max(1.0, config.rate_hz * kNeutralS));
    neutral_config_.most_ticks = static_cast<std::uint16_t>(kNeutralPatience * neutral_config_.frames);
    stabiliser_config_ = StabiliserConfig{};
    stabiliser_config_.enabled = config.stabilise;
    if (!config.camera_on_head) {
        // A head turns further than a helmet slips, and it never creeps.
        stabiliser_config_.rotation_sigma_rad = kHeadSigmaRad;
        stabiliser_config_.translation_sigma_mm = kHeadSigmaMm;
        stabiliser_config_.step_rotation_sigma_rad = kHeadStepRad;
        stabiliser_config_.step_translation_sigma_mm = kHeadStepMm;
    }
    configure_smoothing(config.smoothing, config.rate_hz, pack_.weight_low, pack_.weight_high,
                        smoothing_config_);
    recovery_config_ = RecoveryConfig{};
    recovery_config_.rate_hz = config.rate_hz;
    recovery_config_.low = pack_.weight_low;
    recovery_config_.high = pack_.weight_high;
    recovery_config_.good_frames = 1;  // the ladder has counted already
    ladder_config_ = LadderConfig{};
    ladder_config_.rate_hz = config.rate_hz;
}

Result<void, ControlError> Pipeline::set_controls(const ControlSet& controls) {
    if (!configured_) return failure(ControlError::kShape);
    if (const auto checked = check_controls(controls, pack_.shape_count); !checked) return checked;
    prepare_controls(pack_, controls, solver_config_.controls);
    return {};
}

void Pipeline::begin_neutral() {
    if (configured_) rig::begin_neutral(neutral_);
}

void Pipeline::forget_neutral() {
    reset_neutral(neutral_);
}

void Pipeline::reset_tracking() {
    window_ticks_ = 0;
    stabilised_ = StabiliserOutput{};
    for (Detector& each : detectors_) each.reset();
    mounts_.fill(MountDriftState{});
    reset_tracker(tracker_);
    reset_stabiliser(stabiliser_);
    reset_solver(solver_);
    reset_smoothing(smoothing_);
    head_pose_ = HeadPose{};
}

// After a loss nothing of before helps any more. A search for identities that is under way goes on.
void Pipeline::forget() {
    if (track_report_.tracking) reset_tracker(tracker_);
    track_report_.tracking = false;
    reset_stabiliser(stabiliser_);
    reset_solver(solver_);
    reset_smoothing(smoothing_);
}

void Pipeline::begin(std::int64_t capture_us, FaceState& state, FrameReport& report) {
    report = FrameReport{};
    report.labels.fill(-1);
    state = FaceState{};
    state.sequence = sequence_++;
    state.capture_us = capture_us;
    state.shape_count = configured_ ? pack_.shape_count : std::uint16_t{0};
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        state.cameras[c] =
            c < pack_.camera_count && configured_ ? CameraStatus::kMissing : CameraStatus::kUnused;
    }
    sightings_.clear();
    sightings_.capture_us = capture_us;
    named_ = NamedMarkers{};  // a tick without pictures has no markers, not the last ones
    named_.capture_us = capture_us;
    named_.count = configured_ ? pack_.marker_count : std::uint16_t{0};
}

// A face that is tracked is looked for where it should be; now and then everywhere, one camera after another,
// so that what was taken for a marker has to be the best in the whole picture.
void Pipeline::find_markers(std::size_t camera, const ImageView& image) {
    Detector& detector = detectors_[camera];
    const bool due = (window_ticks_ + camera * kWholeImageEvery / kMaxCameras) % kWholeImageEvery == 0;
    if (!tracker_.tracking || due || !config_.windows) {
        if (!tracker_.tracking) detector.forget_size();
        detector.detect(image, observations_[camera], detector_reports_[camera]);
        return;
    }
    const MarkerPrediction prediction{predict_markers(model_, tracker_config_, tracker_, tracker_workspace_),
                                      std::span(tracker_.missed).first(pack_.marker_count),
                                      std::span(track_report_.matches[camera]).first(pack_.marker_count)};
    expect_markers(turned_camera(pack_.cameras[camera], mounts_[camera].turn_rad), camera, prediction,
                   pack_.helmet_marks(), expected_);
    detector.detect_around(image, expected_.span(), observations_[camera], detector_reports_[camera]);
}

void Pipeline::take_observations(std::size_t camera, std::span<const Observation> observations,
                                 FrameReport& report) {
    report.observations[camera] = static_cast<std::uint16_t>(observations.size());
    find_helmet_marks(pack_.cameras[camera], camera, pack_.helmet_marks(), observations, mark_config_,
                      mounts_[camera], helmet_marks_);
    report.mounts[camera] = helmet_marks_.drift;
    cameras_now_[camera] = helmet_marks_.now;
    add_camera_view(cameras_now_[camera], observations, kCentreSigmaPx, camera_depth_mm_[camera], sightings_,
                    helmet_marks_.taken.span());
}

void Pipeline::track_sightings(FrameReport& report) {
    expect_neutral();
    track(model_, tracker_config_, sightings_, tracker_, tracker_workspace_, named_, track_report_);
    // From here on a match is an observation: some of those became no sighting.
    for (std::size_t view = 0; sightings_.from_cameras && view < sightings_.view_count; ++view) {
        for (std::int16_t& match : track_report_.matches[view]) {
            if (match >= 0)
                match = static_cast<std::int16_t>(sightings_.source[view][static_cast<std::size_t>(match)]);
        }
    }
    report_identity(report);
    report.bootstrapped = track_report_.bootstrapped;
}

void Pipeline::report_identity(FrameReport& report) const {
    report.markers_seen = track_report_.seen;
    report.swaps_repaired = track_report_.swaps_repaired;
    report.names_rejected = track_report_.rejected;
    report.marker_trouble = track_report_.trouble;
    report.marker_off_mm = track_report_.off_mm;
}

// Dots that were glued aside before the neutral was taken have not slid.
void Pipeline::expect_neutral() {
    tracker_config_.neutral_offset_mm = std::span<const Vec3>(neutral_.offset_mm).first(pack_.marker_count);
}

void Pipeline::step(const FrameSet& frame, FaceState& state, FrameReport& report) {
    begin(frame.capture_us, state, report);
    bool any = false;
    for (std::size_t c = 0; c < pack_.camera_count && configured_; ++c) {
        observations_[c].clear();
        CameraStatus status = c < frame.camera_count ? frame.status[c] : CameraStatus::kMissing;
        if (has_picture(status) && frame.images[c].empty()) status = CameraStatus::kMissing;
        if (has_picture(status)) {
            find_markers(c, frame.images[c]);
            if (detector_reports_[c].exposure != 0) status = CameraStatus::kExposure;
            state.faults |= detector_reports_[c].faults;
            any = true;
        }
        state.cameras[c] = status;
        take_observations(c, observations_[c].span(), report);
    }
    ++window_ticks_;
    if (any) track_sightings(report);
    const bool usable = any && track_report_.tracking;
    if (usable) solve_named(frame.capture_us, report);
    finish(frame.capture_us, usable && solver_report_.solved, state, report);
}

void Pipeline::step(const ObservationFrame& frame, FaceState& state, FrameReport& report) {
    begin(frame.capture_us, state, report);
    bool any = false;
    for (std::size_t c = 0; c < pack_.camera_count && configured_; ++c) {
        observations_[c].clear();
        const CameraStatus status = c < frame.camera_count ? frame.status[c] : CameraStatus::kMissing;
        state.cameras[c] = status;
        if (status == CameraStatus::kExposure) state.faults |= fault_bit(Fault::kExposure);
        if (has_picture(status)) {
            any = true;
            for (const Observation& observation : frame.cameras[c]) {
                if (!observations_[c].push_back(observation)) break;
            }
        }
        take_observations(c, observations_[c].span(), report);
    }
    if (any) track_sightings(report);
    const bool usable = any && track_report_.tracking;
    if (usable) solve_named(frame.capture_us, report);
    finish(frame.capture_us, usable && solver_report_.solved, state, report);
}

void Pipeline::step(const LabelledFrame& frame, FaceState& state, FrameReport& report) {
    begin(frame.capture_us, state, report);
    bool usable = configured_ && frame.positions_mm.size() == pack_.marker_count;
    if (usable) {
        expect_neutral();
        check_names(model_, tracker_config_, frame.positions_mm, static_cast<double>(pack_.noise_mm),
                    tracker_, tracker_workspace_, sightings_, named_, track_report_);
        report_identity(report);
        usable = track_report_.seen >= kMinMarkers;
    }
    if (usable) solve_named(frame.capture_us, report);
    finish(frame.capture_us, usable && solver_report_.solved, state, report);
}

void Pipeline::step(const PointFrame& frame, FaceState& state, FrameReport& report) {
    begin(frame.capture_us, state, report);
    bool usable = configured_ && !frame.positions_mm.empty();
    if (usable) {
        add_point_view(frame.positions_mm, static_cast<double>(pack_.noise_mm), sightings_);
        track_sightings(report);
        for (std::size_t k = 0; k < pack_.marker_count; ++k) {
            const std::int16_t at = track_report_.matches[0][k];
            if (at < 0) continue;
            const std::uint16_t slot = sightings_.source[0][static_cast<std::size_t>(at)];
            if (slot < report.labels.size()) report.labels[slot] = static_cast<std::int16_t>(k);
        }
        usable = track_report_.tracking;
    }
    if (usable) solve_named(frame.capture_us, report);
    finish(frame.capture_us, usable && solver_report_.solved, state, report);
}

void Pipeline::idle(std::int64_t now_us, FaceState& state, FrameReport& report) {
    begin(now_us, state, report);
    finish(now_us, false, state, report);
}

// The expression is the stabiliser's; where the head is, the pixels say themselves.
void Pipeline::find_head_pose(FrameReport& report) {
    named_pixels_.clear();
    for (std::size_t c = 0; c < sightings_.view_count; ++c) {
        for (std::size_t k = 0; k < pack_.marker_count; ++k) {
            const std::int16_t at = track_report_.matches[c][k];
            if (at < 0 || !named_.markers[k].seen) continue;
            const Observation& seen = observations_[c][static_cast<std::size_t>(at)];
            const Vec3 face_mm =
                model_.face_position(k, stabilised_.fit.coefficients) + neutral_.offset_mm[k];
            const bool kept = named_pixels_.push_back({&cameras_now_[c], face_mm, pixel_of(seen)});
            RIG_CHECK(kept);
        }
    }
    PnpConfig config;
    // What the shapes leave of the face counts as well as the detector's error.
    config.sigma_px = kHeadSigmaPx;
    report.head_pose = track_pnp(named_pixels_.span(), config, head_pose_);
}

void Pipeline::solve_named(std::int64_t capture_us, FrameReport& report) {
    if (neutral_.any) {
        centred_ = named_;
        subtract_offsets(neutral_, config_.stabilise ? tracker_.fit.pose : Rigid{}, centred_);
    }
    stabilise(model_, stabiliser_config_, neutral_.any ? centred_ : named_, stabiliser_,
              stabiliser_workspace_, stabilised_, stabiliser_report_);
    if (!config_.camera_on_head && sightings_.from_cameras) find_head_pose(report);
    infer_missing(face_gaussian_, stabilised_, inference_workspace_, completed_);
    solve(solver_config_, stabilised_, completed_, capture_us, solver_, solver_workspace_, solved_,
          solver_report_);
    control_output(solver_config_.controls, {solved_.weights.data(), pack_.shape_count});
    report.solved = solver_report_.solved;
    report.kkt = solver_report_.kkt;
    report.objective_mm2 = solver_report_.objective_mm2;
    report.iterations = solver_report_.iterations;
    report.working_set_changes = solver_report_.changes;
    report.markers_used = solver_report_.markers_used;
    report.residual_rms_mm = solver_report_.residual_rms_mm;
    report.hull_distance = solver_report_.hull_distance;
    report.optimal = solver_report_.optimal;
    for (std::size_t k = 0; k < pack_.marker_count; ++k) {
        report.face_markers_mm[k] = completed_.position_mm[k];
        report.marker_confidence[k] = completed_.confidence[k];
        report.marker_deviation_mm[k] = completed_.deviation_mm[k];
    }
}

bool Pipeline::is_partial(const FaceState& state) const {
    for (std::size_t c = 0; c < pack_.camera_count; ++c) {
        // A marker stream has no cameras to miss.
        if (sightings_.from_cameras && !has_picture(state.cameras[c])) return true;
    }
    for (std::size_t i = 0; i < pack_.shape_count; ++i) {
        const float full = solver_config_.full_confidence[i];
        if (full >= kObservable && solved_.confidence[i] < kPartialShare * full) return true;
    }
    return false;
}

void Pipeline::finish(std::int64_t capture_us, bool usable, FaceState& state, FrameReport& report) {
    LadderInput input;
    input.now_us = capture_us;
    input.configured = configured_;
    input.usable = usable;
    input.partial = usable && is_partial(state);
    step_ladder(ladder_config_, input, ladder_);
    state.state = ladder_.state;
    if (configured_) {
        watch_neutral(model_, pack_.neutral_mm, static_cast<double>(pack_.noise_mm), neutral_config_,
                      usable ? &stabilised_ : nullptr, neutral_, report.neutral);
        if (!usable && ladder_.state == TrackingState::kLost) forget();
        put_out(capture_us, usable, state, report);
        if (!config_.camera_on_head) write_head(report.head_pose, capture_us, state.head);
    }
    raise_faults(usable, report, state);
}

void Pipeline::put_out(std::int64_t capture_us, bool usable, FaceState& state, FrameReport& report) {
    const std::size_t n = pack_.shape_count;
    const bool up = ladder_.state >= TrackingState::kPartial;
    if (usable) {
        SmoothingReport smoothing;
        const std::span<const double> raw(solved_.weights.data(), n);
        smooth(smoothing_config_, raw, capture_us, smoothing_, {smoothed_.data(), n}, smoothing);
        if (!config_.filter) smoothing = SmoothingReport{.answered_us = capture_us};
        report.delay_frames = smoothing.delay_frames;
        report.delay_us = smoothing.delay_us;
        const std::span<const double> wanted(config_.filter ? smoothed_.data() : solved_.weights.data(), n);
        RecoveryReport recovery;
        if (!config_.filter || (up && !was_live_)) {
            // The very first face does not come back from anything; without the filter nothing is blended.
            std::copy(wanted.begin(), wanted.end(), sent_.begin());
            recovery_.phase = RecoveryPhase::kLive;
            recovery.phase = RecoveryPhase::kLive;
        } else {
            blend_recovery(recovery_config_, up, wanted, {sent_.data(), n}, capture_us, recovery_,
                           {sent_.data(), n}, recovery);
        }
        was_live_ = was_live_ || up;
        state.held = recovery.phase == RecoveryPhase::kHeld;
        sent_any_ = sent_any_ || !state.held;
        if (!state.held) sent_us_ = smoothing.answered_us;
        if (sent_any_) state.capture_us = sent_us_;  // of the weights, which may be older than this frame
        last_usable_us_ = capture_us;
        lost_from_ = sent_;
        if (config_.camera_on_head) write_slip(stabilised_.headset_from_face, state.slip);
    } else {
        hold(capture_us, state);
    }
    const Controls& controls = solver_config_.controls;
    for (std::size_t i = 0; i < n; ++i) {
        state.weights[i] = std::clamp(static_cast<float>(sent_[i]), controls.low[i], controls.high[i]);
        const bool known = ladder_.state >= TrackingState::kHold && was_live_;
        state.confidence[i] = known ? solved_.confidence[i] : 0.0F;
    }
}

void Pipeline::hold(std::int64_t capture_us, FaceState& state) {
    state.held = true;
    if (sent_any_) state.capture_us = sent_us_;
    if (config_.camera_on_head) write_slip(stabilised_.headset_from_face, state.slip);
    if (ladder_.state <= TrackingState::kHold) reset_recovery(recovery_);
    if (!ladder_.ever_usable || ladder_.state != TrackingState::kLost) return;
    if (config_.loss_policy != LossPolicy::kDecay) return;
    const std::int64_t since_us =
        elapsed_us(ladder_config_.lost_after_us, elapsed_us(last_usable_us_, capture_us));
    const double left =
        1.0 - std::clamp(static_cast<double>(since_us) / static_cast<double>(kDecayUs), 0.0, 1.0);
    for (std::size_t i = 0; i < pack_.shape_count; ++i) {
        sent_[i] = rest(pack_, i) + left * (lost_from_[i] - rest(pack_, i));
    }
}

void Pipeline::raise_faults(bool usable, const FrameReport& report, FaceState& state) const {
    const auto raise = [&state](bool when, Fault fault) {
        if (when) state.faults |= fault_bit(fault);
    };
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        raise(state.cameras[c] == CameraStatus::kGone, Fault::kCameraGone);
        raise(state.cameras[c] == CameraStatus::kFrozen, Fault::kCameraFrozen);
        raise(state.cameras[c] == CameraStatus::kExposure, Fault::kExposure);
    }
    for (const MountDriftState& mount : mounts_) raise(mount.drifted, Fault::kRigMoved);
    raise(configured_ && !usable, Fault::kMarkersLost);
    if (!usable) return;
    raise(state.state == TrackingState::kPartial, Fault::kMarkersMissing);
    raise(report.swaps_repaired > 0 || report.names_rejected > 0, Fault::kMarkerSwap);
    raise(track_report_.fallen + track_report_.slid > 0, Fault::kMarkerDrift);
    raise(!report.optimal, Fault::kSolveWeak);
    raise(config_.camera_on_head && (stabiliser_report_.slip_rotation_rad > kSlipAlarmRad ||
                                     stabiliser_report_.slip_translation_mm > kSlipAlarmMm),
          Fault::kRigMoved);
}

}  // namespace rig
