// Collects what the world knows about a run and writes it as the truth folder that README.md describes.
#pragma once

#include <filesystem>
#include <mutex>
#include <vector>

#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

// The one place where several rendering threads meet: add() locks.
class TruthRecorder {
  public:
    explicit TruthRecorder(const World& world);

    // sights: camera_count * marker_count, cameras outermost.
    void add(std::size_t frame, const std::vector<MarkerSight>& sights);
    // Markers, weights and slip of every frame of the world; projections of the frames that were added, -1 in
    // place of `visible` for the others.
    [[nodiscard]] Result<void, FileError> save(const std::filesystem::path& folder) const;

  private:
    [[nodiscard]] Result<void, FileError> save_motion(const std::filesystem::path& folder) const;

    const World& world_;
    mutable std::mutex mutex_;
    std::vector<float> projections_;  // frames, cameras, markers, (x, y, visible)
    std::vector<float> dots_;         // frames, cameras, markers, (x, y, area, cos_view)
};

}  // namespace rig::host
