#include "tests/replay/stream_bounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/replay/replay_streams.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::test {

namespace {

struct Errors {
    double weight_rms = 0.0;
    double marker_rms_mm = 0.0;
};

Errors errors_of(const ReplayPack& pack, const ReplayRun& run,
                 const std::vector<std::vector<double>>& truth) {
    double weights = 0.0;
    double markers = 0.0;
    std::size_t counted = 0;
    std::vector<bool> visible;
    for (std::size_t i = 0; i < pack.shape_count(); ++i) visible.push_back(pack.column_length(i) > 1.0);
    for (std::size_t frame = 0; frame < truth.size(); ++frame) {
        std::vector<double> difference;
        for (std::size_t i = 0; i < pack.shape_count(); ++i) {
            difference.push_back(static_cast<double>(run.weights[frame][i]) - truth[frame][i]);
        }
        markers += pack.marker_error2(difference);
        for (std::size_t i = 0; i < pack.shape_count(); ++i) {
            if (!visible[i]) continue;
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

}  // namespace

void PrintTo(const StreamCase& c, std::ostream* out) {
    *out << c.take << '/' << c.markers << '/' << c.stream;
}

void expect_within_bounds(const StreamCase& c) {
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
    // What single precision owes: no variable would move by more than this in a projected Jacobi step.
    EXPECT_LT(run.worst_kkt, 1e-5) << "every frame carries its certificate";
    EXPECT_GE(run.optimal, stream.frames - 10);
}

}  // namespace rig::test
