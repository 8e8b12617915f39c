#include "core/infer/motion_propagation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

// Sets over 12 markers: the whole face, two halves that share markers 5 and 6, four quarters; each with
// orthonormal modes that are parts of the same three motions.
struct Hierarchy {
    Hierarchy() {
        test::SeededRandom random(71);
        for (auto& motion : motions) {
            for (double& x : motion) x = random.normal(0.0, 1.0);
        }
        add(0, 0, 12);
        add(1, 0, 7);
        add(1, 5, 12);
        add(2, 0, 3);
        add(2, 3, 6);
        add(2, 6, 9);
        add(2, 9, 12);
        for (std::size_t f = 0; f < parts.size(); ++f) {
            MarkerSetModel set;
            set.level = parts[f].level;
            set.marker_count = static_cast<std::uint16_t>(parts[f].markers.size());
            set.mode_count = 3;
            set.markers = parts[f].markers;
            set.mean_mm = parts[f].mean;
            set.modes = parts[f].modes;
            sets.push_back(set);
        }
        prepare_propagation(sets, *workspace);
    }

    void add(std::uint8_t level, std::uint16_t begin, std::uint16_t end) {
        Part part;
        part.level = level;
        std::vector<std::vector<double>> rows;
        for (std::uint16_t k = begin; k < end; ++k) part.markers.push_back(k);
        part.mean.assign(3 * part.markers.size(), 0.0F);
        for (const auto& motion : motions) {
            std::vector<double> v(motion.begin() + 3 * begin, motion.begin() + 3 * end);
            for (int pass = 0; pass < 2; ++pass) {
                for (const std::vector<double>& u : rows) {
                    double along = 0.0;
                    for (std::size_t r = 0; r < v.size(); ++r) along += u[r] * v[r];
                    for (std::size_t r = 0; r < v.size(); ++r) v[r] -= along * u[r];
                }
            }
            double square = 0.0;
            for (const double x : v) square += x * x;
            for (double& x : v) x /= std::sqrt(square);
            for (const double x : v) part.modes.push_back(static_cast<float>(x));
            rows.push_back(v);
        }
        parts.push_back(part);
    }

    std::vector<Vec3> face(double a, double b, double c) const {
        std::vector<Vec3> out(12);
        for (std::size_t r = 0; r < 36; ++r) {
            out[r / 3][static_cast<Eigen::Index>(r % 3)] =
                a * motions[0][r] + b * motions[1][r] + c * motions[2][r];
        }
        return out;
    }

    struct Part {
        std::uint8_t level;
        std::vector<std::uint16_t> markers;
        std::vector<float> mean, modes;
    };
    std::array<std::array<double, 36>, 3> motions{};
    std::vector<Part> parts;
    std::vector<MarkerSetModel> sets;
    std::unique_ptr<PropagationWorkspace> workspace = std::make_unique<PropagationWorkspace>();
};

constexpr std::array<bool, 12> kHalfKnown{true, false, true, false, true, false,
                                          true, false, true, false, true, false};

TEST(MotionPropagation, FindsAFaceOfTheSubspaceFromHalfOfItsMarkers) {
    for (const bool fine : {true, false}) {
        Hierarchy h;
        const std::vector<Vec3> truth = h.face(1.0, -0.5, 2.0);
        std::vector<Vec3> made = truth;
        for (std::size_t k = 0; k < 12; ++k) {
            if (!kHalfKnown[k]) made[k] = Vec3{9.0, 9.0, 9.0};  // not to be read
        }
        const PropagationReport report = propagate_motion(
            h.sets, kHalfKnown, {.most_sweeps = 2000, .least_progress_mm = -1.0, .begins_fine = fine},
            *h.workspace, made);
        EXPECT_EQ(report.sweeps, 2000);
        EXPECT_FALSE(report.settled);
        EXPECT_LT(report.known_error_mm, 1e-5);
        for (std::size_t k = 0; k < 12; ++k) EXPECT_LT((made[k] - truth[k]).norm(), 1e-4) << k;
    }
}

TEST(MotionPropagation, VisitsEachSetOnceASweep) {
    Hierarchy h;
    std::vector<Vec3> made = h.face(1.0, 1.0, 1.0);
    EXPECT_EQ(propagate_motion(h.sets, kHalfKnown, {}, *h.workspace, made).sets_visited, 7);
    // Without the whole face and the halves, quarters have no neighbours: only the first is reached.
    const std::span<const MarkerSetModel> quarters = std::span<const MarkerSetModel>(h.sets).subspan(3);
    prepare_propagation(quarters, *h.workspace);
    EXPECT_EQ(propagate_motion(quarters, kHalfKnown, {}, *h.workspace, made).sets_visited, 1);
}

TEST(MotionPropagation, StopsWhenTheKnownMarkersGetNoNearerOrAtItsCap) {
    Hierarchy h;
    std::vector<Vec3> made = h.face(1.0, -0.5, 2.0);
    const PropagationReport coarse =
        propagate_motion(h.sets, kHalfKnown, {.least_progress_mm = 0.5}, *h.workspace, made);
    EXPECT_TRUE(coarse.settled);
    EXPECT_LT(coarse.sweeps, 50);
    made = h.face(1.0, -0.5, 2.0);
    const PropagationReport fine = propagate_motion(
        h.sets, kHalfKnown, {.most_sweeps = 3, .least_progress_mm = 0.0}, *h.workspace, made);
    EXPECT_EQ(fine.sweeps, 3);
    EXPECT_FALSE(fine.settled);
}

TEST(MotionPropagation, TheErrorAtKnownMarkersFallsFromSweepToSweep) {
    Hierarchy h;
    double before = 1e9;
    for (const std::uint16_t sweeps : {1, 2, 4, 8, 16, 32}) {
        std::vector<Vec3> made = h.face(1.0, -0.5, 2.0);
        const double now =
            propagate_motion(h.sets, kHalfKnown, {.most_sweeps = sweeps, .least_progress_mm = -1.0},
                             *h.workspace, made)
                .known_error_mm;
        EXPECT_LT(now, before) << sweeps;
        before = now;
    }
}

TEST(MotionPropagation, NothingKnownMovesNothing) {
    Hierarchy h;
    std::vector<Vec3> made = h.face(1.0, 1.0, 1.0);
    const std::array<bool, 12> none{};
    const PropagationReport report = propagate_motion(h.sets, none, {}, *h.workspace, made);
    EXPECT_EQ(report.sweeps, 0);
    for (const Vec3& d : made) EXPECT_EQ(d.norm(), 0.0);
}

TEST(MotionPropagation, UsesNoMoreModesThanAsked) {
    Hierarchy h;
    std::vector<Vec3> made = h.face(1.0, -0.5, 2.0);
    const PropagationReport one =
        propagate_motion(h.sets, kHalfKnown, {.most_sweeps = 200, .most_modes = 1, .least_progress_mm = -1.0},
                         *h.workspace, made);
    EXPECT_GT(one.known_error_mm, 0.1) << "three motions are not one";
}

}  // namespace
}  // namespace rig
