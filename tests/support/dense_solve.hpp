// Systems of a few linear equations in long double, for the references.
#pragma once

#include <vector>

namespace rig::test {

// b := a^-1 b, a [n x n] row-major, by Gauss elimination with row pivoting. False, and b means nothing, when
// a pivot is at most `least_pivot` times the largest entry of a.
[[nodiscard]] bool solve_dense(std::vector<long double> a, std::vector<long double>& b,
                               long double least_pivot);

}  // namespace rig::test
