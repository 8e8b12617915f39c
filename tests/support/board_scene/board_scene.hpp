// Pictures of a calibration board through cameras whose every number is known. The lenses are written here a
// second time, from the published formulas, so that core's are judged and not repeated.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "firmware_host/companion/calibrate/board.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

struct BoardLook {
    double blur_px = 0.6;   // standard deviation of defocus
    double smear_px = 0.0;  // standard deviation of motion along x
    double noise_dn = 2.0;  // standard deviation of a pixel
    double uneven = 0.3;    // share of light lost from one corner to the other
};

// Draws what one camera sees of one board: 4 x 4 samples a pixel of a board printed at 20 px/mm or finer.
class BoardScene {
  public:
    BoardScene(const host::BoardSpec& board, const CameraModel& camera);

    // Draws differ by `random` alone. rig_from_board: board frame (z into the paper) to the camera's headset
    // frame.
    [[nodiscard]] host::GreyImage draw(const Rigid& rig_from_board, const BoardLook& look,
                                       SeededRandom& random) const;

  private:
    [[nodiscard]] double paper_at(double x_mm, double y_mm) const;

    host::BoardSpec board_;
    CameraModel camera_;
    double px_per_mm_;
    host::GreyImage print_;
    std::vector<float> slope_x_;  // X/Z of every sample
    std::vector<float> slope_y_;
};

// Four helmet cameras, as far apart and aimed as the simulated helmet's, no two lenses alike.
[[nodiscard]] std::vector<CameraModel> board_rig(LensModel lens, std::size_t camera_count);

// Poses of a board that is waved before the rig: at most tilt_rad about any axis in the paper.
[[nodiscard]] std::vector<Rigid> waved_board(const host::BoardSpec& board, std::size_t count, double tilt_rad,
                                             SeededRandom& random);

}  // namespace rig::test
