#include "firmware_host/companion/experiments/identity_run.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

void IdentityFigures::add(const IdentityFigures& other) {
    frames += other.frames;
    visible += other.visible;
    right += other.right;
    wrong += other.wrong;
    ghosts += other.ghosts;
    ghosts_taken += other.ghosts_taken;
    longest_wrong_frames = std::max(longest_wrong_frames, other.longest_wrong_frames);
    converged_wrong += other.converged_wrong;
}

double IdentityFigures::right_share() const {
    return visible == 0 ? 0.0 : static_cast<double>(right) / static_cast<double>(visible);
}

IdentityRun::IdentityRun(const SolvePack& pack, const TrackerConfig& config) : pack_(pack), config_(config) {
    const auto scratch = std::make_unique<ShapeModelWorkspace>();
    build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma, *scratch, *model_);
}

void IdentityRun::restart() {
    reset_tracker(*state_);
    for (auto& view : wrong_run_) view.fill(0);
}

void IdentityRun::begin_frame() {
    sightings_->clear();
    for (auto& view : truth_) view.clear();
}

void IdentityRun::add_points(std::span<const Vec3> points_mm, std::span<const int> truth) {
    truth_[sightings_->view_count].assign(truth.begin(), truth.end());
    add_point_view(points_mm, static_cast<double>(pack_.noise_mm), *sightings_);
}

void IdentityRun::add_view(std::size_t camera, std::span<const Observation> observations,
                           std::span<const int> truth) {
    truth_[sightings_->view_count].assign(truth.begin(), truth.end());
    const CameraModel& model = pack_.cameras[camera];
    add_camera_view(model, observations, kCentreSigmaPx, model.centre_mm.norm(), *sightings_);
}

void IdentityRun::name_view(std::size_t view) {
    names_[view].assign(truth_[view].size(), -1);
    for (std::size_t k = 0; k < pack_.marker_count; ++k) {
        const std::int16_t at = report_->matches[view][k];
        if (at < 0) continue;
        names_[view][sightings_->source[view][static_cast<std::size_t>(at)]] = static_cast<int>(k);
    }
}

void IdentityRun::count_view(std::size_t view, IdentityFigures& frame) {
    for (const std::uint16_t slot : sightings_->source[view]) {
        const int truth = truth_[view][slot];
        const int name = names_[view][slot];
        if (truth < 0) {
            ++frame.ghosts;
            frame.ghosts_taken += name >= 0 ? 1U : 0U;
            continue;
        }
        ++frame.visible;
        frame.right += name == truth ? 1U : 0U;
        frame.wrong += name >= 0 && name != truth ? 1U : 0U;
    }
}

void IdentityRun::count_runs(std::size_t view) {
    std::array<bool, kMaxMarkers> wrong{};
    for (std::size_t i = 0; i < names_[view].size(); ++i) {
        const int name = names_[view][i];
        if (name >= 0 && name != truth_[view][i]) wrong[static_cast<std::size_t>(name)] = true;
    }
    for (std::size_t k = 0; k < pack_.marker_count; ++k) {
        std::size_t& run = wrong_run_[view][k];
        run = wrong[k] ? run + 1 : 0;
        figures_.longest_wrong_frames = std::max(figures_.longest_wrong_frames, run);
        figures_.converged_wrong += run == kPassingFrames + 1 ? 1U : 0U;
    }
}

void IdentityRun::check(std::span<const Vec3> labelled_mm) {
    check_names(*model_, config_, labelled_mm, static_cast<double>(pack_.noise_mm), *state_, *workspace_,
                *sightings_, *named_, *report_);
}

void IdentityRun::exchange_memories(std::size_t a, std::size_t b) {
    std::swap(state_->position_mm[a], state_->position_mm[b]);
    std::swap(state_->velocity_mm[a], state_->velocity_mm[b]);
    std::swap(state_->bias_mm[a], state_->bias_mm[b]);
    std::swap(state_->missed[a], state_->missed[b]);
}

IdentityFigures IdentityRun::track(bool count) {
    rig::track(*model_, config_, *sightings_, *state_, *workspace_, *named_, *report_);
    IdentityFigures frame;
    frame.frames = 1;
    for (std::size_t view = 0; view < sightings_->view_count; ++view) {
        name_view(view);
        count_view(view, frame);
        if (count) {
            count_runs(view);
        } else {
            wrong_run_[view].fill(0);
        }
    }
    if (count) figures_.add(frame);
    return frame;
}

}  // namespace rig::host
