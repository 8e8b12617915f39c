// The two pictures of a demo: what the cameras saw with detections and names, and true against solved curves.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

// Detects and names the markers of `frame` as the daemon does, from a run-up of a few frames before it, and
// draws: ring = detection, label = name it was given, cross = where the marker truly is, square = a detection
// without a name.
[[nodiscard]] Result<void, FileError> draw_overlay(const std::filesystem::path& path, const World& world,
                                                   const SolvePack& pack, std::size_t frame);

struct Curve {
    std::string name;
    std::vector<double> truth;   // per frame of the world
    std::vector<double> solved;  // NaN where nothing was received or nothing stands behind it
    double rms = 0.0;
};

// One panel a curve, time in seconds along, weight 0..1 up.
[[nodiscard]] Result<void, FileError> draw_curves(const std::filesystem::path& path,
                                                  const std::vector<Curve>& curves, double rate_hz,
                                                  const std::string& title);

}  // namespace rig::host
