// Sightings of the recorded takes with their truth, as a mocap system or two helmet cameras would hand them
// to the tracker: posed, noisy, with dropouts in bursts and ghosts. Cameras see through the simulated
// world's projection, which shares no code with core's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/experiments/identity_run.hpp"
#include "firmware_host/companion/experiments/marker_dropout.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/companion/train/white_noise.hpp"
#include "firmware_host/companion/world/helmet.hpp"

namespace rig::host {

struct IdentityScene {
    RecordedHead head;
    std::vector<HelmetCamera> helmet;  // the default two
    TrainedPack pack;                  // without a take, with the helmet's cameras
    SolvePack view;                    // of pack
};

// 60 markers. On the heap: `view` points into the scene.
[[nodiscard]] Result<std::unique_ptr<IdentityScene>, FileError> load_identity_scene(
    const std::filesystem::path& data);

// One axis in any direction, the angle even in +-rotation_rad; even in +-translation_mm along each axis.
[[nodiscard]] Rigid random_pose(double rotation_rad, double translation_mm, WhiteNoise& random);

struct SightingOptions {
    double dropout = 0.05;          // of each marker in each view, in bursts of 4 to 30 frames
    double ghosts_per_frame = 0.6;  // in each view
    double noise_mm = 0.1;
    double noise_px = 0.1;
    bool cameras = false;  // else one cloud of points
};

class SightingSource {
  public:
    // The scene outlives the source. Deterministic from the seed.
    SightingSource(const IdentityScene& scene, const SightingOptions& options, std::size_t frames,
                   std::uint64_t seed);

    // Frame `at` (< frames) of the run: begins it and adds the views of a take's frame at this pose.
    void add_frame(std::size_t at, const Take& take, std::size_t take_frame, const Rigid& pose,
                   IdentityRun& run);

  private:
    void add_cloud(std::size_t at, std::span<const Vec3> markers_mm, IdentityRun& run);
    void add_camera(std::size_t at, std::size_t camera, std::span<const Vec3> markers_mm, const Rigid& pose,
                    IdentityRun& run);
    [[nodiscard]] std::size_t ghost_count();

    const IdentityScene& scene_;
    SightingOptions options_;
    WhiteNoise random_;
    std::vector<DropoutMask> masks_;  // of each view
};

// neutral + B w of one frame of a take, face frame.
[[nodiscard]] std::vector<Vec3> face_markers(const MarkerModel& model, const Take& take, std::size_t frame);

// On the neutral face.
[[nodiscard]] std::size_t nearest_neighbour(const MarkerLayout& layout, std::size_t marker);

}  // namespace rig::host
