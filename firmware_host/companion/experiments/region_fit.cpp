#include "firmware_host/companion/experiments/region_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/base/float_kernels.hpp"
#include "core/solve/regional.hpp"
#include "firmware_host/companion/train/regional_training.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::array<std::size_t, 3> kAllAxes{0, 1, 2};

// Core's regional solver without a pack file. Not to be copied: the pack's spans point into the regions.
class RegionSolve {
  public:
    RegionSolve(const RecordedHead& head, const std::vector<MarkerRegion>& plan, const MatrixXd& examples)
        : seen_(head.layout.markers.size(), Mat3::Identity()),
          confidence_(static_cast<std::size_t>(examples.cols()), 1.0F),
          weights_(static_cast<std::size_t>(examples.cols())) {
        for (const MarkerRegion& region : plan) {
            regions_.push_back(region_of_examples(region, RegionSolver::kSimplex, head.model.neutral_mm,
                                                  head.model.basis_mm, examples));
            regions_.back().shape_blend.assign(weights_.size(), 0.0F);
        }
        pack_.marker_count = static_cast<std::uint16_t>(seen_.size());
        pack_.shape_count = static_cast<std::uint16_t>(weights_.size());
        pack_.solver = SolverKind::kExamples;
        pack_.region_count = static_cast<std::uint8_t>(regions_.size());
        for (std::size_t r = 0; r < regions_.size(); ++r) pack_.regions[r] = regions_[r].view();
        build_regional_tables(pack_, *tables_);
    }
    RegionSolve(const RegionSolve&) = delete;
    RegionSolve& operator=(const RegionSolve&) = delete;

    // Where the regions' combinations put the markers.
    std::vector<Vec3> fit(const std::vector<Vec3>& positions_mm, RegionFit& out) {
        solve_regions(pack_, *tables_, {positions_mm, seen_, confidence_}, *state_, *workspace_, *output_,
                      weights_);
        std::vector<Vec3> made(positions_mm.size(), Vec3::Zero());
        for (std::size_t r = 0; r < regions_.size(); ++r) {
            out.worst_kkt = std::max(out.worst_kkt, output_->regions[r].kkt);
            out.uncertified += output_->regions[r].optimal ? 0 : 1;
            add_region(regions_[r], output_->coefficients[r], made);
        }
        return made;
    }

  private:
    static void add_region(const TrainedRegion& region, std::span<const float> c, std::vector<Vec3>& made) {
        const std::size_t stride = padded(region.example_count);
        for (std::size_t row = 0; row < region.origin_mm.size(); ++row) {
            double x = static_cast<double>(region.origin_mm[row]);
            for (std::size_t j = 0; j < region.example_count; ++j)
                x += static_cast<double>(c[j]) * static_cast<double>(region.examples_mm[row * stride + j]);
            made[region.markers[row / 3]][static_cast<Index>(row % 3)] +=
                static_cast<double>(region.marker_blend[row / 3]) * x;
        }
    }

    std::vector<TrainedRegion> regions_;
    SolvePack pack_;
    std::vector<Mat3> seen_;
    std::vector<float> confidence_;
    std::vector<double> weights_;
    std::unique_ptr<RegionalTables> tables_ = std::make_unique<RegionalTables>();
    std::unique_ptr<RegionalState> state_ = std::make_unique<RegionalState>();
    std::unique_ptr<RegionalWorkspace> workspace_ = std::make_unique<RegionalWorkspace>();
    std::unique_ptr<RegionalOutput> output_ = std::make_unique<RegionalOutput>();
};

}  // namespace

MatrixXd face_examples(const RecordedHead& head, const Take& take, std::size_t count) {
    const RegionMotion face = region_motion(whole_face(head.layout)[0], head.model.neutral_mm,
                                            head.model.basis_mm, std::span(&take, 1), kAllAxes);
    const std::vector<Index> frames = example_frames(face, count - 1);
    MatrixXd examples = MatrixXd::Zero(static_cast<Index>(frames.size()) + 1, face.weights.cols());
    for (std::size_t j = 0; j < frames.size(); ++j)
        examples.row(static_cast<Index>(j) + 1) = face.weights.row(frames[j]);
    return examples;
}

RegionFit fit_regions(const RecordedHead& head, const std::vector<MarkerRegion>& plan,
                      const MatrixXd& examples, const Take& take) {
    RegionSolve solver(head, plan, examples);
    RegionFit out;
    std::vector<Vec3> positions(head.layout.markers.size());
    double sum = 0.0;
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        const std::vector<float> t = marker_frame(head.model, take, f, 0.0, 1);
        for (std::size_t row = 0; row < t.size(); ++row)
            positions[row / 3][static_cast<Index>(row % 3)] = static_cast<double>(t[row]);
        const std::vector<Vec3> made = solver.fit(positions, out);
        for (std::size_t k = 0; k < positions.size(); ++k) sum += (made[k] - positions[k]).squaredNorm();
    }
    out.marker_rms_mm = std::sqrt(sum / static_cast<double>(take.frame_count * positions.size()));
    return out;
}

}  // namespace rig::host
