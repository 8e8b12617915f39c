#include "firmware_host/daemon/output_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.hpp"

namespace rig::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(OutputGate, GoodStatesPassUntouched) {
    const std::array<float, 2> low{-1.0F, 0.0F};
    const std::array<float, 2> high{1.0F, 1.0F};
    OutputGate gate;
    gate.configure(low, high);
    FaceState state;
    state.shape_count = 2;
    state.weights = {-1.0F, 0.5F};
    state.confidence = {1.0F, 0.25F};
    EXPECT_EQ(gate.pass(state), 0U);
    EXPECT_EQ(state.faults, 0U);
    EXPECT_EQ(state.weights[0], -1.0F);
    EXPECT_EQ(state.confidence[1], 0.25F);
}

TEST(OutputGate, WhatIsNotFiniteBecomesTheHeldValue) {
    const std::array<float, 2> low{0.2F, 0.0F};
    const std::array<float, 2> high{1.0F, 1.0F};
    OutputGate gate;
    gate.configure(low, high);
    FaceState state;
    state.shape_count = 2;
    state.weights = {kNan, 0.75F};
    EXPECT_GT(gate.pass(state), 0U);
    EXPECT_EQ(state.weights[0], 0.2F);  // nothing held yet: rest, inside the range
    EXPECT_NE(state.faults & fault_bit(Fault::kSolveWeak), 0U);
    state.weights = {0.5F, kInf};
    state.confidence = {kNan, -2.0F};
    state.slip.translation_mm = {kNan, kInf, 1e30F};
    EXPECT_EQ(gate.pass(state), 6U);
    EXPECT_EQ(state.weights[1], 0.75F);
    EXPECT_EQ(state.confidence[0], 0.0F);
    EXPECT_TRUE(std::isfinite(state.slip.translation_mm[1]));
}

TEST(OutputGate, AnythingComesOutFiniteAndInRange) {
    std::array<float, kMaxShapes> low{};
    std::array<float, kMaxShapes> high{};
    SeededRandom random(11);
    for (std::size_t i = 0; i < kMaxShapes; ++i) {
        low[i] = static_cast<float>(random.uniform(-2.0, 1.0));
        high[i] = low[i] + static_cast<float>(random.uniform(0.0, 1.0));
    }
    OutputGate gate;
    gate.configure(low, high);
    for (int round = 0; round < 500; ++round) {
        FaceState state;
        state.shape_count = kMaxShapes;
        for (float& weight : state.weights)
            weight = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
        for (float& trust : state.confidence)
            trust = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
        static_cast<void>(gate.pass(state));
        for (std::size_t i = 0; i < kMaxShapes; ++i) {
            ASSERT_TRUE(state.weights[i] >= low[i] && state.weights[i] <= high[i]);
            ASSERT_TRUE(state.confidence[i] >= 0.0F && state.confidence[i] <= 1.0F);
        }
    }
}

TEST(OutputGate, WithoutAPackThereAreNoWeights) {
    OutputGate gate;
    FaceState state;
    state.shape_count = 10;
    static_cast<void>(gate.pass(state));
    EXPECT_EQ(state.shape_count, 0);
}

}  // namespace
}  // namespace rig::test
