// A symmetric 3 x 3 matrix, definite or not, as a sum of squares with signs: +-l l^T, at most six of them.
// What a marker's information V_k gains or loses is such a matrix, and each square is a rank-one term of B^T
// V B.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/linalg.hpp"

namespace rig {

inline constexpr double kLeastPivotShare = 1e-9;  // of the sum of sizes; a smaller pivot carries nothing

// visit(l, add) for each square of a's L D L^T. False, with nothing visited, when a pivot is too small to
// divide by while its column is not.
template <class Visit>
bool visit_squares(Mat3 a, Visit&& visit) {
    const double small = kLeastPivotShare * a.cwiseAbs().sum();
    std::array<Vec3, 3> squares{};
    std::array<bool, 3> add{};
    std::size_t count = 0;
    for (Eigen::Index j = 0; j < 3; ++j) {
        const double pivot = a(j, j);
        Vec3 column = a.col(j);
        for (Eigen::Index i = 0; i < j; ++i) column[i] = 0.0;
        if (std::fabs(pivot) <= small) {
            column[j] = 0.0;
            if (column.cwiseAbs().maxCoeff() > small) return false;
            continue;
        }
        add[count] = pivot > 0.0;
        squares[count++] = column / std::sqrt(std::fabs(pivot));
        a -= column * column.transpose() / pivot;
    }
    for (std::size_t j = 0; j < count; ++j) visit(squares[j], add[j]);
    return true;
}

// The same for any symmetric finite matrix; one without usable pivots is the difference of two definite ones.
template <class Visit>
void for_each_square(const Mat3& a, Visit&& visit) {
    if ((a.array() == 0.0).all() || visit_squares(a, visit)) return;
    const Mat3 lift = 2.0 * a.cwiseAbs().sum() * Mat3::Identity();
    static_cast<void>(visit_squares(Mat3(a + lift), visit));
    static_cast<void>(visit_squares(lift, [&](const Vec3& l, bool) { visit(l, false); }));
}

}  // namespace rig
