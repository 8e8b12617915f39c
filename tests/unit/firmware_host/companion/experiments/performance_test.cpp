#include "firmware_host/companion/experiments/performance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

TEST(MarkerFrame, IsTheModelPlusNoiseThatRepeats) {
    const test::TinyRig tiny = test::tiny_rig(20, 3, 50);
    const MarkerModel model = marker_model(tiny.rig, tiny.layout);
    const std::vector<float> clean = marker_frame(model, tiny.take, 30, 0.0, 1);
    for (std::size_t r = 0; r < clean.size(); ++r) {
        double wanted = static_cast<double>(model.neutral_mm[r]);
        for (std::size_t i = 0; i < 3; ++i) {
            wanted += static_cast<double>(model.basis_mm[3 * r + i]) *
                      static_cast<double>(tiny.take.weights[3 * 30 + i]);
        }
        EXPECT_NEAR(static_cast<double>(clean[r]), wanted, 1e-5);
    }
    EXPECT_EQ(marker_frame(model, tiny.take, 30, 0.1, 1), marker_frame(model, tiny.take, 30, 0.1, 1));
    EXPECT_NE(marker_frame(model, tiny.take, 30, 0.1, 1), marker_frame(model, tiny.take, 30, 0.1, 2));
    double square = 0.0;
    double count = 0.0;
    for (std::size_t f = 0; f < 50; ++f) {
        const std::vector<float> noisy = marker_frame(model, tiny.take, f, 0.1, 1);
        const std::vector<float> exact = marker_frame(model, tiny.take, f, 0.0, 1);
        for (std::size_t r = 0; r < noisy.size(); ++r, ++count) {
            const double gap = static_cast<double>(noisy[r]) - static_cast<double>(exact[r]);
            square += gap * gap;
        }
    }
    EXPECT_NEAR(std::sqrt(square / count), 0.1, 0.005);
}

TEST(WeightError, LeavesOutShapesThatMarkersHardlySee) {
    // One marker, three shapes: 3 mm, 0.9 mm, 1.1 mm along x.
    MarkerModel model;
    model.neutral_mm = {0.0F, 0.0F, 0.0F};
    model.basis_mm = {3.0F, 0.9F, 1.1F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
    WeightError error(model);
    EXPECT_EQ(error.rms(), 0.0);
    error.add(std::vector<float>{0.3F, 1.0F, 0.5F}, std::vector<float>{0.0F, 0.0F, 0.1F});
    EXPECT_NEAR(error.rms(), std::sqrt((0.09 + 0.16) / 2.0), 1e-7);
    error.add(std::vector<float>{0.0F, 0.0F, 0.0F}, std::vector<float>{0.0F, 1.0F, 0.0F});
    EXPECT_NEAR(error.rms(), std::sqrt((0.09 + 0.16) / 4.0), 1e-7);
}

TEST(Quantile, IsAnOrderStatistic) {
    std::vector<double> values{5.0, 1.0, 4.0, 2.0, 3.0};
    EXPECT_EQ(quantile(values, 0.5), 3.0);
    EXPECT_EQ(quantile(values, 0.0), 1.0);
    EXPECT_EQ(quantile(values, 1.0), 5.0);
    std::vector<double> none;
    EXPECT_EQ(quantile(none, 0.5), 0.0);
}

TEST(LoadRecordedHead, SaysWhichFileIsMissing) {
    const auto head = load_recorded_head("/no/such/folder", "60");
    ASSERT_FALSE(head.has_value());
    EXPECT_NE(head.error().message.find("/no/such/folder"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
