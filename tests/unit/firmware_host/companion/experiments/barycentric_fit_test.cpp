#include "firmware_host/companion/experiments/barycentric_fit.hpp"

#include <gtest/gtest.h>

#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

TEST(BarycentricFit, OneMillimetreIsFoundInAFewRounds) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    RIG_SHARED_DATA_OR_SKIP(rig_folder, "rig");
    const auto figures = measure_barycentric(rig_folder.parent_path(), {.misplaced_mm = 1.0, .seed = 4});
    ASSERT_TRUE(figures) << figures.error().message;
    EXPECT_GT(figures->given_mm, 0.7);
    EXPECT_LE(figures->fitted_mm, 0.25);  // the experiment's bounds
    EXPECT_GE(figures->fitted_mm, 0.1);   // the noise alone leaves 0.15: much less would be a broken measure
    EXPECT_LE(figures->rounds, 5U);
    EXPECT_LE(figures->final_mm, figures->fitted_mm + 1e-3);
    EXPECT_LT(figures->place_fitted_mm, 0.5 * figures->place_given_mm);
}

TEST(BarycentricFit, ThreeMillimetresGetMuchBetter) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    RIG_SHARED_DATA_OR_SKIP(rig_folder, "rig");
    const auto figures = measure_barycentric(rig_folder.parent_path(), {.misplaced_mm = 3.0, .seed = 4});
    ASSERT_TRUE(figures) << figures.error().message;
    EXPECT_GT(figures->given_mm, 2.0);
    EXPECT_LT(figures->fitted_mm, 0.73);  // where the trial behind the bound stalled
}

TEST(BarycentricFit, SaysWhichFileIsMissing) {
    const auto figures = measure_barycentric("no_such_folder", {});
    ASSERT_FALSE(figures);
    EXPECT_NE(figures.error().message.find("no_such_folder"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
