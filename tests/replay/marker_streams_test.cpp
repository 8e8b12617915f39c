// The marker streams of a recorded range-of-motion take (alex_rom_3) and of recorded speech (facegood_3_15),
// solved by the pipeline without smoothing, against the weights that made them. Truth:
// takes/<take>_weights60.csv, from which the streams were computed as neutral + B w (exactly linear), then
// degraded. Bounds are two-sided: a figure far below its usual value is as suspicious as one above (a leak of
// truth, a stream that was not degraded, a metric that broke).
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "tests/replay/replay_streams.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::test {
namespace {

struct Bounds {
    double low;
    double high;
};

struct Case {
    const char* take;
    int markers;
    const char* stream;
    Bounds weight_rms;     // over shapes whose marker column is longer than 1 mm
    Bounds marker_rms_mm;  // of B (w - w_true), over coordinates
};

void PrintTo(const Case& c, std::ostream* out) {
    *out << c.take << '/' << c.markers << '/' << c.stream;
}

struct Errors {
    double weight_rms = 0.0;
    double marker_rms_mm = 0.0;
};

Errors errors_of(const ReplayPack& pack, const ReplayRun& run,
                 const std::vector<std::vector<double>>& truth) {
    double weights = 0.0;
    double markers = 0.0;
    std::size_t counted = 0;
    for (std::size_t frame = 0; frame < truth.size(); ++frame) {
        std::vector<double> difference;
        for (std::size_t i = 0; i < pack.shape_count(); ++i) {
            difference.push_back(static_cast<double>(run.weights[frame][i]) - truth[frame][i]);
        }
        markers += pack.marker_error2(difference);
        for (std::size_t i = 0; i < pack.shape_count(); ++i) {
            if (pack.column_length(i) <= 1.0) continue;
            weights += difference[i] * difference[i];
            ++counted;
        }
    }
    const double coordinates = 3.0 * pack.pack().marker_count * static_cast<double>(truth.size());
    return {std::sqrt(weights / static_cast<double>(counted)), std::sqrt(markers / coordinates)};
}

const ReplayPack& pack_of(const std::filesystem::path& data, int markers) {
    static std::map<int, ReplayPack> packs;
    return packs.try_emplace(markers, data, markers).first->second;
}

const std::vector<std::vector<double>>& truth_of(const std::filesystem::path& data, const std::string& take) {
    static std::map<std::string, std::vector<std::vector<double>>> truths;
    auto found = truths.find(take);
    if (found == truths.end()) found = truths.emplace(take, read_truth(data, take)).first;
    return found->second;
}

class MarkerStream : public testing::TestWithParam<Case> {};

TEST_P(MarkerStream, SolvesWithinItsBounds) {
    const Case& c = GetParam();
    RIG_SHARED_DATA_OR_SKIP(data, "");
    const std::string folder = std::string("markers/") + c.take + "/" + std::to_string(c.markers) + "/";
    RIG_SHARED_DATA_OR_SKIP(file, folder + c.stream + ".npy");
    PipelineConfig config;
    config.filter = false;
    const ReplayPack& pack = pack_of(data, c.markers);
    const ReplayStream stream = read_stream(file);
    const ReplayRun run = run_stream(pack, stream, config);
    const std::vector<std::vector<double>>& truth = truth_of(data, c.take);
    ASSERT_EQ(truth.size(), stream.frames);
    const Errors errors = errors_of(pack, run, truth);
    std::printf("%-13s %3d %-10s weight rms %.4f  marker rms %.4f mm  kkt %.1e", c.take, c.markers, c.stream,
                errors.weight_rms, errors.marker_rms_mm, run.worst_kkt);
    if (stream.unlabelled) {
        const double share = static_cast<double>(run.right) / static_cast<double>(run.visible);
        std::printf("  right %.4f wrong %zu ghosts named %zu", share, run.wrong, run.ghosts_named);
        EXPECT_GE(share, 0.995);
        EXPECT_EQ(run.wrong, 0U);
    }
    std::printf("\n");
    EXPECT_GE(errors.weight_rms, c.weight_rms.low);
    EXPECT_LE(errors.weight_rms, c.weight_rms.high);
    EXPECT_GE(errors.marker_rms_mm, c.marker_rms_mm.low);
    EXPECT_LE(errors.marker_rms_mm, c.marker_rms_mm.high);
    EXPECT_LT(run.worst_kkt, 1e-6) << "every frame carries its certificate";
    EXPECT_GE(run.optimal, stream.frames - 10);
}

INSTANTIATE_TEST_SUITE_P(
    Recorded, MarkerStream,
    testing::Values(Case{"alex_rom_3", 60, "truth", {0.002, 0.010}, {0.002, 0.012}},
                    Case{"alex_rom_3", 60, "noise01", {0.012, 0.030}, {0.035, 0.050}},
                    Case{"alex_rom_3", 60, "noise03", {0.03, 0.06}, {0.08, 0.15}},
                    Case{"alex_rom_3", 60, "slip", {0.002, 0.026}, {0.002, 0.03}},
                    Case{"alex_rom_3", 60, "drop05", {0.012, 0.030}, {0.035, 0.055}},
                    Case{"alex_rom_3", 60, "drop20", {0.013, 0.035}, {0.035, 0.070}},
                    Case{"alex_rom_3", 60, "swap", {0.012, 0.030}, {0.035, 0.055}},
                    Case{"alex_rom_3", 60, "combined", {0.013, 0.030}, {0.035, 0.060}},
                    Case{"alex_rom_3", 60, "unlabelled", {0.012, 0.050}, {0.035, 0.060}},
                    Case{"alex_rom_3", 50, "truth", {0.002, 0.010}, {0.002, 0.012}},
                    Case{"alex_rom_3", 50, "combined", {0.013, 0.035}, {0.035, 0.060}},
                    Case{"alex_rom_3", 102, "truth", {0.001, 0.010}, {0.001, 0.012}},
                    Case{"alex_rom_3", 102, "combined", {0.008, 0.030}, {0.020, 0.055}},
                    Case{"facegood_3_15", 60, "truth", {0.0005, 0.010}, {0.0005, 0.012}},
                    Case{"facegood_3_15", 60, "noise03", {0.010, 0.06}, {0.04, 0.15}},
                    Case{"facegood_3_15", 60, "slip", {0.0005, 0.026}, {0.0005, 0.03}},
                    Case{"facegood_3_15", 60, "drop20", {0.010, 0.06}, {0.02, 0.15}},
                    Case{"facegood_3_15", 60, "combined", {0.005, 0.030}, {0.020, 0.060}},
                    Case{"facegood_3_15", 60, "unlabelled", {0.005, 0.050}, {0.020, 0.060}},
                    Case{"facegood_3_15", 50, "combined", {0.005, 0.030}, {0.020, 0.060}},
                    Case{"facegood_3_15", 102, "combined", {0.004, 0.030}, {0.015, 0.055}}));

// The slip that comes out is the slip that went in: slip.csv, rotation vector and translation of every frame.
TEST(MarkerStreams, SlipIsRecovered) {
    RIG_SHARED_DATA_OR_SKIP(data, "");
    RIG_SHARED_DATA_OR_SKIP(file, "markers/alex_rom_3/60/slip.npy");
    std::ifstream in(file.parent_path() / "slip.csv");
    std::string line;
    std::getline(in, line);
    const ReplayPack& pack = pack_of(data, 60);
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
