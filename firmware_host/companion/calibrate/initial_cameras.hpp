// Starting values for the bundle adjustment: a lens and the poses of the board for each camera alone, then
// where the cameras are to each other.
#pragma once

#include <optional>
#include <vector>

#include "firmware_host/companion/calibrate/board.hpp"
#include "firmware_host/companion/calibrate/bundle.hpp"

namespace rig::host {

// One picture's points, by number of the board's point.
struct BoardPicture {
    std::vector<std::size_t> points;
    std::vector<Vec2> seen_px;
};

// A camera of one size with a lens good to some percent, centre at the origin. Polynomial and rational lenses
// by OpenCV's calibration after Zhang (2000) with k1 and k2; fisheye lenses by trying angles of view. Nothing
// when that fails: the board always faced the camera, or these are not its points.
[[nodiscard]] std::optional<CameraModel> initial_camera(int width_px, int height_px,
                                                        const std::vector<BoardPicture>& pictures,
                                                        const std::vector<BoardPoint>& points,
                                                        LensTerms terms);

// Camera from board, for a camera at the origin; nothing when there are under four points or they are in a
// row.
[[nodiscard]] std::optional<Rigid> board_pose(const CameraModel& camera, const BoardPicture& picture,
                                              const std::vector<BoardPoint>& points);

// poses[camera][view]: camera from board where the camera saw it. Camera from the frame of camera 0, each
// over the chain of cameras that share most views; of the views of a pair the one counts that agrees best
// with the others. Nothing for cameras that no chain reaches.
[[nodiscard]] std::vector<std::optional<Rigid>> chain_cameras(
    const std::vector<std::vector<std::optional<Rigid>>>& poses);

}  // namespace rig::host
