// Swapped names: in the recorded labelled streams, and put into the memory of a tracker of unlabelled points.
// How long a name stays with the wrong marker.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/identity_scene.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kMostFramesToRepair = 5;
constexpr std::size_t kMarkers = 60;
constexpr std::uint64_t kNoiseSeed = 411;

struct Swap {
    std::size_t begin = 0;  // rows of the stream, end not included
    std::size_t end = 0;
    std::size_t a = 0;
    std::size_t b = 0;
};

struct Labelled {
    std::vector<std::vector<Vec3>> truth;    // [frames][markers], with noise, right names
    std::vector<std::vector<Vec3>> claimed;  // the same with swaps
    std::vector<Swap> swaps;
};

struct RepairFigures {
    std::size_t swaps = 0;
    std::size_t longest_frames = 0;  // from the swap's begin until no name of it is wrong any more
    std::size_t wrong = 0;           // marker and frame, anywhere
    std::size_t withheld = 0;        // seen by the stream, without a name afterwards
    std::size_t not_repaired = 0;    // within kMostFramesToRepair
};

Result<std::vector<Swap>, FileError> load_swaps(const std::filesystem::path& csv, std::size_t markers,
                                                std::size_t frames) {
    const auto table = read_numeric_csv(csv);
    if (!table) return failure(table.error());
    std::vector<Swap> swaps;
    if (table->columns.size() != 4) return failure(FileError{csv.string() + ": not four columns"});
    for (std::size_t r = 0; r < table->row_count; ++r) {
        std::array<std::size_t, 4> at{};
        for (std::size_t c = 0; c < 4; ++c) {
            const double x = table->values[4 * r + c];
            at[c] = x >= 0.0 && x <= static_cast<double>(frames) ? static_cast<std::size_t>(x) : frames;
        }
        const Swap swap{at[0], at[1], at[2], at[3]};
        if (swap.a >= markers || swap.b >= markers || swap.begin >= swap.end || swap.begin == 0)
            return failure(FileError{csv.string() + ": a swap that cannot be"});
        swaps.push_back(swap);
    }
    return swaps;
}

Result<std::vector<std::vector<Vec3>>, FileError> load_rows(const std::filesystem::path& file) {
    auto stream = read_npy<float>(file);
    if (!stream) return failure(stream.error());
    if (stream->shape.size() != 3 || stream->shape[2] != 3 || stream->shape[1] != kMarkers)
        return failure(FileError{file.string() + ": not a stream of 60 markers"});
    std::vector<std::vector<Vec3>> rows(stream->shape[0]);
    for (std::size_t i = 0; i < stream->shape[0] * kMarkers; ++i) {
        const float* x = stream->values.data() + 3 * i;
        rows[i / kMarkers].emplace_back(static_cast<double>(x[0]), static_cast<double>(x[1]),
                                        static_cast<double>(x[2]));
    }
    return rows;
}

// swap.npy and noise01.npy where they were recorded, otherwise made in the same way: truth.npy, 0.1 mm of
// noise, and the swaps of swaps.csv.
Result<Labelled, FileError> load_labelled(const std::filesystem::path& folder, bool recorded) {
    auto truth = load_rows(folder / (recorded ? "noise01.npy" : "truth.npy"));
    if (!truth) return failure(truth.error());
    Labelled out;
    out.truth = std::move(*truth);
    auto swaps = load_swaps(folder / "swaps.csv", kMarkers, out.truth.size());
    if (!swaps) return failure(swaps.error());
    out.swaps = std::move(*swaps);
    if (recorded) {
        auto claimed = load_rows(folder / "swap.npy");
        if (!claimed) return failure(claimed.error());
        if (claimed->size() != out.truth.size())
            return failure(FileError{(folder / "swap.npy").string() + ": not as long as noise01.npy"});
        out.claimed = std::move(*claimed);
        return out;
    }
    WhiteNoise noise(kNoiseSeed);
    for (std::vector<Vec3>& row : out.truth) {
        for (Vec3& x : row) x += 0.1 * Vec3{noise.next(), noise.next(), noise.next()};
    }
    out.claimed = out.truth;
    for (const Swap& swap : out.swaps) {
        for (std::size_t f = swap.begin; f < std::min(swap.end, out.claimed.size()); ++f)
            std::swap(out.claimed[f][swap.a], out.claimed[f][swap.b]);
    }
    return out;
}

void finish(const Swap& swap, std::size_t last_wrong, RepairFigures& out) {
    const std::size_t frames = last_wrong + 1 - swap.begin;
    out.longest_frames = std::max(out.longest_frames, frames);
    out.not_repaired += frames > kMostFramesToRepair ? 1U : 0U;
}

RepairFigures run_labelled(const IdentityScene& scene, const Labelled& stream) {
    IdentityRun run(scene.view);
    RepairFigures out;
    out.swaps = stream.swaps.size();
    std::vector<std::size_t> last_wrong;
    for (const Swap& swap : stream.swaps) last_wrong.push_back(swap.begin - 1);
    for (std::size_t f = 0; f < stream.truth.size(); ++f) {
        run.check(stream.claimed[f]);
        for (std::size_t k = 0; k < kMarkers; ++k) {
            const NamedMarker& marker = run.named().markers[k];
            if (!marker.seen) {
                ++out.withheld;
                continue;
            }
            if ((marker.position_mm - stream.truth[f][k]).norm() < 0.5) continue;
            ++out.wrong;
            for (std::size_t s = 0; s < stream.swaps.size(); ++s) {
                const Swap& swap = stream.swaps[s];
                if ((k == swap.a || k == swap.b) && f >= swap.begin) last_wrong[s] = f;
            }
        }
    }
    for (std::size_t s = 0; s < stream.swaps.size(); ++s) finish(stream.swaps[s], last_wrong[s], out);
    return out;
}

// Every 20 frames the tracker's memories of a marker and its nearest neighbour are exchanged.
RepairFigures run_unlabelled(const IdentityScene& scene, const Take& take, std::uint64_t seed) {
    constexpr std::size_t kFrames = 1200;
    constexpr std::size_t kPeriod = 20;
    IdentityRun run(scene.view);
    SightingSource source(scene, {}, kFrames, seed);
    RepairFigures out;
    Swap swap;
    std::size_t last_wrong = 0;
    for (std::size_t f = 0; f < kFrames; ++f) {
        if (f % kPeriod == 0 && f > 0) {
            if (out.swaps > 0) finish(swap, last_wrong, out);
            swap.begin = f;
            swap.a = out.swaps++ % scene.head.layout.markers.size();
            swap.b = nearest_neighbour(scene.head.layout, swap.a);
            last_wrong = f - 1;
            run.exchange_memories(swap.a, swap.b);
        }
        source.add_frame(f, take, f, Rigid{}, run);
        const IdentityFigures frame = run.track();
        out.wrong += frame.wrong;
        out.withheld += frame.visible - frame.right - frame.wrong;
        if (frame.wrong > 0) last_wrong = f;
    }
    finish(swap, last_wrong, out);
    return out;
}

void add_row(const std::string& name, const RepairFigures& figures, ExperimentTable& table) {
    table.rows.push_back({name, fmt::format("{}", figures.swaps), fmt::format("{}", figures.longest_frames),
                          fmt::format("{}", figures.wrong), fmt::format("{}", figures.withheld)});
    table.bounds.push_back({name + ": frames until a swap is repaired, the longest",
                            static_cast<double>(figures.longest_frames),
                            static_cast<double>(kMostFramesToRepair)});
}

}  // namespace

Result<ExperimentTable, FileError> identity_swaps(const std::filesystem::path& data) {
    const auto scene = load_identity_scene(data);
    if (!scene) return failure(scene.error());
    ExperimentTable out;
    out.columns = {"swaps", "count", "longest, frames", "wrong names, all frames", "names withheld"};
    for (const bool recorded : {true, false}) {
        const char* take = recorded ? "alex_rom_3" : "facegood_3_15";
        const auto stream = load_labelled(data / "markers" / take / "60", recorded);
        if (!stream) return failure(stream.error());
        add_row(fmt::format("labelled, {}", take), run_labelled(**scene, *stream), out);
    }
    add_row("memories exchanged, range of motion",
            run_unlabelled(**scene, (*scene)->head.range_of_motion, 421), out);
    add_row("memories exchanged, speech", run_unlabelled(**scene, (*scene)->head.speech, 422), out);
    out.remarks = {
        "Labelled: the swaps of swaps.csv, on noise01.npy (swap.npy), for speech on truth.npy with 0.1 mm "
        "of noise. Frames: from the first swapped one until no name of the pair is wrong; 0: never "
        "wrong. Memories exchanged: position, velocity and bias of a marker and its nearest neighbour in the "
        "tracker of an unlabelled stream with dropouts and ghosts, each marker in turn.",
        "Before/after: a frame is named by motion, the face fitted, and named again by the fitted face; a "
        "name "
        "that differs is a repaired swap, which is the test of residuals before and after. Topology: the "
        "fitted face has the layout's order in itself."};
    return out;
}

}  // namespace rig::host
