// All cameras, all lenses and all poses of the board in one least-squares problem over the seen points
// (Triggs et al. 2000). The poses of the board are eliminated first (Schur complement), so its size is that
// of the cameras. Not the starting values: initial_cameras.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "firmware_host/companion/calibrate/board.hpp"

namespace rig::host {

// Which numbers of a lens are fitted besides focal lengths and centre; the others stay as given.
enum class LensTerms : std::uint8_t {
    kPolynomial,  // k1 k2 p1 p2 k3
    kRational,    // k1 k2 p1 p2 k3 k4 k5 k6
    kFisheye,     // k1 k2 k3 k4
};

struct BundleObservation {
    std::size_t camera = 0;
    std::size_t view = 0;
    std::size_t point = 0;
    Vec2 seen_px = Vec2::Zero();
};

// Camera poses are in the frame of camera 0, whose pose stays as it is. point_radius_mm: 0 for corners; for
// circles what is seen is the centroid of the projected disc, which is not the projected centre.
struct BundleProblem {
    std::vector<CameraModel> cameras;
    std::vector<Rigid> rig_from_board;  // one a view
    std::vector<BoardPoint> points;
    double point_radius_mm = 0.0;
    std::vector<BundleObservation> observations;
    LensTerms terms = LensTerms::kRational;
};

struct CameraUncertainty {  // standard deviations, from the curvature at the answer and its own residuals
    double fx_px = 0.0;
    double fy_px = 0.0;
    double cx_px = 0.0;
    double cy_px = 0.0;
    double baseline_mm = 0.0;  // of the distance from camera 0; 0 for camera 0
};

struct BundleReport {
    int iterations = 0;
    bool converged = false;
    double rms_px = 0.0;            // of the distance of seen from predicted points
    std::vector<Vec2> residual_px;  // seen - predicted, one an observation
    std::vector<CameraUncertainty> uncertainty;
};

// Levenberg-Marquardt from the problem's own numbers, which become the answer. Residuals beyond half a pixel
// count linearly (Huber). Preconditions: every camera and every view has observations, and every point they
// name exists.
[[nodiscard]] BundleReport adjust(BundleProblem& problem);

// Where the point is expected in the picture. NaN when it is behind the camera.
[[nodiscard]] Vec2 predicted_pixel(const BundleProblem& problem, const BundleObservation& observation);

}  // namespace rig::host
