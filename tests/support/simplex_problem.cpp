#include "tests/support/simplex_problem.hpp"

#include <algorithm>
#include <cmath>

namespace rig::test {

SimplexProblem::SimplexProblem(std::size_t rows, std::size_t count, const std::vector<double>& raw)
    : rows_(rows), count_(count), mean_(rows, 0.0), target_(rows, 0.0F) {
    const std::size_t stride = padded(count);
    examples_.resize(rows * stride / kLaneFloats);
    gram_.resize(count * stride / kLaneFloats);
    float* out = examples_.data()->values;
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < count; ++i) mean_[r] += raw[r * count + i] / static_cast<double>(count);
        for (std::size_t i = 0; i < count; ++i)
            out[r * stride + i] = static_cast<float>(raw[r * count + i] - mean_[r]);
    }
    build_simplex_gram({out, rows * stride}, rows, count, {}, {gram_.data()->values, count * stride});
}

void SimplexProblem::measure(const std::vector<double>& position) {
    for (std::size_t r = 0; r < rows_; ++r) target_[r] = static_cast<float>(position[r] - mean_[r]);
}

SimplexQpProblem SimplexProblem::view() const {
    SimplexQpProblem view;
    view.rows = rows_;
    view.count = count_;
    view.stride = padded(count_);
    view.examples = {examples_.data()->values, rows_ * view.stride};
    view.gram = {gram_.data()->values, count_ * view.stride};
    view.target = target_;
    view.row_weight = weight_;
    return view;
}

ReferenceSimplexQp SimplexProblem::reference() const {
    ReferenceSimplexQp out;
    out.rows = rows_;
    out.count = count_;
    const std::size_t stride = padded(count_);
    const float* from = examples_.data()->values;
    for (std::size_t r = 0; r < rows_; ++r) {
        for (std::size_t i = 0; i < count_; ++i)
            out.examples.push_back(static_cast<long double>(from[r * stride + i]));
        const bool seen = std::fabs(target_[r]) <= kMaxSimplexTarget;
        out.target.push_back(seen ? static_cast<long double>(target_[r]) : 0.0L);
        const float weight = weight_.empty() ? 1.0F : weight_[r];
        out.weight.push_back(seen ? static_cast<long double>(weight) : 0.0L);
    }
    return out;
}

std::vector<double> simplex_examples(const SimplexFaceOptions& o, SeededRandom& random) {
    std::vector<double> raw(o.rows * o.count);
    std::vector<double> neutral(o.rows);
    std::vector<double> family(o.rows);
    for (double& x : neutral) x = random.uniform(-o.neutral_mm, o.neutral_mm);
    const double own = std::sqrt(1.0 - o.similarity * o.similarity);
    for (std::size_t i = 0; i < o.count; ++i) {
        if (i % 3 == 0) {
            for (double& x : family) x = random.normal(0.0, 1.0);
        }
        const double size = o.motion_mm * random.uniform(0.3, 1.0);
        for (std::size_t r = 0; r < o.rows; ++r) {
            const double motion = o.similarity * family[r] + own * random.normal(0.0, 1.0);
            raw[r * o.count + i] = neutral[r] + (i == 0 ? 0.0 : size * motion);
        }
    }
    const std::size_t made = std::min(o.duplicates + o.affine, o.count - 1);
    for (std::size_t d = 0; d < made; ++d) {
        const std::size_t i = o.count - 1 - d;
        const std::size_t a = random.below(o.count - made);
        const std::size_t b = random.below(o.count - made);
        const double share = d < o.duplicates ? 1.0 : random.uniform(-0.5, 1.5);
        for (std::size_t r = 0; r < o.rows; ++r) {
            raw[r * o.count + i] = share * raw[r * o.count + a] + (1.0 - share) * raw[r * o.count + b];
        }
    }
    if (o.near_duplicate > 0.0) {
        for (std::size_t r = 0; r < o.rows; ++r) {
            raw[r * o.count + o.count - 1] =
                raw[r * o.count] + o.near_duplicate * o.motion_mm * random.normal(0.0, 1.0);
        }
    }
    return raw;
}

SimplexTrajectory::SimplexTrajectory(std::size_t count, SeededRandom& random) {
    for (std::size_t i = 0; i < count; ++i) {
        frequency_.push_back(random.uniform(0.01, 0.05));
        phase_.push_back(random.uniform(0.0, 6.28));
    }
}

std::vector<double> SimplexTrajectory::at(double frame) const {
    std::vector<double> c(frequency_.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < c.size(); ++i) {
        // Raised cosine events, at rest half of the time.
        c[i] = std::max(0.0, std::cos(frequency_[i] * frame + phase_[i]));
        c[i] *= c[i];
        sum += c[i];
    }
    if (sum <= 0.0) {
        c[0] = sum = 1.0;
    }
    for (double& x : c) x /= sum;
    return c;
}

}  // namespace rig::test
