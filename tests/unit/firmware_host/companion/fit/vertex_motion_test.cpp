#include "firmware_host/companion/fit/vertex_motion.hpp"

#include <gtest/gtest.h>

#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

TEST(VertexMotion, AgreesWithTheMarkerModel) {
    const test::TinyRig tiny = test::tiny_rig(24, 5, 2);
    const VertexMotion motion(tiny.rig);
    const MarkerModel model = marker_model(tiny.rig, tiny.layout);
    for (std::size_t k = 0; k < tiny.layout.markers.size(); ++k) {
        const auto vertex = static_cast<std::size_t>(tiny.layout.markers[k].vertices[0]);
        const Eigen::MatrixXd rows = motion.at(vertex);
        ASSERT_EQ(rows.cols(), 6);
        for (Eigen::Index a = 0; a < 3; ++a) {
            const std::size_t row = 3 * k + static_cast<std::size_t>(a);
            EXPECT_EQ(static_cast<float>(rows(a, 0)), model.neutral_mm[row]);
            for (Eigen::Index i = 0; i < 5; ++i)
                EXPECT_EQ(static_cast<float>(rows(a, i + 1)),
                          model.basis_mm[row * 5 + static_cast<std::size_t>(i)]);
        }
    }
}

}  // namespace
}  // namespace rig::host
