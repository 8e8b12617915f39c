// A run of the world as files: pictures, cameras.json and truth.csv, in the layout of the reference images.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "firmware_host/companion/world/truth_recorder.hpp"
#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

struct ImageOptions {
    bool png = false;      // else PGM
    std::size_t step = 1;  // every step-th frame
    std::size_t threads = 2;
    std::string layout{};  // as named on the command line, for cameras.json
    CameraControl control{};
};

// Called after each frame from any rendering thread, one call at a time; false stops the run.
using ImageProgress = std::function<bool(std::uint64_t frames_done)>;

// Writes f<frame of the take, 5 digits>_<camera>.pgm. `truth` may be null. Returns the number of images.
[[nodiscard]] Result<std::size_t, FileError> write_world_images(const World& world,
                                                                const std::filesystem::path& folder,
                                                                const ImageOptions& options,
                                                                TruthRecorder* truth,
                                                                const ImageProgress& progress);

}  // namespace rig::host
