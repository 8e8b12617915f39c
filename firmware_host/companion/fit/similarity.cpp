#include "firmware_host/companion/fit/similarity.hpp"

#include <Eigen/SVD>

namespace rig::host {

namespace {

// Second singular value over the first, under which the points are a line.
constexpr double kLine = 1e-6;

}  // namespace

Similarity compose(const Similarity& outer, const Similarity& inner) {
    return {outer.scale * inner.scale, outer.rotation * inner.rotation, outer.apply(inner.translation_mm)};
}

void SimilarityFit::add(const Vec3& x, const Vec3& y) {
    if (count_ == 0) {
        x_origin_ = x;
        y_origin_ = y;
    }
    const Vec3 dx = x - x_origin_;
    const Vec3 dy = y - y_origin_;
    ++count_;
    x_sum_ += dx;
    y_sum_ += dy;
    xx_sum_ += dx.squaredNorm();
    yx_sum_ += dy * dx.transpose();
}

std::optional<Similarity> SimilarityFit::solve(bool scaled) const {
    if (count_ < 3) return std::nullopt;
    const auto n = static_cast<double>(count_);
    const Vec3 x_mean = x_sum_ / n;
    const Vec3 y_mean = y_sum_ / n;
    const double x_variance = xx_sum_ / n - x_mean.squaredNorm();
    const Mat3 covariance = yx_sum_ / n - y_mean * x_mean.transpose();
    const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Vec3 values = svd.singularValues();
    if (!(values[1] > kLine * values[0]) || !(x_variance > 0.0)) return std::nullopt;
    // Without the sign, mirrored points would be answered by a mirror instead of a turn.
    Vec3 sign = Vec3::Ones();
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign[2] = -1.0;
    Similarity out;
    out.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    if (scaled) out.scale = values.dot(sign) / x_variance;
    if (!(out.scale > 0.0)) return std::nullopt;
    out.translation_mm = y_origin_ + y_mean - out.scale * (out.rotation * (x_origin_ + x_mean));
    return out;
}

}  // namespace rig::host
