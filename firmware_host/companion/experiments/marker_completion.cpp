#include "firmware_host/companion/experiments/marker_completion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What a set makes of the residual at its markers [3 m_f]: mean 0, only the seen rows are read.
VectorXd closed_form_of_set(const MarkerSetModel& set, std::size_t most_modes, double noise_mm,
                            const VectorXd& residual, std::span<const char> hidden) {
    const auto rows = static_cast<Index>(3 * set.marker_count);
    const auto d = static_cast<Index>(std::min<std::size_t>(set.mode_count, most_modes));
    MatrixXd modes(rows, d);
    VectorXd left = VectorXd::Zero(rows);  // variance that the modes used do not hold
    for (Index j = 0; j < set.mode_count; ++j) {
        const auto variance = static_cast<double>(set.variance_mm2[static_cast<std::size_t>(j)]);
        for (Index r = 0; r < rows; ++r) {
            const auto m = static_cast<double>(set.modes[static_cast<std::size_t>(j * rows + r)]);
            if (j < d) modes(r, j) = m * std::sqrt(variance);
            if (j >= d) left[r] += m * m * variance;
        }
    }
    MatrixXd normal = MatrixXd::Identity(d, d);
    VectorXd right = VectorXd::Zero(d);
    for (Index r = 0; r < rows; ++r) {
        const auto k = static_cast<std::size_t>(r / 3);
        if (hidden[set.markers[k]] != 0) continue;
        const double weight =
            1.0 / (noise_mm * noise_mm + left[r] + static_cast<double>(set.residual_mm2[k]));
        normal += weight * modes.row(r).transpose() * modes.row(r);
        right += weight * modes.row(r).transpose() * residual[3 * set.markers[k] + r % 3];
    }
    return modes * normal.llt().solve(right);
}

}  // namespace

SetsOfFace::SetsOfFace(const MarkerLayout& layout, const MarkerModel& model, const ExpressionSpread& spread,
                       double noise_mm, const MarkerSetOptions& options)
    : neutral_mm_(model.neutral_mm),
      sets_(train_marker_sets(marker_sets(layout), model.basis_mm, spread, options)) {
    pack_.marker_count = static_cast<std::uint16_t>(layout.markers.size());
    pack_.noise_mm = static_cast<float>(noise_mm);
    pack_.neutral_mm = neutral_mm_;
    pack_.marker_set_count = static_cast<std::uint8_t>(sets_.size());
    for (std::size_t f = 0; f < sets_.size(); ++f) pack_.marker_sets[f] = sets_[f].view();
}

Vec3 SetsOfFace::neutral_mm(std::size_t marker) const {
    const float* x = neutral_mm_.data() + 3 * marker;
    return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}

Vec3 SetsOfFace::mean_mm(std::size_t marker) const {
    const float* x = sets_[0].mean_mm.data() + 3 * marker;
    return neutral_mm(marker) +
           Vec3{static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}

ClosedForm::ClosedForm(const SetsOfFace& face) {
    const auto noise_mm = static_cast<double>(face.pack().noise_mm);
    information_ = 1.0 / (noise_mm * noise_mm);
    const auto scratch = std::make_unique<FaceGaussianWorkspace>();
    const auto unused = std::make_unique<ShapeModel>();
    build_face_gaussian(face.pack(), *unused, *scratch, *gaussian_);
}

const InferenceOutput& ClosedForm::complete(std::span<const Vec3> positions_mm,
                                            std::span<const char> hidden) {
    input_->count = static_cast<std::uint16_t>(positions_mm.size());
    for (std::size_t k = 0; k < positions_mm.size(); ++k) {
        StabilisedMarker& marker = input_->markers[k];
        marker.seen = hidden[k] == 0;
        marker.position_mm = positions_mm[k];
        marker.information = marker.seen ? Mat3{information_ * Mat3::Identity()} : Mat3{Mat3::Zero()};
    }
    infer_missing(*gaussian_, *input_, *workspace_, *output_);
    return *output_;
}

PropagationReport Propagation::complete(std::span<Vec3> positions_mm, std::span<const char> hidden) {
    std::array<Vec3, kMaxMarkers> displacement;
    std::array<bool, kMaxMarkers> known{};
    const std::size_t m = positions_mm.size();
    for (std::size_t k = 0; k < m; ++k) {
        known[k] = hidden[k] == 0;
        displacement[k] = positions_mm[k] - face_.neutral_mm(k);
    }
    const PropagationReport report = propagate_motion(face_.sets(), std::span(known).first(m), config_,
                                                      *workspace_, std::span(displacement).first(m));
    for (std::size_t k = 0; k < m; ++k) {
        if (!known[k]) positions_mm[k] = face_.neutral_mm(k) + displacement[k];
    }
    return report;
}

void complete_by_levels(const SetsOfFace& face, std::size_t most_modes, double noise_mm,
                        std::span<Vec3> positions_mm, std::span<const char> hidden) {
    const std::size_t m = positions_mm.size();
    VectorXd residual = VectorXd::Zero(static_cast<Index>(3 * m));
    VectorXd total = VectorXd::Zero(static_cast<Index>(3 * m));
    for (std::size_t k = 0; k < m; ++k) {
        if (hidden[k] == 0)
            residual.segment<3>(static_cast<Index>(3 * k)) = positions_mm[k] - face.mean_mm(k);
    }
    for (std::uint8_t level = 0; level <= kDeepestMarkerSetLevel; ++level) {
        VectorXd sum = VectorXd::Zero(total.size());
        VectorXd count = VectorXd::Zero(total.size());
        for (const MarkerSetModel& set : face.sets()) {
            if (set.level != level) continue;
            const VectorXd made = closed_form_of_set(set, most_modes, noise_mm, residual, hidden);
            for (Index r = 0; r < made.size(); ++r) {
                const Index row = 3 * set.markers[static_cast<std::size_t>(r / 3)] + r % 3;
                sum[row] += made[r];
                count[row] += 1.0;
            }
        }
        const VectorXd step = sum.cwiseQuotient(count.cwiseMax(1.0));
        total += step;
        residual -= step;
    }
    for (std::size_t k = 0; k < m; ++k) {
        if (hidden[k] != 0)
            positions_mm[k] = face.mean_mm(k) + Vec3{total.segment<3>(static_cast<Index>(3 * k))};
    }
}

}  // namespace rig::host
