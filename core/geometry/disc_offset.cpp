#include "core/geometry/disc_offset.hpp"

#include <array>

#include "core/base/math.hpp"

namespace rig {

namespace {

// Gauss-Legendre over the square of the radius: each node stands for an equal share of area per weight.
constexpr std::array<double, 3> kSquares = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> kWeights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
constexpr double kDiagonal = 0.7071067811865476;
constexpr std::array<std::array<double, 2>, 8> kDirections = {{{1.0, 0.0},
                                                               {kDiagonal, kDiagonal},
                                                               {0.0, 1.0},
                                                               {-kDiagonal, kDiagonal},
                                                               {-1.0, 0.0},
                                                               {-kDiagonal, -kDiagonal},
                                                               {0.0, -1.0},
                                                               {kDiagonal, -kDiagonal}}};

}  // namespace

Vec2 disc_centroid_offset(const SkinDisc& disc) {
    const Vec3& c = disc.centre_mm;
    const Vec3& n = disc.normal;
    const double r = disc.radius_mm;
    const double k = disc.curvature_per_mm;
    const bool usable = c.z() > 0.0 && r > 0.0 && is_finite(c.squaredNorm() + r + k) &&
                        n.squaredNorm() > 0.25 && n.squaredNorm() < 4.0;
    if (!usable) return Vec2::Zero();
    const Vec3 u = perpendicular_to(n);
    const Vec3 v = n.cross(u);
    const Vec2 middle(c.x() / c.z(), c.y() / c.z());
    double area = 0.0;
    Vec2 sum = Vec2::Zero();
    for (std::size_t i = 0; i < kSquares.size(); ++i) {
        const double square = kSquares[i] * r * r;
        const double s = sqrt(square);
        for (const auto& direction : kDirections) {
            const Vec3 along = direction[0] * u + direction[1] * v;
            // The skin as a sphere to third order: s along it, sinking by k s^2 / 2.
            const Vec3 p = c + along * (s * (1.0 - square * k * k / 6.0)) - n * (0.5 * k * square);
            const Vec3 m = n + along * (k * s);
            const double facing = -m.dot(p);
            if (!(facing > 0.0) || !(p.z() > 0.0)) return Vec2::Zero();
            const double weight = kWeights[i] * facing / (p.z() * p.z() * p.z());
            area += weight;
            sum += weight * (Vec2(p.x() / p.z(), p.y() / p.z()) - middle);
        }
    }
    return sum / area;
}

}  // namespace rig
