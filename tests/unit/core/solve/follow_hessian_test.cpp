#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using Precisions = testing::Types<float, double>;

template <typename Real>
class FollowHessian : public testing::Test {
  public:
    FollowHessian() : random(21) {}

    void make(std::size_t size) {
        n = size;
        stride = row_stride(n);
        h.assign(n * stride, Real(0));
        for (std::size_t i = 0; i < n; ++i) h[i * stride + i] = Real(0.5);
        for (std::size_t r = 0; r < 3 * n; ++r) {
            const std::vector<Real> z = term(0.6);
            add_square(h.data(), stride, n, z.data());
        }
        q.resize(n);
        for (Real& x : q) x = static_cast<Real>(random.normal(0.0, 1.0) * std::sqrt(static_cast<double>(n)));
        low.assign(n, Real(0));
        high.assign(n, Real(1));
        w.assign(n, Real(0));
        state->warm = false;
    }

    std::vector<Real> term(double size) {
        std::vector<Real> z(padded(n), Real(0));
        for (std::size_t c = 0; c < n; ++c) z[c] = static_cast<Real>(random.normal(0.0, size));
        return z;
    }

    BoxQpReport solve(BoxQpState<Real>& with, std::vector<Real>& from) {
        return solve_box_qp({n, stride, h, q, low, high, version}, {.tolerance = kSingle ? 1e-6 : 1e-10},
                            with, *workspace, std::span<Real>(from));
    }

    bool change(const std::vector<Real>& z, bool add) {
        if (add) add_square(h.data(), stride, n, z.data());
        if (!add) subtract_square(h.data(), stride, n, z.data());
        const bool followed = follow_hessian(*state, std::span<const Real>(z.data(), n), add);
        settle_hessian(*state, std::span<const Real>(h), stride, ++version);
        return followed;
    }

    static constexpr bool kSingle = sizeof(Real) == sizeof(float);
    test::SeededRandom random;
    std::size_t n = 0, stride = 0;
    std::vector<Real> h, q, low, high, w;
    std::uint32_t version = 1;
    std::unique_ptr<BoxQpState<Real>> state = std::make_unique<BoxQpState<Real>>();
    std::unique_ptr<BoxQpState<Real>> other = std::make_unique<BoxQpState<Real>>();
    std::unique_ptr<BoxQpWorkspace<Real>> workspace = std::make_unique<BoxQpWorkspace<Real>>();
};
TYPED_TEST_SUITE(FollowHessian, Precisions);

// Markers come and go: the kept inverse follows, nothing is made anew, and the answer stays the cold one.
TYPED_TEST(FollowHessian, TheAnswerStaysTheColdOne) {
    using Real = TypeParam;
    for (const std::size_t size : {5U, 30U, 60U}) {
        this->make(size);
        std::vector<std::vector<Real>> added;
        for (int step = 0; step < 60; ++step) {
            const BoxQpReport report = this->solve(*this->state, this->w);
            ASSERT_TRUE(report.optimal);
            ASSERT_EQ(report.rebuilds, step == 0 ? 1 : 0) << "the inverse followed";
            this->other->warm = false;
            std::vector<Real> cold(size, Real(0));
            ASSERT_TRUE(this->solve(*this->other, cold).optimal);
            for (std::size_t i = 0; i < size; ++i)
                ASSERT_NEAR(this->w[i], cold[i], this->kSingle ? 1e-4 : 1e-8);
            const bool add = added.empty() || this->random.chance(0.5);
            if (add) added.push_back(this->term(0.6));
            ASSERT_TRUE(this->change(added.back(), add));
            if (!add) added.pop_back();
        }
    }
}

// A term whose removal leaves next to nothing of a variable: refused, and the next solve starts from H
// itself.
TYPED_TEST(FollowHessian, RefusesWhatWouldLeaveNothing) {
    this->make(6);
    const std::vector<TypeParam> z = [&] {
        std::vector<TypeParam> out(padded(6), TypeParam(0));
        out[2] = TypeParam(50);
        return out;
    }();
    add_square(this->h.data(), this->stride, this->n, z.data());
    this->q[2] = TypeParam(-1000);
    ++this->version;
    ASSERT_TRUE(this->solve(*this->state, this->w).optimal);
    ASSERT_GT(this->w[2], TypeParam(0));
    ASSERT_LT(this->w[2], TypeParam(1));
    EXPECT_FALSE(this->change(z, false));
    const BoxQpReport report = this->solve(*this->state, this->w);
    EXPECT_TRUE(report.optimal);
    EXPECT_EQ(report.rebuilds, 1);
}

TYPED_TEST(FollowHessian, AStateThatHoldsNothingIsLeftAlone) {
    this->make(6);
    const std::vector<TypeParam> z = this->term(1.0);
    EXPECT_FALSE(follow_hessian(*this->state, std::span<const TypeParam>(z.data(), 6), true));
    EXPECT_TRUE(this->solve(*this->state, this->w).optimal);
}

}  // namespace
}  // namespace rig
