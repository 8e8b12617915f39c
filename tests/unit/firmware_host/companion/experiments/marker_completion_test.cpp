#include "firmware_host/companion/experiments/marker_completion.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {
namespace {

// Every way brings hidden markers of the take it was trained on much nearer than the mean face, and leaves
// the seen ones alone.
TEST(MarkerCompletion, EveryWayIsNearerThanTheMeanFace) {
    const Rig rig = sample_rig();
    const MarkerLayout layout = sample_layout(rig);
    const MarkerModel model = marker_model(rig, layout);
    const Take take = sample_take(rig);
    const SetsOfFace face(layout, model, spread_of_takes({&take, 1}, rig.shapes.size()), 0.1);
    ASSERT_EQ(face.sets().size(), 21U);
    ClosedForm closed(face);
    Propagation propagation(face);
    const std::size_t m = layout.markers.size();
    std::vector<char> hidden(m, 0);
    for (std::size_t k = 0; k < m; k += 7) hidden[k] = 1;
    std::array<double, 4> square{};
    for (std::size_t f = 0; f < take.frame_count; f += 40) {
        const std::vector<float> x = marker_frame(model, take, f, 0.0, 0);
        std::vector<Vec3> truth(m);
        for (std::size_t k = 0; k < m; ++k)
            truth[k] = Vec3{static_cast<double>(x[3 * k]), static_cast<double>(x[3 * k + 1]),
                            static_cast<double>(x[3 * k + 2])};
        std::vector<Vec3> seen = truth;
        for (std::size_t k = 0; k < m; ++k) {
            if (hidden[k] != 0) seen[k] = Vec3{1e3, 1e3, 1e3};  // not to be read
        }
        std::vector<Vec3> iteration = seen;
        propagation.complete(iteration, hidden);
        std::vector<Vec3> levels = seen;
        complete_by_levels(face, 10, 0.1, levels, hidden);
        const InferenceOutput& output = closed.complete(seen, hidden);
        for (std::size_t k = 0; k < m; ++k) {
            if (hidden[k] == 0) {
                EXPECT_EQ(iteration[k], truth[k]);
                EXPECT_EQ(levels[k], truth[k]);
                EXPECT_EQ(output.position_mm[k], truth[k]);
                continue;
            }
            square[0] += (face.mean_mm(k) - truth[k]).squaredNorm();
            square[1] += (iteration[k] - truth[k]).squaredNorm();
            square[2] += (levels[k] - truth[k]).squaredNorm();
            square[3] += (output.position_mm[k] - truth[k]).squaredNorm();
        }
    }
    EXPECT_LT(square[1], 0.1 * square[0]);
    EXPECT_LT(square[2], 0.1 * square[0]);
    EXPECT_LT(square[3], 0.01 * square[0]);
}

}  // namespace
}  // namespace rig::host
