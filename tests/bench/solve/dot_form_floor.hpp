// The arithmetic that an RBF evaluation cannot avoid, written as matrix times vector row by row: the three
// products alone, no distances squared, no kernel function, no bounds. What bench_rbf compares with.
#pragma once

#include <cstddef>
#include <vector>

namespace rig::test {

// A row-major matrix whose rows are padded with zeros to whole lanes.
struct DotFormMatrix {
    std::size_t rows = 0;
    std::size_t columns = 0;
    std::vector<float> values;
};

struct DotFormChain {
    DotFormMatrix basis;    // [d x 3m]
    DotFormMatrix centres;  // [K x d]
    DotFormMatrix weights;  // [N x K]
};

// x = basis t, u = centres x, w = weights u. Every vector has room for padded entries.
// `plain`: a sum for each row, in the order of its terms, as a compiler without -ffast-math leaves it.
void dot_form_plain(const DotFormChain& chain, const float* t, float* x, float* u, float* w);
// `wide`: 16 interleaved partial sums, which fill vector registers.
void dot_form_wide(const DotFormChain& chain, const float* t, float* x, float* u, float* w);

}  // namespace rig::test
