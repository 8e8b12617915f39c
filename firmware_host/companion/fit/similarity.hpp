// The similarity between two sets of corresponding points: Procrustes analysis [Hybrid16 section 6], in the
// closed form of Umeyama 1991. Double precision, host only.
#pragma once

#include <optional>

#include "core/base/linalg.hpp"

namespace rig::host {

// y = scale rotation x + translation. Named b_from_a: takes coordinates in a to coordinates in b.
struct Similarity {
    double scale = 1.0;
    Mat3 rotation = Mat3::Identity();
    Vec3 translation_mm = Vec3::Zero();

    [[nodiscard]] Vec3 apply(const Vec3& x) const { return scale * (rotation * x) + translation_mm; }
};

// outer(inner(x))
[[nodiscard]] Similarity compose(const Similarity& outer, const Similarity& inner);

// Sums over pairs x -> y, so that a take of any length needs no list of them.
class SimilarityFit {
  public:
    void add(const Vec3& x, const Vec3& y);
    [[nodiscard]] std::size_t count() const { return count_; }
    // Minimises sum |y - (s R x + t)|^2 over R, t and, where `scaled`, s (else s = 1). Nothing for fewer than
    // three pairs, or points that lie on a line: they leave a turn open.
    [[nodiscard]] std::optional<Similarity> solve(bool scaled) const;

  private:
    std::size_t count_ = 0;
    // Relative to the first pair: sums of squares of large coordinates would lose what matters.
    Vec3 x_origin_ = Vec3::Zero();
    Vec3 y_origin_ = Vec3::Zero();
    Vec3 x_sum_ = Vec3::Zero();
    Vec3 y_sum_ = Vec3::Zero();
    double xx_sum_ = 0.0;
    Mat3 yx_sum_ = Mat3::Zero();
};

}  // namespace rig::host
