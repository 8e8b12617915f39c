#include "firmware_host/companion/experiments/region_fit.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {
namespace {

RecordedHead sample_head() {
    RecordedHead head;
    head.rig = sample_rig();
    head.layout = sample_layout(head.rig);
    head.model = marker_model(head.rig, head.layout);
    head.range_of_motion = sample_take(head.rig);
    return head;
}

TEST(FaceExamples, AreTheNeutralFaceAndDifferentFrames) {
    const RecordedHead head = sample_head();
    const Eigen::MatrixXd examples = face_examples(head, head.range_of_motion, 8);
    ASSERT_EQ(examples.rows(), 8);
    EXPECT_EQ(examples.row(0).norm(), 0.0);
    for (Eigen::Index a = 0; a < 8; ++a) {
        for (Eigen::Index b = 0; b < a; ++b)
            EXPECT_GT((examples.row(a) - examples.row(b)).norm(), 0.05) << a << " " << b;
    }
}

TEST(FitRegions, FindsTheExamplesThemselvesAndWhatIsBetweenTwo) {
    const RecordedHead head = sample_head();
    const Eigen::MatrixXd examples = face_examples(head, head.range_of_motion, 8);
    Take take;
    take.frame_count = 9;
    for (Eigen::Index j = 0; j < 9; ++j) {
        const Eigen::RowVectorXd weights =
            j < 8 ? Eigen::RowVectorXd(examples.row(j)) : 0.5 * (examples.row(2) + examples.row(5));
        for (const double w : weights) take.weights.push_back(static_cast<float>(w));
    }
    for (const std::vector<MarkerRegion>& plan : {whole_face(head.layout), surface_regions(head.layout)}) {
        const RegionFit fit = fit_regions(head, plan, examples, take);
        EXPECT_LT(fit.marker_rms_mm, 1e-3);
        EXPECT_EQ(fit.uncertified, 0U);
    }
}

TEST(FitRegions, SmallRegionsReachMoreThanTheWholeFace) {
    const RecordedHead head = sample_head();
    const Eigen::MatrixXd examples = face_examples(head, head.range_of_motion, 8);
    const RegionFit whole = fit_regions(head, whole_face(head.layout), examples, head.range_of_motion);
    const RegionFit parts = fit_regions(head, surface_regions(head.layout), examples, head.range_of_motion);
    EXPECT_GT(whole.marker_rms_mm, 0.05);
    EXPECT_LT(parts.marker_rms_mm, whole.marker_rms_mm);
}

}  // namespace
}  // namespace rig::host
