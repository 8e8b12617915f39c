// The experiments of the sources with key shapes and regions, on a real head and two real performances. The
// truth is exactly linear in 53 shapes, which flatters least squares.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/regional.hpp"
#include "firmware_host/companion/train/regional_training.hpp"
#include "tests/support/random.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::array<std::size_t, 2> kImageAxes{0, 1};
constexpr std::array<std::size_t, 3> kAllAxes{0, 1, 2};

struct Head {
    MarkerLayout layout;
    MarkerModel model;
    std::vector<Take> speech;
    std::vector<Take> range_of_motion;
};

std::vector<Take> take_of(const std::filesystem::path& data, const char* name, const Rig& rig) {
    auto take = load_take(data / "takes" / name, rig);
    EXPECT_TRUE(take.has_value()) << take.error().message;
    return {std::move(*take)};
}

// 102 markers.
const Head* head() {
    static const std::unique_ptr<Head> one = []() -> std::unique_ptr<Head> {
        const std::filesystem::path data = test::shared_data(".");
        if (data.empty()) return nullptr;
        const auto rig = load_rig(data / "rig");
        if (!rig) return nullptr;
        auto layout = load_layout(data / "rig", "102", *rig);
        if (!layout) return nullptr;
        auto head = std::make_unique<Head>();
        head->layout = std::move(*layout);
        head->model = marker_model(*rig, head->layout);
        head->speech = take_of(data, "facegood_3_15_weights60.csv", *rig);
        head->range_of_motion = take_of(data, "alex_rom_3_weights60.csv", *rig);
        return head;
    }();
    return one.get();
}

#define HEAD_OR_SKIP(variable)                   \
    RIG_SHARED_DATA_OR_SKIP(data_folder, "rig"); \
    const Head* const variable = head();         \
    ASSERT_NE(variable, nullptr);                \
    static_cast<void>(0)

RegionMotion mouth_motion(const Head& head, const std::vector<Take>& takes) {
    return region_motion(lip_region(head.layout), head.model.neutral_mm, head.model.basis_mm, takes,
                         kImageAxes);
}

struct Curve {
    std::vector<double> rms_mm;  // of the counts 4, 6, ... 24
};

constexpr std::array<KeyShapeMethod, 3> kMethods{KeyShapeMethod::kSpread, KeyShapeMethod::kClusters2,
                                                 KeyShapeMethod::kClusters3};

std::array<Curve, 3> error_curves(const char* name, const RegionMotion& motion) {
    std::array<Curve, 3> curves;
    fmt::print("{}: {} frames, {} coordinates; rms mm of a coordinate\n{:>6}", name,
               motion.positions_mm.rows(), motion.positions_mm.cols(), "k");
    for (const KeyShapeMethod method : kMethods) fmt::print(" {:>10}", key_shape_method_name(method));
    fmt::print("\n");
    for (std::size_t count = 4; count <= 24; count += 2) {
        fmt::print("{:>6}", count);
        for (std::size_t m = 0; m < kMethods.size(); ++m) {
            const KeyShapes shapes = choose_key_shapes(motion, kMethods[m], count);
            const KeyShapeError error = key_shape_error(motion.positions_mm, shapes);
            EXPECT_LT(error.worst_kkt, 1e-6);
            curves[m].rms_mm.push_back(error.rms_mm);
            fmt::print(" {:>10.4f}", error.rms_mm);
        }
        fmt::print("\n");
    }
    const KeyShapes hull = choose_key_shapes(motion, KeyShapeMethod::kHull, 0);
    fmt::print("{:>6} {:>10.4f} hull\n", hull.frames.size(),
               key_shape_error(motion.positions_mm, hull).rms_mm);
    return curves;
}

// [Chuang02 Fig. 6]: the error falls with the number of key shapes, and the maximum spread along the
// principal axes has the lowest.
TEST(Regions, ErrorAgainstNumberOfKeyShapes) {
    HEAD_OR_SKIP(face);
    const std::array<Curve, 3> speech = error_curves("speech, mouth", mouth_motion(*face, face->speech));
    const std::array<Curve, 3> motion =
        error_curves("range of motion, mouth", mouth_motion(*face, face->range_of_motion));
    for (const std::array<Curve, 3>* curves : {&speech, &motion}) {
        const std::vector<double>& spread = (*curves)[0].rms_mm;
        for (std::size_t i = 1; i < spread.size(); ++i)
            EXPECT_LE(spread[i], spread[i - 1] * (1.0 + 1e-9)) << i;
    }
    for (std::size_t i = 0; 4 + 2 * i <= 12; ++i) {
        EXPECT_LE(speech[0].rms_mm[i], speech[1].rms_mm[i]) << 4 + 2 * i;
        EXPECT_LE(speech[0].rms_mm[i], speech[2].rms_mm[i]) << 4 + 2 * i;
    }
}

struct Retargeting {
    double source_mm = 0.0;
    double target_mm = 0.0;
    double largest_weight = 0.0;
};

Retargeting retarget(const RegionMotion& motion, const KeyShapes& shapes, const MatrixXd& traced,
                     const MatrixXd& weights) {
    const auto rms = [](const MatrixXd& error) {
        return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
    };
    return {rms(weights * shapes.positions_mm - motion.positions_mm),
            rms(weights * traced - motion.positions_mm), weights.cwiseAbs().maxCoeff()};
}

// [Chuang02 Figs. 4-5]: least squares explains the source with large weights of both signs, which fall apart
// on shapes that were traced by hand; without negative weights they cannot cancel.
TEST(Regions, NonNegativeWeightsSurviveTracing) {
    HEAD_OR_SKIP(face);
    const RegionMotion motion = mouth_motion(*face, face->range_of_motion);
    const KeyShapes shapes = choose_key_shapes(motion, KeyShapeMethod::kSpread, 20);
    ASSERT_EQ(shapes.frames.size(), 20U);
    test::SeededRandom random(4);
    MatrixXd traced = shapes.positions_mm;
    for (double& x : traced.reshaped()) x += random.normal(0.0, 1.0);
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition(shapes.positions_mm.transpose());
    const MatrixXd plain = decomposition.solve(motion.positions_mm.transpose()).transpose();
    double kkt = 0.0;
    const MatrixXd positive = key_shape_weights(motion.positions_mm, shapes.positions_mm, kkt);
    const Retargeting least_squares = retarget(motion, shapes, traced, plain);
    const Retargeting nnls = retarget(motion, shapes, traced, positive);
    fmt::print("20 key shapes, 1 mm of tracing noise, rms mm of a coordinate\n");
    fmt::print("{:<14} {:>8} {:>8} {:>9}\n", "", "source", "target", "largest w");
    fmt::print("{:<14} {:>8.3f} {:>8.3f} {:>9.2f}\n", "least squares", least_squares.source_mm,
               least_squares.target_mm, least_squares.largest_weight);
    fmt::print("{:<14} {:>8.3f} {:>8.3f} {:>9.2f}\n", "nnls", nnls.source_mm, nnls.target_mm,
               nnls.largest_weight);
    EXPECT_LE(nnls.target_mm, 0.5 * least_squares.target_mm);
    EXPECT_LE(nnls.largest_weight, 1.2);
    EXPECT_LE(least_squares.source_mm, nnls.source_mm);  // it is the best fit of the source
}

// Every marker of every frame put together again from its regions' examples; rms mm of a coordinate.
double error_of_regions(const Head& head, const std::vector<FaceRegion>& plan, const MatrixXd& examples,
                        const RegionMotion& motion) {
    std::vector<TrainedRegion> regions;
    for (const FaceRegion& region : plan) {
        regions.push_back(region_of_examples(region, RegionSolver::kSimplex, head.model.neutral_mm,
                                             head.model.basis_mm, examples));
        regions.back().shape_blend.assign(static_cast<std::size_t>(examples.cols()), 0.0F);
    }
    const std::size_t markers = head.layout.markers.size();
    SolvePack pack;
    pack.marker_count = static_cast<std::uint16_t>(markers);
    pack.shape_count = static_cast<std::uint16_t>(examples.cols());
    pack.solver = SolverKind::kExamples;
    pack.region_count = static_cast<std::uint8_t>(regions.size());
    for (std::size_t r = 0; r < regions.size(); ++r) pack.regions[r] = regions[r].view();
    const auto tables = std::make_unique<RegionalTables>();
    const auto state = std::make_unique<RegionalState>();
    const auto workspace = std::make_unique<RegionalWorkspace>();
    RegionalOutput output;
    build_regional_tables(pack, *tables);
    const std::vector<Mat3> seen(markers, Mat3::Identity());
    const std::vector<float> confidence(pack.shape_count, 1.0F);
    std::vector<double> shape_weights(pack.shape_count);
    std::vector<Vec3> positions(markers);
    double sum = 0.0;
    for (Index f = 0; f < motion.positions_mm.rows(); ++f) {
        for (std::size_t k = 0; k < markers; ++k) {
            for (Index axis = 0; axis < 3; ++axis)
                positions[k][axis] = motion.positions_mm(f, 3 * static_cast<Index>(k) + axis);
        }
        solve_regions(pack, *tables, {positions, seen, confidence}, *state, *workspace, output,
                      shape_weights);
        std::vector<Vec3> made(markers, Vec3::Zero());
        for (std::size_t r = 0; r < regions.size(); ++r) {
            EXPECT_TRUE(output.regions[r].optimal) << "frame " << f << " kkt " << output.regions[r].kkt;
            const TrainedRegion& region = regions[r];
            const std::size_t stride = padded(region.example_count);
            for (std::size_t a = 0; a < region.markers.size(); ++a) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const std::size_t row = 3 * a + axis;
                    float x = region.origin_mm[row];
                    for (std::size_t j = 0; j < region.example_count; ++j)
                        x += output.coefficients[r][j] * region.examples_mm[row * stride + j];
                    made[region.markers[a]][static_cast<Index>(axis)] +=
                        static_cast<double>(region.marker_blend[a]) * static_cast<double>(x);
                }
            }
        }
        for (std::size_t k = 0; k < markers; ++k) sum += (made[k] - positions[k]).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(motion.positions_mm.size()));
}

// [Zhang06 section 5.3]: small regions reach expressions that the convex hull of whole faces does not hold.
TEST(Regions, FourteenRegionsAgainstTheWholeFace) {
    HEAD_OR_SKIP(face);
    const FaceRegion all = whole_face(face->layout)[0];
    // Absolute positions: about the neutral centroid they would not fit the examples' own origins.
    RegionMotion motion =
        region_motion(all, face->model.neutral_mm, face->model.basis_mm, face->range_of_motion, kAllAxes);
    const std::vector<Index> frames = example_frames(motion, 11);
    MatrixXd examples = MatrixXd::Zero(static_cast<Index>(frames.size()) + 1, motion.weights.cols());
    for (std::size_t j = 0; j < frames.size(); ++j)
        examples.row(static_cast<Index>(j) + 1) = motion.weights.row(frames[j]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double centroid = 0.0;
        for (std::size_t k = 0; k < face->layout.markers.size(); ++k)
            centroid += static_cast<double>(face->model.neutral_mm[3 * k + axis]);
        centroid /= static_cast<double>(face->layout.markers.size());
        for (Index k = static_cast<Index>(axis); k < motion.positions_mm.cols(); k += 3)
            motion.positions_mm.col(k).array() += centroid;
    }
    const std::vector<FaceRegion> surface = surface_regions(face->layout);
    EXPECT_EQ(surface.size(), 14U);
    const double whole = error_of_regions(*face, {all}, examples, motion);
    const double parts = error_of_regions(*face, surface, examples, motion);
    fmt::print("{} examples, {} frames: whole face {:.3f} mm, {} regions {:.3f} mm, ratio {:.3f}\n",
               examples.rows(), motion.positions_mm.rows(), whole, surface.size(), parts, parts / whole);
    EXPECT_LE(parts, 0.65 * whole);
    EXPECT_GT(parts, 0.1 * whole);
}

}  // namespace
}  // namespace rig::host
