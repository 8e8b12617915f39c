// The simulated world: a performance on a painted head, seen by the cameras of a helmet, with its truth. It
// is the oracle that core is judged by, and shares no camera or geometry code with it. What it is not: a
// clock or a link; see world_server.hpp.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/world/helmet.hpp"
#include "firmware_host/companion/world/lighting.hpp"
#include "firmware_host/companion/world/painted_face.hpp"
#include "firmware_host/companion/world/rasteriser.hpp"
#include "firmware_host/companion/world/sensor.hpp"
#include "firmware_host/companion/world/slip_motion.hpp"

namespace rig::host {

struct WorldConfig {
    std::vector<HelmetCamera> cameras = default_helmet(2);  // 1..4, one image size
    DotStyle style = DotStyle::kInk;
    double dot_radius_mm = 1.9;  // 0.3 .. 6, on the neutral skin
    SlipKind slip = SlipKind::kGentle;
    std::uint64_t seed = 1;
    double rate_hz = 60.0;        // 1 .. 1000; the take is resampled to it, linearly
    std::size_t start_frame = 0;  // of the take, at its own rate
    std::size_t frame_count = 0;  // at rate_hz; 0: to the end of the take
    double defocus_px = 0.7;      // standard deviation of the blur
    double vignetting = 0.35;     // loss in the corner, 0..1
    double noise = 1.0;           // factor on shot and read noise, 0 = none
};

struct FrameTruth {
    std::vector<float> weights;  // rig order
    HeadsetSlip slip;
    std::vector<Vec3d> face_mm;     // markers, neutral + B w
    std::vector<Vec3d> headset_mm;  // the same with slip: what the cameras look at
};

// One marker in one image. Integers are pixel centres.
struct MarkerSight {
    double x_px = 0.0;  // projected centre, whether or not something is in front of it
    double y_px = 0.0;
    double dot_x_px = 0.0;  // area centroid of the dot's visible part; NaN when none of it is
    double dot_y_px = 0.0;
    double dot_area_px = 0.0;
    double cos_view = 0.0;  // between the skin's normal and the direction to the camera
    bool visible = false;   // the centre is in the image, faces the camera and nothing hides it
};

class World {
  public:
    // Refuses, with the fault: no markers, more than kMaxMarkers, indices out of range, a start beyond the
    // take, a camera list that is empty or mixes sizes, numbers out of their stated ranges.
    [[nodiscard]] static Result<std::unique_ptr<World>, FileError> create(const Rig& rig,
                                                                          const MarkerLayout& layout,
                                                                          const Take& take,
                                                                          const WorldConfig& config);

    [[nodiscard]] const WorldConfig& config() const { return config_; }
    [[nodiscard]] const std::vector<HelmetCamera>& cameras() const { return config_.cameras; }
    [[nodiscard]] std::size_t frame_count() const { return frame_count_; }
    [[nodiscard]] std::size_t marker_count() const { return face_.dots().size(); }
    [[nodiscard]] std::size_t image_bytes() const;
    [[nodiscard]] const PaintedFace& face() const { return face_; }
    [[nodiscard]] const std::vector<std::string>& marker_names() const { return marker_names_; }
    [[nodiscard]] const std::vector<std::string>& shape_names() const { return shape_names_; }
    // Frame of the take that is nearest to a frame of the world.
    [[nodiscard]] std::size_t take_frame(std::size_t frame) const;

    // frame < frame_count(). Pure: any thread, any order.
    [[nodiscard]] std::vector<float> weights(std::size_t frame) const;
    [[nodiscard]] HeadsetSlip slip(std::size_t frame) const;
    [[nodiscard]] FrameTruth truth(std::size_t frame) const;
    // Slip and camera in one: X_cam = rotation X_face + offset.
    [[nodiscard]] FaceView view(std::size_t frame, std::size_t camera) const;

  private:
    World(const Rig& rig, const MarkerLayout& layout, const Take& take, const WorldConfig& config);

    WorldConfig config_;
    PaintedFace face_;
    Take take_;
    std::vector<std::string> marker_names_;
    std::vector<std::string> shape_names_;
    SlipMotion motion_;
    std::size_t frame_count_ = 0;
};

// Draws frames of a world. One per thread; equal calls give equal bytes whichever renderer makes them.
class WorldRenderer {
  public:
    explicit WorldRenderer(const World& world);

    // image: World::image_bytes() bytes, rows without gaps. sights: empty, or marker_count() entries to fill.
    // The pose is kept between calls for the same frame.
    void render(std::size_t frame, std::size_t camera, const CameraControl& control,
                std::span<std::uint8_t> image, std::span<MarkerSight> sights = {});

  private:
    struct DotSum {
        double area = 0.0, x = 0.0, y = 0.0;
        float retro_dn = 0.0F;
    };

    void pose(std::size_t frame);
    void prepare_dots();
    void shade(const PixelGrid& grid);
    // Radiance of a pixel whose triangle may carry dots; adds the pixel to those dots' sums.
    [[nodiscard]] float paint(const PixelGrid& grid, int column, int row, std::uint32_t index, float skin_dn);
    void report(std::size_t camera, std::span<MarkerSight> sights) const;
    [[nodiscard]] bool unhidden(std::size_t marker, const PixelAt& at, std::size_t camera) const;

    const World& world_;
    Lighting lighting_;
    std::vector<PixelGrid> grids_;
    std::vector<Sensor> sensors_;
    PosedFace posed_;
    std::size_t posed_frame_;
    FrameTruth truth_;
    FaceView view_;
    SeenVertices seen_;
    SeenSurface surface_;
    Radiance radiance_;
    std::vector<DotSum> dots_;
    std::vector<double> cos_view_;
};

}  // namespace rig::host
