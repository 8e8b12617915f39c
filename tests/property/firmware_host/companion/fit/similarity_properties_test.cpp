// The closed form against what makes a least-squares similarity one: no small turn, shift or scaling lowers
// the sum of squares, whatever the points.
#include <gtest/gtest.h>

#include <vector>

#include "firmware_host/companion/fit/similarity.hpp"
#include "tests/support/random.hpp"

namespace rig::host {
namespace {

using test::SeededRandom;

Vec3 random_vector(SeededRandom& random, double deviation) {
    return {random.normal(0.0, deviation), random.normal(0.0, deviation), random.normal(0.0, deviation)};
}

struct Pairs {
    std::vector<Vec3> x;
    std::vector<Vec3> y;
};

long double sum_of_squares(const Pairs& pairs, const Similarity& s) {
    long double sum = 0.0L;
    for (std::size_t i = 0; i < pairs.x.size(); ++i)
        sum += static_cast<long double>((pairs.y[i] - s.apply(pairs.x[i])).squaredNorm());
    return sum;
}

TEST(SimilarityProperties, NothingNearbyIsBetter) {
    SeededRandom random(41);
    for (int trial = 0; trial < 2000; ++trial) {
        Pairs pairs;
        SimilarityFit fit;
        const double spread = random.uniform(0.5, 80.0);
        const Vec3 far = random_vector(random, trial % 2 == 0 ? 0.0 : 1000.0);
        const double noise = random.uniform(0.0, 1.0) * spread;
        const std::size_t count = 3 + random.below(20);
        for (std::size_t i = 0; i < count; ++i) {
            pairs.x.push_back(far + random_vector(random, spread));
            pairs.y.push_back(0.7 * pairs.x.back() + random_vector(random, noise));
            fit.add(pairs.x.back(), pairs.y.back());
        }
        const bool scaled = trial % 3 != 0;
        const auto found = fit.solve(scaled);
        if (!found) continue;  // a handful of points may lie on a line
        ASSERT_LT((found->rotation * found->rotation.transpose() - Mat3::Identity()).norm(), 1e-9);
        ASSERT_GT(found->rotation.determinant(), 0.0);
        const long double least = sum_of_squares(pairs, *found);
        Vec3 mean = Vec3::Zero();
        for (const Vec3& x : pairs.x) mean += found->apply(x) / static_cast<double>(pairs.x.size());
        for (int nearby = 0; nearby < 6; ++nearby) {
            // About the middle of the points, so that a turn is not a shift of a thousand millimetres.
            Similarity step;
            step.rotation =
                Eigen::AngleAxisd(1e-3, random_vector(random, 1.0).normalized()).toRotationMatrix();
            if (scaled) step.scale = 1.0 + random.uniform(-1e-3, 1e-3);
            step.translation_mm =
                mean - step.scale * (step.rotation * mean) + 1e-3 * random_vector(random, spread);
            ASSERT_GE(static_cast<double>(sum_of_squares(pairs, compose(step, *found)) - least),
                      -1e-9 * static_cast<double>(least) - 1e-12)
                << "trial " << trial;
        }
    }
}

}  // namespace
}  // namespace rig::host
