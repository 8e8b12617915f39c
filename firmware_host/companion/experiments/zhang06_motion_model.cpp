// Zhang06 section 12: head motion taken out of tracked points in the image by a similarity, which the source
// found steadier than an affine map. Here the helmet's slip, seen from the front.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/fit/marker_take.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kStable = 12;  // the quietest fifth of the layout

// y = linear x + shift in the image plane.
struct PlaneMap {
    Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
    Eigen::Vector2d shift_mm = Eigen::Vector2d::Zero();

    [[nodiscard]] Eigen::Vector2d apply_inverse(const Eigen::Vector2d& y) const {
        return linear.inverse() * (y - shift_mm);
    }
};

// [Zhang06 eq. 8-9]: least squares over (a, b, tx, ty), linear = [a -b; b a].
PlaneMap fit_similarity(const MatrixXd& from, const MatrixXd& to) {
    MatrixXd system(2 * from.cols(), 4);
    VectorXd right(2 * from.cols());
    for (Index k = 0; k < from.cols(); ++k) {
        system.row(2 * k) << from(0, k), -from(1, k), 1.0, 0.0;
        system.row(2 * k + 1) << from(1, k), from(0, k), 0.0, 1.0;
        right.segment<2>(2 * k) = to.col(k);
    }
    const VectorXd x = system.colPivHouseholderQr().solve(right);
    PlaneMap out;
    out.linear << x[0], -x[1], x[1], x[0];
    out.shift_mm = x.tail<2>();
    return out;
}

PlaneMap fit_affine(const MatrixXd& from, const MatrixXd& to) {
    MatrixXd system(from.cols(), 3);
    system.leftCols<2>() = from.transpose();
    system.col(2).setOnes();
    const MatrixXd x = system.colPivHouseholderQr().solve(to.transpose());
    PlaneMap out;
    out.linear = x.topRows<2>().transpose();
    out.shift_mm = x.row(2).transpose();
    return out;
}

// The markers that move least over all shapes.
std::vector<std::size_t> quietest(const MarkerModel& model, std::size_t count) {
    const std::size_t m = model.neutral_mm.size() / 3;
    const std::size_t n = model.basis_mm.size() / model.neutral_mm.size();
    std::vector<double> motion(m, 0.0);
    for (std::size_t i = 0; i < model.basis_mm.size(); ++i) {
        const auto b = static_cast<double>(model.basis_mm[i]);
        motion[i / (3 * n)] += b * b;
    }
    std::vector<std::size_t> order(m);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return motion[k]; });
    order.resize(std::min(count, m));
    return order;
}

struct ModelErrors {
    double nothing_mm = 0.0;
    double similarity_mm = 0.0;
    double affine_mm = 0.0;
};

ModelErrors measure(const MarkerModel& model, const std::vector<std::size_t>& stable, const MarkerTake& seen,
                    const MarkerTake& truth) {
    MatrixXd from(2, static_cast<Index>(stable.size()));
    for (std::size_t i = 0; i < stable.size(); ++i) {
        for (std::size_t axis = 0; axis < 2; ++axis)
            from(static_cast<Index>(axis), static_cast<Index>(i)) =
                static_cast<double>(model.neutral_mm[3 * stable[i] + axis]);
    }
    ModelErrors sum;
    double count = 0.0;
    for (std::size_t f = 0; f < seen.frame_count; ++f) {
        MatrixXd to(2, from.cols());
        for (std::size_t i = 0; i < stable.size(); ++i)
            to.col(static_cast<Index>(i)) = seen.at(f, stable[i]).head<2>();
        const PlaneMap similarity = fit_similarity(from, to);
        const PlaneMap affine = fit_affine(from, to);
        for (std::size_t k = 0; k < seen.marker_count; ++k) {
            const Eigen::Vector2d x = seen.at(f, k).head<2>();
            const Eigen::Vector2d wanted = truth.at(f, k).head<2>();
            sum.nothing_mm += (x - wanted).squaredNorm();
            sum.similarity_mm += (similarity.apply_inverse(x) - wanted).squaredNorm();
            sum.affine_mm += (affine.apply_inverse(x) - wanted).squaredNorm();
            count += 1.0;
        }
    }
    return {std::sqrt(sum.nothing_mm / count), std::sqrt(sum.similarity_mm / count),
            std::sqrt(sum.affine_mm / count)};
}

}  // namespace

Result<ExperimentTable, FileError> zhang06_motion_model(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    const std::vector<std::size_t> stable = quietest(head->model, kStable);
    ExperimentTable out;
    out.columns = {"stream", "slip left in, mm", "similarity, mm", "affine, mm"};
    for (const auto& [name, folder] : {std::pair{"range of motion", "markers/alex_rom_3/60"},
                                       std::pair{"speech", "markers/facegood_3_15/60"}}) {
        const auto seen = load_marker_take(data / folder / "slip.npy", 60.0);
        if (!seen) return failure(seen.error());
        const auto truth = load_marker_take(data / folder / "truth.npy", 60.0);
        if (!truth) return failure(truth.error());
        const ModelErrors errors = measure(head->model, stable, *seen, *truth);
        out.rows.push_back({name, fmt::format("{:.3f}", errors.nothing_mm),
                            fmt::format("{:.3f}", errors.similarity_mm),
                            fmt::format("{:.3f}", errors.affine_mm)});
        out.bounds.push_back(
            {fmt::format("{}: similarity over affine", name), errors.similarity_mm / errors.affine_mm, 1.0});
    }
    out.remarks = {
        fmt::format("x and y of 60 markers in every frame of the recorded slip streams, fitted on the {} "
                    "markers that the "
                    "shapes move least; rms distance from where they would be without slip.",
                    stable.size())};
    return out;
}

}  // namespace rig::host
