// The recorded unlabelled streams of both takes: shuffled rows, ghosts, slip and dropouts, named from
// nothing.
#include <fmt/format.h>

#include <cmath>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/identity_scene.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

namespace {

struct Stream {
    NpyArray<float> points;      // [frames, slots, 3]
    NpyArray<std::int16_t> ids;  // [frames, slots]
};

Result<Stream, FileError> load_stream(const std::filesystem::path& folder) {
    auto points = read_npy<float>(folder / "unlabelled.npy");
    if (!points) return failure(points.error());
    auto ids = read_npy<std::int16_t>(folder / "unlabelled_id.npy");
    if (!ids) return failure(ids.error());
    const auto& shape = points->shape;
    if (shape.size() != 3 || shape[2] != 3 || ids->shape.size() != 2 || ids->shape[0] != shape[0] ||
        ids->shape[1] != shape[1]) {
        return failure(
            FileError{(folder / "unlabelled.npy").string() + ": does not go with unlabelled_id.npy"});
    }
    return Stream{std::move(*points), std::move(*ids)};
}

// Every frame counts, the first one too; `restart_every` frames identities are forgotten.
IdentityFigures run_stream(const IdentityScene& scene, const Stream& stream, std::size_t restart_every,
                           std::size_t& frames_without) {
    IdentityRun run(scene.view);
    const std::size_t slots = stream.points.shape[1];
    for (std::size_t f = 0; f < stream.points.shape[0]; ++f) {
        std::vector<Vec3> points;
        std::vector<int> truth;
        for (std::size_t s = 0; s < slots; ++s) {
            const float* x = stream.points.values.data() + 3 * (f * slots + s);
            points.emplace_back(static_cast<double>(x[0]), static_cast<double>(x[1]),
                                static_cast<double>(x[2]));
            truth.push_back(stream.ids.values[f * slots + s]);
        }
        if (restart_every != 0 && f % restart_every == 0) run.restart();
        run.begin_frame();
        run.add_points(points, truth);
        run.track();
        frames_without += run.report().tracking ? 0U : 1U;
    }
    return run.figures();
}

}  // namespace

Result<ExperimentTable, FileError> identity_unlabelled(const std::filesystem::path& data) {
    const auto scene = load_identity_scene(data);
    if (!scene) return failure(scene.error());
    ExperimentTable out;
    out.columns = {"stream",      "frames",       "not tracking",          "visible",        "named right",
                   "named wrong", "ghosts taken", "longest wrong, frames", "converged wrong"};
    for (const char* take : {"alex_rom_3", "facegood_3_15"}) {
        const auto stream = load_stream(data / "markers" / take / "60");
        if (!stream) return failure(stream.error());
        for (const std::size_t restart_every : {std::size_t{0}, std::size_t{30}}) {
            std::size_t without = 0;
            const IdentityFigures figures = run_stream(**scene, *stream, restart_every, without);
            const std::string name =
                restart_every == 0 ? take : fmt::format("{}, forgotten every {} frames", take, restart_every);
            out.rows.push_back({name, fmt::format("{}", figures.frames), fmt::format("{}", without),
                                fmt::format("{}", figures.visible), fmt::format("{}", figures.right),
                                fmt::format("{}", figures.wrong),
                                fmt::format("{} of {}", figures.ghosts_taken, figures.ghosts),
                                fmt::format("{}", figures.longest_wrong_frames),
                                fmt::format("{}", figures.converged_wrong)});
            out.bounds.push_back({name + ": share not named right", 1.0 - figures.right_share(), 0.001});
            out.bounds.push_back({name + ": ghosts taken", static_cast<double>(figures.ghosts_taken), 0.0});
            out.bounds.push_back(
                {name + ": markers converged wrong", static_cast<double>(figures.converged_wrong), 0.0});
        }
    }
    out.remarks = {"Visible: points of a marker; all frames count from the first one on."};
    return out;
}

}  // namespace rig::host
