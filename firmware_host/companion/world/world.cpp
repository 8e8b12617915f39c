#include "firmware_host/companion/world/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/limits.hpp"

namespace rig::host {

namespace {

std::string fault_of_config(const WorldConfig& config) {
    if (config.cameras.empty() || config.cameras.size() > kMaxCameras) {
        return fmt::format("{} cameras; a helmet has 1 to {}", config.cameras.size(), kMaxCameras);
    }
    for (const HelmetCamera& camera : config.cameras) {
        if (camera.width_px != config.cameras[0].width_px ||
            camera.height_px != config.cameras[0].height_px) {
            return "cameras differ in image size";
        }
    }
    const auto outside = [](double value, double low, double high) {
        return !(value >= low && value <= high);
    };
    if (outside(config.dot_radius_mm, 0.3, 6.0)) return "the dot radius must be 0.3 to 6 mm";
    if (outside(config.rate_hz, 1.0, 1000.0)) return "the rate must be 1 to 1000 Hz";
    if (outside(config.defocus_px, 0.0, 3.0)) return "the defocus must be 0 to 3 px";
    if (outside(config.vignetting, 0.0, 1.0)) return "the vignetting must be 0 to 1";
    if (outside(config.noise, 0.0, 100.0)) return "the noise factor must be 0 to 100";
    return {};
}

std::string fault_of_head(const Rig& rig, const MarkerLayout& layout, const Take& take,
                          const WorldConfig& config) {
    if (layout.markers.empty() || layout.markers.size() > kMaxMarkers) {
        return fmt::format("{} markers; a layout has 1 to {}", layout.markers.size(), kMaxMarkers);
    }
    const auto bad = [&](std::int32_t v) {
        return v < 0 || static_cast<std::size_t>(v) >= rig.vertices_mm.size();
    };
    if (rig.triangle_part.size() != rig.triangles.size())
        return "triangle parts and triangles differ in number";
    for (const Int3& t : rig.triangles) {
        if (bad(t[0]) || bad(t[1]) || bad(t[2])) return "a triangle names a vertex that is not there";
    }
    for (const SparseShape& shape : rig.shapes) {
        if (shape.vertices.size() != shape.delta_mm.size()) return "shape " + shape.name + " is inconsistent";
        if (std::any_of(shape.vertices.begin(), shape.vertices.end(), bad)) {
            return "shape " + shape.name + " names a vertex that is not there";
        }
    }
    for (const LayoutMarker& marker : layout.markers) {
        if (std::any_of(marker.vertices.begin(), marker.vertices.end(), bad)) {
            return "marker " + marker.name + " names a vertex that is not there";
        }
    }
    if (take.weights.size() != take.frame_count * rig.shapes.size())
        return "the take does not fit the rig's shapes";
    if (!(take.rate_hz > 0.0)) return "the take's rate must be positive";
    if (config.start_frame >= take.frame_count) {
        return fmt::format("start frame {} is beyond the take's {} frames", config.start_frame,
                           take.frame_count);
    }
    return {};
}

}  // namespace

Result<std::unique_ptr<World>, FileError> World::create(const Rig& rig, const MarkerLayout& layout,
                                                        const Take& take, const WorldConfig& config) {
    for (const std::string& fault : {fault_of_config(config), fault_of_head(rig, layout, take, config)}) {
        if (!fault.empty()) return failure(FileError{"world: " + fault});
    }
    std::unique_ptr<World> world(new World(rig, layout, take, config));
    if (world->frame_count_ == 0) return failure(FileError{"world: no frame to show"});
    return world;
}

World::World(const Rig& rig, const MarkerLayout& layout, const Take& take, const WorldConfig& config)
    : config_(config),
      face_(rig, layout, config.dot_radius_mm, config.seed),
      take_(take),
      motion_(config.slip, config.seed) {
    for (const LayoutMarker& marker : layout.markers) marker_names_.push_back(marker.name);
    for (const SparseShape& shape : rig.shapes) shape_names_.push_back(shape.name);
    const auto left = static_cast<double>(take.frame_count - config.start_frame - 1);
    const auto available =
        static_cast<std::size_t>(std::floor(left * config.rate_hz / take.rate_hz + 1e-6)) + 1;
    frame_count_ = config.frame_count == 0 ? available : std::min(available, config.frame_count);
}

std::size_t World::image_bytes() const {
    return static_cast<std::size_t>(config_.cameras[0].width_px) *
           static_cast<std::size_t>(config_.cameras[0].height_px);
}

std::size_t World::take_frame(std::size_t frame) const {
    const double at = static_cast<double>(frame) * take_.rate_hz / config_.rate_hz;
    return std::min(config_.start_frame + static_cast<std::size_t>(at + 0.5), take_.frame_count - 1);
}

std::vector<float> World::weights(std::size_t frame) const {
    const double at = static_cast<double>(config_.start_frame) +
                      static_cast<double>(frame) * take_.rate_hz / config_.rate_hz;
    const auto before = std::min(static_cast<std::size_t>(at + 1e-6), take_.frame_count - 1);
    const auto after = std::min(before + 1, take_.frame_count - 1);
    const float part = static_cast<float>(std::max(0.0, at - static_cast<double>(before)));
    const std::size_t shapes = face_.shape_count();
    std::vector<float> mixed(shapes);
    for (std::size_t s = 0; s < shapes; ++s) {
        const float a = take_.weights[before * shapes + s];
        mixed[s] = a + part * (take_.weights[after * shapes + s] - a);
    }
    return mixed;
}

HeadsetSlip World::slip(std::size_t frame) const {
    return motion_.at(static_cast<double>(frame) / config_.rate_hz);
}

FrameTruth World::truth(std::size_t frame) const {
    FrameTruth truth;
    truth.weights = weights(frame);
    truth.slip = slip(frame);
    for (std::size_t m = 0; m < marker_count(); ++m) {
        truth.face_mm.push_back(face_.marker_mm(m, truth.weights));
        truth.headset_mm.push_back(truth.slip.apply(truth.face_mm.back()));
    }
    return truth;
}

FaceView World::view(std::size_t frame, std::size_t camera) const {
    const HelmetCamera& eye = config_.cameras[camera];
    const HeadsetSlip moved = slip(frame);
    return {multiply(eye.rotation, rotation_by(moved.rotation_rad)),
            multiply(eye.rotation, moved.translation_mm - eye.centre_mm)};
}

}  // namespace rig::host
