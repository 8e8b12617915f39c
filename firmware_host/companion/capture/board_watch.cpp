#include "firmware_host/companion/capture/board_watch.hpp"

#include <cmath>

namespace rig::host {

std::optional<double> sighting_distance_px(const BoardSighting& a, const BoardSighting& b,
                                           std::size_t least) {
    double sum = 0.0;
    std::size_t common = 0;
    for (std::size_t i = 0, j = 0; i < a.points.size() && j < b.points.size();) {
        if (a.points[i] < b.points[j]) {
            ++i;
        } else if (a.points[i] > b.points[j]) {
            ++j;
        } else {
            const double x = a.x_px[i] - b.x_px[j];
            const double y = a.y_px[i] - b.y_px[j];
            sum += x * x + y * y;
            ++common;
            ++i;
            ++j;
        }
    }
    if (common < least || common == 0) return std::nullopt;
    return std::sqrt(sum / static_cast<double>(common));
}

BoardMotion BoardWatch::push(std::int64_t time_us, const BoardSighting& sighting) {
    if (sighting.points.size() < config_.least_points) {
        rest_.reset();
        return BoardMotion::kUnseen;
    }
    const auto moved = rest_ ? sighting_distance_px(*rest_, sighting, config_.least_points) : std::nullopt;
    const bool rests = moved && *moved <= config_.most_move_px && time_us - last_us_ <= config_.most_gap_us;
    last_us_ = time_us;
    if (!rests) {
        rest_ = sighting;
        rest_us_ = time_us;
        moments_ = 1;
        return BoardMotion::kMoving;
    }
    ++moments_;
    const bool long_enough = time_us - rest_us_ >= config_.hold_us && moments_ >= config_.least_moments;
    return long_enough ? BoardMotion::kStill : BoardMotion::kMoving;
}

}  // namespace rig::host
