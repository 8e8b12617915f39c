// Pictures of a board, found and measured, become the cameras of a rig. Files and pictures themselves are
// shot_files.hpp and board_detection.hpp; what the answer is worth is part of the answer.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "firmware_host/companion/calibrate/board.hpp"
#include "firmware_host/companion/calibrate/board_detection.hpp"
#include "firmware_host/companion/calibrate/bundle.hpp"

namespace rig::host {

inline constexpr std::size_t kLeastPictures = 6;  // of a camera; fewer leave its lens a guess
inline constexpr std::size_t kGoodPictures = 15;  // under it a warning is due
inline constexpr std::size_t kLeastPoints = 12;   // of a picture; fewer hardly say more than its pose
inline constexpr std::size_t kLeastShared = 3;    // moments in which a camera and another saw the board

// Coverage counts fields of the picture, kCoverageFields along each side. Row by row; pixels outside count as
// the nearest field.
inline constexpr std::size_t kCoverageFields = 8;
[[nodiscard]] std::size_t coverage_field(double x_px, double y_px, int width_px, int height_px);

// One picture: which camera, and which moment (the same for pictures taken together).
struct CalibrationPicture {
    std::size_t camera = 0;
    std::size_t moment = 0;
    std::string file;
    int width_px = 0;
    int height_px = 0;
    BoardSighting sighting;
};

struct PictureVerdict {
    std::string rejection;  // why it was not used; empty when it was
    double rms_px = 0.0;    // when used
    std::size_t points = 0;
    std::size_t outliers = 0;  // points left out as mistaken
};

struct SeenPoint {
    std::size_t camera = 0;
    Vec2 at_px = Vec2::Zero();
    Vec2 residual_px = Vec2::Zero();  // seen - predicted
};

// Points seen by two cameras or more, triangulated by core and compared with the flat board that they lie on.
struct TriangulationCheck {
    std::size_t points = 0;
    double rms_mm = 0.0;  // after the best rigid fit of each moment's board
};

struct Calibration {
    std::vector<CameraModel> cameras;  // in the frame of camera 0
    std::vector<double> rms_px;        // a camera
    std::vector<std::size_t> picture_count;
    std::vector<std::size_t> point_count;
    std::vector<double> coverage;  // share of the picture's 8 x 8 fields that hold a point
    std::vector<CameraUncertainty> uncertainty;
    std::vector<PictureVerdict> verdicts;  // one a picture, in their order
    std::vector<SeenPoint> seen;
    TriangulationCheck triangulation;
    double all_rms_px = 0.0;
    bool converged = false;
};

struct CalibrationTask {
    std::vector<std::string> camera_names;
    std::vector<CalibrationPicture> pictures;
    BoardSpec board;
    LensTerms terms = LensTerms::kRational;
    double row_time_us = 0.0;  // written into every camera
};

// Errors name the camera, what is missing and what to do: pictures of different sizes, too few that can be
// used, a board that does not fit, cameras that never saw the board together. `progress` gets 0 to 1.
[[nodiscard]] Result<Calibration, FileError> calibrate(const CalibrationTask& task,
                                                       const std::function<void(double)>& progress);

}  // namespace rig::host
