#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/replay/replay_streams.hpp"
#include "tests/replay/stream_bounds.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::test {
namespace {

class RangeOfMotion : public testing::TestWithParam<StreamCase> {};

TEST_P(RangeOfMotion, SolvesWithinItsBounds) {
    expect_within_bounds(GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Recorded, RangeOfMotion,
    testing::Values(StreamCase{"alex_rom_3", 60, "truth", {0.0045, 0.0070}, {0.008, 0.012}},
                    // Acceptance: weight rms <= 0.03, marker rms <= 0.05 mm.
                    StreamCase{"alex_rom_3", 60, "noise01", {0.014, 0.021}, {0.040, 0.050}},
                    StreamCase{"alex_rom_3", 60, "noise03", {0.038, 0.055}, {0.13, 0.19}},
                    // Acceptance: weight rms <= that of truth + 0.02.
                    StreamCase{"alex_rom_3", 60, "slip", {0.0045, 0.0080}, {0.015, 0.025}},
                    StreamCase{"alex_rom_3", 60, "drop05", {0.014, 0.021}, {0.040, 0.058}},
                    StreamCase{"alex_rom_3", 60, "drop20", {0.016, 0.025}, {0.050, 0.075}},
                    StreamCase{"alex_rom_3", 60, "swap", {0.014, 0.021}, {0.040, 0.056}},
                    StreamCase{"alex_rom_3", 60, "combined", {0.015, 0.023}, {0.046, 0.068}},
                    // Acceptance: weight rms <= 0.05.
                    StreamCase{"alex_rom_3", 60, "unlabelled", {0.014, 0.022}, {0.042, 0.064}}));

// The slip that comes out is the slip that went in: slip.csv, rotation vector and translation of every frame.
TEST(MarkerStreams, SlipIsRecovered) {
    RIG_SHARED_DATA_OR_SKIP(data, "");
    RIG_SHARED_DATA_OR_SKIP(file, "markers/alex_rom_3/60/slip.npy");
    std::ifstream in(file.parent_path() / "slip.csv");
    std::string line;
    std::getline(in, line);
    const ReplayPack pack = ReplayPack(data, 60);
    const ReplayRun run = run_stream(pack, read_stream(file), {});
    double rotation2 = 0.0;
    double at_face2 = 0.0;
    for (const Slip& slip : run.slips) {
        ASSERT_TRUE(std::getline(in, line));
        std::vector<double> cells;
        std::stringstream text(line);
        for (std::string cell; std::getline(text, cell, ',');) cells.push_back(std::stod(cell));
        Vec3 turn;
        Vec3 shift;
        for (std::size_t a = 0; a < 3; ++a) {
            turn[static_cast<Eigen::Index>(a)] = static_cast<double>(slip.rotation_rad[a]) - cells[1 + a];
            shift[static_cast<Eigen::Index>(a)] = static_cast<double>(slip.translation_mm[a]) - cells[4 + a];
        }
        rotation2 += turn.squaredNorm();
        // At the middle of the face, where a turn about the origin and a shift cannot hide each other.
        at_face2 += (shift + turn.cross(Vec3{0.0, -40.0, 10.0})).squaredNorm();
    }
    const double frames = static_cast<double>(run.slips.size());
    const double rotation_rad = std::sqrt(rotation2 / frames);
    const double at_face_mm = std::sqrt(at_face2 / frames);
    std::printf("slip: %.5f rad, %.4f mm at the face\n", rotation_rad, at_face_mm);
    EXPECT_LT(rotation_rad, 0.002);
    EXPECT_LT(at_face_mm, 0.15);
    EXPECT_GT(at_face_mm, 1e-4) << "better than rays of float32 allow";
}

}  // namespace
}  // namespace rig::test
