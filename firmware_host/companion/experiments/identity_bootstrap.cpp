// Identities from nothing: starts at random poses, expressions, dropouts and ghosts, each followed for a
// second's half, so that a start that looks right and is not would show.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/identity_scene.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kStarts = 1000;
constexpr std::size_t kFramesToStart = 10;
constexpr std::size_t kFramesFollowed = 40;

struct StartCase {
    const char* name;
    bool speech;
    bool cameras;
    double rotation_deg;
    double translation_mm;
    std::uint64_t seed;
};
constexpr std::array kCases{
    StartCase{"range of motion, points", false, false, 25.0, 15.0, 1000},
    StartCase{"speech, points", true, false, 25.0, 15.0, 2000},
    StartCase{"range of motion, two cameras", false, true, 10.0, 15.0, 3000},
    StartCase{"speech, two cameras", true, true, 10.0, 15.0, 4000},
};

struct StartFigures {
    std::size_t right = 0;  // starts whose every visible marker has its name in the tenth frame
    std::size_t found = 0;  // ... that track at all
    std::size_t wrong = 0;  // ... with a wrong name among them
    std::size_t slowest_frames = 0;
    double slowest_ms = 0.0;            // of one tick, processor time
    std::vector<std::uint64_t> missed;  // seeds
    IdentityFigures after;              // from the tenth frame on
};

double cpu_ms() {
    return 1e3 * static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

void run_start(const IdentityScene& scene, const StartCase& start, std::uint64_t seed, IdentityRun& run,
               StartFigures& out) {
    WhiteNoise random(seed);
    const Take& take = start.speech ? scene.head.speech : scene.head.range_of_motion;
    const auto first = static_cast<std::size_t>(
        random.uniform() * static_cast<double>(take.frame_count - kFramesFollowed - kFramesToStart));
    const Rigid pose =
        random_pose(start.rotation_deg * std::numbers::pi / 180.0, start.translation_mm, random);
    SightingSource source(scene, {.dropout = 0.05, .ghosts_per_frame = 0.6, .cameras = start.cameras},
                          kFramesFollowed, seed);
    run.restart();
    const std::size_t converged = run.figures().converged_wrong;
    std::size_t frames = 0;
    IdentityFigures tenth;
    for (std::size_t f = 0; f < kFramesFollowed; ++f) {
        source.add_frame(f, take, first + f, pose, run);
        const double before_ms = cpu_ms();
        const IdentityFigures frame = run.track(f + 1 >= kFramesToStart);
        out.slowest_ms = std::max(out.slowest_ms, cpu_ms() - before_ms);
        if (frames == 0 && run.report().tracking) frames = f + 1;
        if (f + 1 == kFramesToStart) tenth = frame;
    }
    const bool found = frames != 0 && frames <= kFramesToStart;
    const bool right = tenth.right == tenth.visible && run.figures().converged_wrong == converged;
    out.found += found ? 1U : 0U;
    out.wrong += tenth.wrong > 0 ? 1U : 0U;
    out.right += found && right ? 1U : 0U;
    if (found) out.slowest_frames = std::max(out.slowest_frames, frames);
    if (!found || !right) out.missed.push_back(seed);
}

std::string listed(const std::vector<std::uint64_t>& seeds) {
    std::string text;
    for (std::size_t i = 0; i < std::min<std::size_t>(seeds.size(), 12); ++i)
        text += fmt::format("{}{}", i == 0 ? "" : " ", seeds[i]);
    return seeds.size() > 12 ? text + " ..." : text;
}

}  // namespace

Result<ExperimentTable, FileError> identity_bootstrap(const std::filesystem::path& data) {
    auto loaded = load_identity_scene(data);
    if (!loaded) return failure(loaded.error());
    const IdentityScene& scene = **loaded;
    ExperimentTable out;
    out.columns = {"starts",       "pose within",           "seeds",           "right",
                   "found",        "with a wrong name",     "slowest, frames", "visible named right",
                   "ghosts taken", "longest wrong, frames", "converged wrong", "slowest tick, ms",
                   "seeds missed"};
    for (const StartCase& start : kCases) {
        IdentityRun run(scene.view);
        StartFigures figures;
        for (std::uint64_t i = 0; i < kStarts; ++i) run_start(scene, start, start.seed + i, run, figures);
        figures.after = run.figures();
        out.rows.push_back(
            {start.name, fmt::format("{} deg, {} mm", start.rotation_deg, start.translation_mm),
             fmt::format("{}..{}", start.seed, start.seed + kStarts - 1), fmt::format("{}", figures.right),
             fmt::format("{}", figures.found), fmt::format("{}", figures.wrong),
             fmt::format("{}", figures.slowest_frames), fmt::format("{:.5f}", figures.after.right_share()),
             fmt::format("{} of {}", figures.after.ghosts_taken, figures.after.ghosts),
             fmt::format("{}", figures.after.longest_wrong_frames),
             fmt::format("{}", figures.after.converged_wrong), fmt::format("{:.1f}", figures.slowest_ms),
             listed(figures.missed)});
        const std::string name = start.name;
        out.bounds.push_back({name + ": share of starts not right within 10 frames",
                              1.0 - static_cast<double>(figures.right) / kStarts, 0.001});
        out.bounds.push_back(
            {name + ": markers converged wrong", static_cast<double>(figures.after.converged_wrong), 0.0});
    }
    return out;
}

}  // namespace rig::host
