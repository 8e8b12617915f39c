#include "firmware_host/companion/inspect/take_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <string_view>

#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/inspect/moment_watch.hpp"
#include "firmware_host/companion/replay/offline_pipeline.hpp"
#include "firmware_host/companion/replay/replay_log.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

// Ticks that lie more than half a period later than they should stand for lost ones.
std::uint64_t gaps_of(const TakeRecord& record) {
    std::uint64_t gaps = 0;
    for (std::size_t i = 1; i < record.ticks.size(); ++i) {
        const double step = (record.ticks[i].time_s - record.ticks[i - 1].time_s) * record.rate_hz;
        if (step > 1.5) gaps += static_cast<std::uint64_t>(std::llround(step)) - 1;
    }
    return gaps;
}

Result<void, FileError> check_stream(const InspectRequest& request, const SolvePack& pack,
                                     const NpyArray<float>& stream) {
    if (stream.shape.size() != 3 || stream.shape[2] != 3)
        return file_failure(request.take, "not a marker stream; expected an array (frames, markers, 3)");
    const std::size_t slots = stream.shape[1];
    if (request.unlabelled) {
        if (slots >= 1 && slots <= kMaxPoints) return {};
        return file_failure(request.take,
                            fmt::format("{} slots a frame; 1 to {} are possible", slots, kMaxPoints));
    }
    if (slots == pack.marker_count) return {};
    return file_failure(
        request.take,
        fmt::format("{} markers a frame, but {} was trained for {}; take a pack of this layout, "
                    "or say --unlabelled if the rows are shuffled",
                    slots, request.pack_name, pack.marker_count));
}

constexpr double kSamePlace_mm =
    0.5;  // a tracked place leans towards the fitted face; markers are farther apart

// A named row that was taken for a marker lies where that marker was seen; a dropped name is nobody's.
std::vector<std::int16_t> labels_of_named(const SolvePack& pack, const Pipeline& pipeline,
                                          std::span<const Vec3> positions) {
    std::vector<std::int16_t> labels(positions.size(), -1);
    for (std::size_t s = 0; s < positions.size(); ++s) {
        for (std::size_t k = 0; k < pack.marker_count; ++k) {
            const NamedMarker& marker = pipeline.named_markers().markers[k];
            const bool mine = marker.seen && (marker.position_mm - positions[s]).norm() < kSamePlace_mm;
            if (mine) labels[s] = static_cast<std::int16_t>(k);
        }
    }
    return labels;
}

}  // namespace

Result<TakeKind, FileError> kind_of_take(const fs::path& take) {
    std::error_code ignored;
    if (fs::is_directory(take, ignored)) return TakeKind::kPictures;
    std::ifstream file(take, std::ios::binary);
    if (!file) return file_failure(take, "cannot be read: is the name right?");
    std::array<char, 8> head{};
    file.read(head.data(), head.size());
    const std::string_view text(head.data(), static_cast<std::size_t>(file.gcount()));
    if (text.starts_with("RGO1")) return TakeKind::kLog;
    if (text == "RIGREC01") return TakeKind::kRecording;
    if (text.starts_with("\x93NUMPY")) return TakeKind::kStream;
    const std::string_view remedy = take.extension() == ".csv"
                                        ? "a table of weights tells nothing of the markers; give what "
                                          "`headrig record --raw` or --markers wrote"
                                        : "is no take: give a log of `headrigd --log-observations`, a "
                                          "recording of `headrig record --raw`, a "
                                          "marker stream (.npy) or a folder of pictures";
    return file_failure(take, remedy);
}

Result<TakeRecord, FileError> inspect_log(const InspectRequest& request, const OpenedPack& opened,
                                          const InspectProgress& progress) {
    const SolvePack& pack = opened.pack();
    TakeRecord record = empty_record(request.take, pack, "observation log of the daemon, solved again");
    record.counts_ghosts = true;
    for (std::size_t c = 0; c < pack.camera_count; ++c) record.cameras.push_back(std::to_string(c + 1));
    MomentWatch watch;
    const ReplayRequest replay{request.take, request.pack_name, request.another_pack, true};
    const auto replayed = replay_log(replay, opened, [&](const ReplayedTick& tick) {
        add_camera_tick(pack, tick.pipeline, tick.state, tick.report, tick.time_s, record);
        record.ticks.back().reset = tick.reset_before;
        watch.look(record, [&] {
            return camera_views(pack, tick.pipeline, tick.state, tick.report, record.cameras, {});
        });
        const auto done = static_cast<double>(record.ticks.size());
        return progress(record.ticks.size(), static_cast<std::uint64_t>(std::llround(done / tick.share)));
    });
    if (!replayed) return failure(replayed.error());
    record.rate_hz = replayed->rate_hz;
    record.missing_ticks = gaps_of(record);
    record.moments = watch.taken();
    record.cut = replayed->cut;
    if (replayed->controls) {
        record.remarks.emplace_back(
            "The log sets an artist's controls; they are left out here, since they change weights, not "
            "markers.");
    }
    return record;
}

Result<TakeRecord, FileError> inspect_stream(const InspectRequest& request, const SolvePack& pack,
                                             const InspectProgress& progress) {
    const auto stream = read_npy<float>(request.take);
    if (!stream) return failure(stream.error());
    if (const auto fits = check_stream(request, pack, *stream); !fits) return failure(fits.error());
    TakeRecord record = empty_record(
        request.take, pack, request.unlabelled ? "marker stream without names" : "marker stream with names");
    record.rate_hz = request.rate_hz > 0.0 ? request.rate_hz : static_cast<double>(pack.rate_hz);
    record.counts_ghosts = request.unlabelled;
    PipelineConfig config;
    config.filter = false;
    config.stabilise = request.stabilise;
    config.rate_hz = record.rate_hz;
    const auto configured = offline_pipeline(pack, config, request.pack_name);
    if (!configured) return failure(configured.error());
    Pipeline* const pipeline = configured->get();
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    MomentWatch watch;
    std::vector<Vec3> positions(stream->shape[1]);
    for (std::size_t frame = 0; frame < stream->shape[0]; ++frame) {
        for (std::size_t s = 0; s < positions.size(); ++s) {
            positions[s] = point_at(stream->values, frame * positions.size() + s);
        }
        const double time_s = static_cast<double>(frame) / record.rate_hz;
        const auto capture_us = static_cast<std::int64_t>(std::llround(time_s * 1e6));
        std::size_t offered = 0;
        if (request.unlabelled) {
            offered = static_cast<std::size_t>(
                std::ranges::count_if(positions, [](const Vec3& p) { return p.allFinite(); }));
            pipeline->step(PointFrame{capture_us, positions}, *state, *report);
        } else {
            pipeline->step(LabelledFrame{capture_us, positions}, *state, *report);
        }
        add_tick(pack, *pipeline, *state, *report, offered, time_s, record);
        watch.look(record, [&] {
            if (request.unlabelled)
                return front_views(pack, *pipeline, *state, *report, positions, report->labels);
            const std::vector<std::int16_t> labels = labels_of_named(pack, *pipeline, positions);
            return front_views(pack, *pipeline, *state, *report, positions, labels);
        });
        if (!progress(frame + 1, stream->shape[0])) break;
    }
    record.moments = watch.taken();
    return record;
}

}  // namespace rig::host
