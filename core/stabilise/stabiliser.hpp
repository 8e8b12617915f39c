// Takes the helmet's slip out: finds the rigid motion between the calibrated head and the markers as seen,
// and hands the markers on in the face frame. No marker of a face is quiet, so the fit knows how the face
// itself may move: it minimises (x - R b - t)^T C^-1 (x - R b - t) with C = B S B^T + s^2 I   (methods.md
// section 1; the idea of a rigid fit is [Deng06 eq. 1-2], the covariance is ours). With one camera the same
// fit runs on the rays.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/shape_fit.hpp"
#include "core/stabilise/stabilised_markers.hpp"
#include "core/track/named_markers.hpp"

namespace rig {

struct StabiliserConfig {
    bool enabled = true;               // false: the markers are in the face frame already
    Rigid nominal;                     // headset_from_face as calibrated
    double rotation_sigma_rad = 0.15;  // expected slip about the nominal pose
    double translation_sigma_mm = 12.0;
    // Between frames a helmet creeps; when it moves by more than jolt_sigmas of this, the frame is fitted
    // without it.
    double step_rotation_sigma_rad = 0.0005;
    double step_translation_sigma_mm = 0.05;
    double jolt_sigmas = 2.5;
    // A marker farther than this from the fitted face counts less, by the fourth power of its distance: what
    // stands off by millimetres was named or measured wrongly.
    double outlier_mm = 2.0;
    int first_steps = 10;  // of the fit, at most: from a cold start
    int steps = 6;         // ... from the previous frame
};

struct StabiliserState {
    bool warm = false;
    ShapeFit fit;  // of the previous frame
    ShapeFitMemory memory;
};

struct StabiliserWorkspace {
    ShapeFitWorkspace fit;
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> informations{};
    std::array<double, kMaxMarkers> trust{};  // share of its information that a marker keeps
    std::array<double, kMaxMarkers> distance_mm{};
};

struct StabiliserReport {
    bool jolt = false;  // the helmet moved faster than it creeps
    bool ok = false;    // false: too little was seen; the previous pose is used
    double slip_rotation_rad = 0.0;
    double slip_translation_mm = 0.0;
    std::uint16_t doubted = 0;  // markers that count less than half: off the face by more than outlier_mm
};

void reset_stabiliser(StabiliserState& state);

// A marker that stands off the face is handed on with the information that it kept here.

void stabilise(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
               StabiliserState& state, StabiliserWorkspace& workspace, StabiliserOutput& output,
               StabiliserReport& report);

}  // namespace rig
