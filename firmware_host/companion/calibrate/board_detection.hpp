// Finds the board in one picture, to hundredths of a pixel, and says how sharp the picture is.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/image/view.hpp"
#include "firmware_host/companion/calibrate/board.hpp"

namespace rig::host {

struct BoardSighting {
    std::vector<std::size_t> points;  // numbers of board_points(), rising, each once
    std::vector<double> x_px;         // of point i: a corner, or the centroid of a circle's picture
    std::vector<double> y_px;
    double edge_sigma_px = 0.0;  // blur of the board's edges as a standard deviation, median over the points
    std::string fault;           // why nothing was found; empty when something was
};

// Any picture is safe. ChArUco boards may be seen in part; of circles all must be seen.
[[nodiscard]] BoardSighting find_board(const ImageView& image, const BoardSpec& board);

}  // namespace rig::host
