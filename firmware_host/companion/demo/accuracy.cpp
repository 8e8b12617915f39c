#include "firmware_host/companion/demo/accuracy.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace rig::host {

namespace {

// Two markers of pressed lips come this close; only a marker farther than this from its own place can be on
// another's.
constexpr double kOwnPlaceMm = 2.0;

double squared_distance_mm2(const Vec3d& truth, const std::array<float, 3>& measured) {
    const double dx = truth[0] - static_cast<double>(measured[0]);
    const double dy = truth[1] - static_cast<double>(measured[1]);
    const double dz = truth[2] - static_cast<double>(measured[2]);
    return dx * dx + dy * dy + dz * dz;
}

}  // namespace

Accuracy::Accuracy(const World& world, const MarkerModel& model) : world_(world) {
    const std::size_t shapes = world.shape_names().size();
    const std::size_t rows = model.neutral_mm.size();
    column_mm_.assign(shapes, 0.0);
    shape_squares_.assign(shapes, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < shapes; ++i) {
            const auto entry = static_cast<double>(model.basis_mm[r * shapes + i]);
            column_mm_[i] += entry * entry;
        }
    }
    for (double& column : column_mm_) column = std::sqrt(column);
}

void Accuracy::add_state(std::size_t frame, const FaceState& state) {
    if (state.held || state.shape_count != column_mm_.size()) {
        ++held_;
        return;
    }
    const std::vector<float> truth = world_.weights(frame);
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < column_mm_.size(); ++i) {
        const double e = static_cast<double>(state.weights[i]) - static_cast<double>(truth[i]);
        shape_squares_[i] += e * e;
        if (!observable(i)) continue;
        sum += e * e;
        ++count;
    }
    ++judged_;
    if (count > 0) worst_frame_ = std::max(worst_frame_, std::sqrt(sum / static_cast<double>(count)));
}

bool Accuracy::names_another(const FrameTruth& truth, std::size_t marker, const MarkerSample& sample) const {
    const double own = squared_distance_mm2(truth.headset_mm[marker], sample.position_mm);
    if (own <= kOwnPlaceMm * kOwnPlaceMm) return false;
    for (std::size_t k = 0; k < truth.headset_mm.size(); ++k) {
        if (k != marker && squared_distance_mm2(truth.headset_mm[k], sample.position_mm) < own) return true;
    }
    return false;
}

void Accuracy::add_markers(std::size_t frame, const MarkerFrame& markers) {
    const FrameTruth truth = world_.truth(frame);
    const std::size_t wanted_views = std::min<std::size_t>(2, world_.cameras().size());
    const std::size_t count = std::min<std::size_t>(markers.marker_count, truth.headset_mm.size());
    for (std::size_t k = 0; k < count; ++k) {
        const MarkerSample& sample = markers.markers[k];
        if (!sample.seen) continue;
        if (names_another(truth, k, sample)) ++identity_errors_;
        if (sample.views < wanted_views) continue;
        marker_squares_mm2_ += squared_distance_mm2(truth.headset_mm[k], sample.position_mm);
        ++markers_;
    }
}

AccuracyFigures Accuracy::figures() const {
    AccuracyFigures figures;
    figures.frames_judged = judged_;
    figures.frames_held = held_;
    figures.worst_frame_weight_rms = worst_frame_;
    figures.markers_judged = markers_;
    figures.identity_errors = identity_errors_;
    double sum = 0.0;
    for (std::size_t i = 0; i < column_mm_.size(); ++i) {
        const double mean = judged_ == 0 ? 0.0 : shape_squares_[i] / static_cast<double>(judged_);
        figures.shape_rms.push_back(std::sqrt(mean));
        if (!observable(i)) continue;
        ++figures.observable_shapes;
        sum += mean;
    }
    if (figures.observable_shapes > 0)
        figures.weight_rms = std::sqrt(sum / static_cast<double>(figures.observable_shapes));
    if (markers_ > 0) figures.marker_rms_mm = std::sqrt(marker_squares_mm2_ / static_cast<double>(markers_));
    return figures;
}

}  // namespace rig::host
