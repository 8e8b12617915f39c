// The ways to infer unseen markers from trained marker sets, behind one door each: the device's closed form,
// the source's iteration, and a closed form that goes through the levels one after the other.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "core/infer/inference.hpp"
#include "core/infer/motion_propagation.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/marker_set_training.hpp"

namespace rig::host {

// Trained sets of a layout, as a pack holds them. Not to be copied: the pack's spans point into the sets.
class SetsOfFace {
  public:
    SetsOfFace(const MarkerLayout& layout, const MarkerModel& model, const ExpressionSpread& spread,
               double noise_mm, const MarkerSetOptions& options = {});
    SetsOfFace(const SetsOfFace&) = delete;
    SetsOfFace& operator=(const SetsOfFace&) = delete;

    [[nodiscard]] const SolvePack& pack() const { return pack_; }
    [[nodiscard]] std::span<const MarkerSetModel> sets() const {
        return std::span(pack_.marker_sets).first(pack_.marker_set_count);
    }
    [[nodiscard]] std::size_t marker_count() const { return pack_.marker_count; }
    [[nodiscard]] Vec3 neutral_mm(std::size_t marker) const;
    [[nodiscard]] Vec3 mean_mm(std::size_t marker) const;  // neutral and the whole face's mean displacement

  private:
    std::vector<float> neutral_mm_;
    std::vector<TrainedMarkerSet> sets_;
    SolvePack pack_;
};

// positions_mm [m], face frame; hidden [m]. Each completes the hidden ones in place.

// What the device does: core/infer/inference.hpp.
class ClosedForm {
  public:
    explicit ClosedForm(const SetsOfFace& face);
    const InferenceOutput& complete(std::span<const Vec3> positions_mm, std::span<const char> hidden);

  private:
    double information_;
    std::unique_ptr<FaceGaussian> gaussian_ = std::make_unique<FaceGaussian>();
    std::unique_ptr<InferenceWorkspace> workspace_ = std::make_unique<InferenceWorkspace>();
    std::unique_ptr<StabiliserOutput> input_ = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceOutput> output_ = std::make_unique<InferenceOutput>();
};

// What the source does: core/infer/motion_propagation.hpp.
class Propagation {
  public:
    explicit Propagation(const SetsOfFace& face, PropagationConfig config = {})
        : face_(face), config_(config) {
        prepare_propagation(face.sets(), *workspace_);
    }
    PropagationReport complete(std::span<Vec3> positions_mm, std::span<const char> hidden);

  private:
    const SetsOfFace& face_;
    PropagationConfig config_;
    std::unique_ptr<PropagationWorkspace> workspace_ = std::make_unique<PropagationWorkspace>();
};

// Every set's coefficients in closed form, the whole face first, then each set of the next level on what is
// left of the seen markers, at most `most_modes` of a set. Where sets of a level overlap their answers are
// averaged.
void complete_by_levels(const SetsOfFace& face, std::size_t most_modes, double noise_mm,
                        std::span<Vec3> positions_mm, std::span<const char> hidden);

}  // namespace rig::host
