// What cameras see of a board, computed instead of drawn, and streams that play what a test gives them.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/math.hpp"
#include "core/geometry/camera_model.hpp"
#include "firmware_host/companion/calibrate/board_detection.hpp"
#include "firmware_host/companion/capture/live_cameras.hpp"
#include "firmware_host/companion/capture/picture_stream.hpp"

namespace rig::test {

inline host::BoardSighting computed_sighting(const host::BoardSpec& board, const CameraModel& camera,
                                             const Rigid& pose) {
    host::BoardSighting sighting;
    sighting.edge_sigma_px = 0.7;
    const std::vector<host::BoardPoint> points = host::board_points(board);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Projection at = project(camera, pose.apply(Vec3{points[i].x_mm, points[i].y_mm, 0.0}));
        if (!(at.z_mm > 0.0) || at.pixel[0] < 0.0 || at.pixel[1] < 0.0 ||
            at.pixel[0] > camera.width_px - 1.0 || at.pixel[1] > camera.height_px - 1.0) {
            continue;
        }
        sighting.points.push_back(i);
        sighting.x_px.push_back(at.pixel[0]);
        sighting.y_px.push_back(at.pixel[1]);
    }
    return sighting;
}

// A board square to a camera that looks along +z from the origin, its middle at `at_mm`, then turned about
// its middle by `turn_rad` (camera axes).
inline Rigid board_before_camera(const host::BoardSpec& board, const Vec3& at_mm, const Vec3& turn_rad) {
    const Vec3 middle{0.5 * host::board_width_mm(board), 0.5 * host::board_height_mm(board), 0.0};
    const Mat3 rotation = rotation_from_vector(turn_rad);
    return {rotation, at_mm - rotation * middle};
}

struct Played {
    std::int64_t time_us = 0;
    host::GreyImage image;
};

class PlayedStream final : public host::PictureStream {
  public:
    PlayedStream(std::vector<Played> pictures, host::StreamEnd last)
        : pictures_(std::move(pictures)), last_(last) {}
    Result<host::LivePicture, host::StreamEnd> picture_after(std::int64_t after_us, std::int64_t) override {
        for (const Played& each : pictures_)
            if (each.time_us > after_us) return host::LivePicture{each.image, each.time_us};
        over_ = true;
        return failure(last_);
    }
    std::string fault() const override { return over_ && last_ == host::StreamEnd::kGone ? "unplugged" : ""; }
    bool is_recording() const override { return true; }

  private:
    std::vector<Played> pictures_;
    host::StreamEnd last_;
    bool over_ = false;
};

inline std::vector<Played> blank_pictures(const std::vector<std::int64_t>& times_us) {
    std::vector<Played> out;
    for (const std::int64_t time_us : times_us)
        out.push_back({time_us, {16, 16, std::vector<std::uint8_t>(256, 90)}});
    return out;
}

inline host::LiveCameras played_cameras(std::vector<std::vector<Played>> streams,
                                        host::StreamEnd last = host::StreamEnd::kEnded) {
    std::vector<std::unique_ptr<host::PictureStream>> out;
    for (auto& each : streams) out.push_back(std::make_unique<PlayedStream>(std::move(each), last));
    return host::LiveCameras(std::move(out));
}

}  // namespace rig::test
