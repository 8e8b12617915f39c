#include "firmware_host/companion/world/truth_recorder.hpp"

#include <fmt/format.h>

#include <limits>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

TruthRecorder::TruthRecorder(const World& world) : world_(world) {
    const std::size_t sights = world.frame_count() * world.cameras().size() * world.marker_count();
    projections_.reserve(3 * sights);
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < sights; ++i)
        projections_.insert(projections_.end(), {kUnknown, kUnknown, -1.0F});
    dots_.assign(4 * sights, kUnknown);
}

void TruthRecorder::add(std::size_t frame, const std::vector<MarkerSight>& sights) {
    const std::lock_guard lock(mutex_);
    const std::size_t first = frame * world_.cameras().size() * world_.marker_count();
    for (std::size_t i = 0; i < sights.size(); ++i) {
        const MarkerSight& sight = sights[i];
        float* projection = projections_.data() + 3 * (first + i);
        projection[0] = static_cast<float>(sight.x_px);
        projection[1] = static_cast<float>(sight.y_px);
        projection[2] = sight.visible ? 1.0F : 0.0F;
        float* dot_here = dots_.data() + 4 * (first + i);
        dot_here[0] = static_cast<float>(sight.dot_x_px);
        dot_here[1] = static_cast<float>(sight.dot_y_px);
        dot_here[2] = static_cast<float>(sight.dot_area_px);
        dot_here[3] = static_cast<float>(sight.cos_view);
    }
}

Result<void, FileError> TruthRecorder::save(const std::filesystem::path& folder) const {
    const std::lock_guard lock(mutex_);
    if (auto made = make_folder(folder); !made) return made;
    if (auto saved = save_motion(folder); !saved) return saved;
    const std::size_t cameras = world_.cameras().size();
    NpyArray<float> projections{{world_.frame_count(), cameras, world_.marker_count(), 3}, projections_};
    if (auto saved = write_npy(folder / "truth_projections.npy", projections); !saved) return saved;
    NpyArray<float> dots{{world_.frame_count(), cameras, world_.marker_count(), 4}, dots_};
    return write_npy(folder / "truth_dots.npy", dots);
}

Result<void, FileError> TruthRecorder::save_motion(const std::filesystem::path& folder) const {
    NpyArray<float> headset{{world_.frame_count(), world_.marker_count(), 3}, {}};
    NpyArray<float> face = headset;
    Take weights{world_.shape_names(), world_.config().rate_hz, world_.frame_count(), {}};
    CsvWriter slip({"frame", "time_s", "rx_rad", "ry_rad", "rz_rad", "tx_mm", "ty_mm", "tz_mm"});
    for (std::size_t frame = 0; frame < world_.frame_count(); ++frame) {
        const FrameTruth truth = world_.truth(frame);
        for (std::size_t m = 0; m < world_.marker_count(); ++m) {
            for (std::size_t k = 0; k < 3; ++k) {
                headset.values.push_back(static_cast<float>(truth.headset_mm[m][k]));
                face.values.push_back(static_cast<float>(truth.face_mm[m][k]));
            }
        }
        weights.weights.insert(weights.weights.end(), truth.weights.begin(), truth.weights.end());
        slip.integer(static_cast<std::int64_t>(frame))
            .number(static_cast<double>(frame) / world_.config().rate_hz, 6);
        for (const double r : truth.slip.rotation_rad) slip.number(r, 9);
        for (const double t : truth.slip.translation_mm) slip.number(t, 6);
        slip.end_row();
    }
    if (auto saved = write_npy(folder / "truth_markers.npy", headset); !saved) return saved;
    if (auto saved = write_npy(folder / "truth_face.npy", face); !saved) return saved;
    if (auto saved = save_take(folder / "truth_weights.csv", weights); !saved) return saved;
    return slip.save(folder / "truth_slip.csv");
}

}  // namespace rig::host
