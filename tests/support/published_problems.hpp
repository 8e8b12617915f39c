// Small quadratic programmes with published answers, from tests/data/published_problems; its README says what
// they are, where they come from and what stands in a file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace rig::test {

enum class PublishedKind {
    kBox,     // low <= x <= high
    kSimplex  // sum x = 1, x >= 0; low and high say no more than that
};

// f(x) = 1/2 x^T H x + q^T x + constant. A least-squares problem |A x - b|^2 is stored as 2 A^T A, -2 A^T b,
// b^T b, summed in long double.
struct PublishedProblem {
    std::string name;
    PublishedKind kind = PublishedKind::kBox;
    std::size_t size = 0;
    std::vector<long double> hessian;  // [N x N]
    std::vector<long double> linear;
    long double constant = 0.0L;
    std::vector<long double> low;  // -inf: none
    std::vector<long double> high;
    std::vector<long double> optimum;      // empty: only the objective is published
    long double optimum_half_unit = 0.0L;  // half a unit of the last digit printed; 0: exact
    bool has_objective = false;
    long double objective = 0.0L;  // f at the optimum
    long double objective_half_unit = 0.0L;

    [[nodiscard]] long double value(const std::vector<long double>& x) const;
    [[nodiscard]] std::vector<long double> gradient(const std::vector<long double>& x) const;
};

struct PublishedProblems {
    std::vector<PublishedProblem> problems;  // in the order of their files' names
    std::string fault;                       // what is wrong with the first bad file; empty: nothing
};

[[nodiscard]] PublishedProblems load_published_problems();
[[nodiscard]] PublishedProblems load_published_problems(const std::filesystem::path& folder);

}  // namespace rig::test
