// Folders of pictures: detection, identity and solve, from pixels on.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>

#include "firmware_host/companion/calibrate/shot_files.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/inspect/moment_watch.hpp"
#include "firmware_host/companion/inspect/take_runs.hpp"
#include "firmware_host/companion/replay/offline_pipeline.hpp"
#include "firmware_host/companion/world/helmet.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

// One moment's files, in the pack's order of cameras; empty where a camera has none.
struct PictureTick {
    double time_s = 0.0;
    std::vector<fs::path> files;
};

struct PictureTake {
    std::vector<std::string> cameras;
    std::vector<PictureTick> ticks;
};

// The number at the end of a moment's name: "f00700_c.pgm" -> 700.
std::optional<std::int64_t> frame_number(const fs::path& file) {
    const std::string stem = file.stem().string();
    const std::string moment = stem.substr(0, stem.rfind('_'));
    const std::size_t start = moment.find_last_not_of("0123456789");
    const std::string digits = moment.substr(start == std::string::npos ? 0 : start + 1);
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
    return number;
}

// The order of the cameras.json beside the pictures, which is the pack's; without one, the alphabet's.
std::vector<std::size_t> camera_order(const fs::path& folder, const std::vector<std::string>& names) {
    std::vector<std::size_t> order(names.size());
    for (std::size_t c = 0; c < order.size(); ++c) order[c] = c;
    std::error_code ignored;
    if (!fs::exists(folder / "cameras.json", ignored)) return order;
    const auto helmet = load_helmet(folder / "cameras.json");
    if (!helmet || helmet->size() != names.size()) return order;
    std::vector<std::size_t> listed;
    for (const HelmetCamera& camera : *helmet) {
        const auto at = std::ranges::find(names, camera.name);
        if (at == names.end()) return order;
        listed.push_back(static_cast<std::size_t>(at - names.begin()));
    }
    return listed;
}

// Frame numbers that rise tell the time; else pictures follow one another at the rate.
void set_times(double rate_hz, PictureTake& take) {
    std::vector<std::int64_t> numbers;
    for (const PictureTick& tick : take.ticks) {
        const auto file = std::ranges::find_if(tick.files, [](const fs::path& f) { return !f.empty(); });
        const auto number = file == tick.files.end() ? std::nullopt : frame_number(*file);
        if (!number || (!numbers.empty() && *number <= numbers.back())) break;
        numbers.push_back(*number);
    }
    const bool numbered = numbers.size() == take.ticks.size();
    for (std::size_t i = 0; i < take.ticks.size(); ++i) {
        const double frames =
            numbered ? static_cast<double>(numbers[i] - numbers[0]) : static_cast<double>(i);
        take.ticks[i].time_s = frames / rate_hz;
    }
}

Result<PictureTake, FileError> find_pictures(const InspectRequest& request, const SolvePack& pack,
                                             double rate_hz) {
    const auto shots = find_shots_by_name(request.take);
    if (!shots) return failure(shots.error());
    if (shots->cameras.size() != pack.camera_count) {
        return file_failure(request.take,
                            fmt::format("pictures of {} cameras, but {} has {}; train a pack with the "
                                        "cameras.json of these pictures",
                                        shots->cameras.size(), request.pack_name, pack.camera_count));
    }
    const std::vector<std::size_t> order = camera_order(request.take, shots->cameras);
    PictureTake take;
    std::vector<std::size_t> place(order.size());
    for (std::size_t c = 0; c < order.size(); ++c) {
        place[order[c]] = c;
        take.cameras.push_back(shots->cameras[order[c]]);
    }
    for (const Shot& shot : shots->shots) {
        if (shot.moment >= take.ticks.size()) take.ticks.resize(shot.moment + 1);
        std::vector<fs::path>& files = take.ticks[shot.moment].files;
        files.resize(order.size());
        files[place[shot.camera]] = shot.file;
    }
    set_times(rate_hz, take);
    return take;
}

// Reads a tick's pictures into `images`, which `frame` then points into.
Result<void, FileError> read_tick(const PictureTick& tick, const SolvePack& pack,
                                  std::vector<GreyImage>& images, FrameSet& frame) {
    frame.capture_us = static_cast<std::int64_t>(std::llround(tick.time_s * 1e6));
    frame.camera_count = pack.camera_count;
    for (std::size_t c = 0; c < pack.camera_count; ++c) {
        frame.status[c] = CameraStatus::kMissing;
        frame.images[c] = ImageView{};
        if (tick.files[c].empty()) continue;
        auto image = read_grey_image(tick.files[c]);
        if (!image) return failure(image.error());
        const CameraModel& camera = pack.cameras[c];
        if (image->width_px != camera.width_px || image->height_px != camera.height_px) {
            return file_failure(tick.files[c], fmt::format("{} x {} px, but the pack's camera {} has {} x {}",
                                                           image->width_px, image->height_px, c + 1,
                                                           camera.width_px, camera.height_px));
        }
        images[c] = std::move(*image);
        frame.images[c] = images[c].view();
        frame.status[c] = CameraStatus::kGood;
    }
    return {};
}

}  // namespace

Result<TakeRecord, FileError> inspect_pictures(const InspectRequest& request, const SolvePack& pack,
                                               const InspectProgress& progress) {
    TakeRecord record = empty_record(request.take, pack, "pictures, detected and solved");
    record.rate_hz = request.rate_hz > 0.0 ? request.rate_hz : static_cast<double>(pack.rate_hz);
    record.counts_ghosts = true;
    const auto take = find_pictures(request, pack, record.rate_hz);
    if (!take) return failure(take.error());
    record.cameras = take->cameras;
    PipelineConfig config;
    config.filter = false;
    config.stabilise = request.stabilise;
    config.polarity = request.polarity;
    config.rate_hz = record.rate_hz;
    const auto configured = offline_pipeline(pack, config, request.pack_name);
    if (!configured) return failure(configured.error());
    Pipeline* const pipeline = configured->get();
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    std::vector<GreyImage> images(pack.camera_count);
    MomentWatch watch;
    for (const PictureTick& tick : take->ticks) {
        FrameSet frame;
        if (const auto read = read_tick(tick, pack, images, frame); !read) return failure(read.error());
        pipeline->step(frame, *state, *report);
        add_camera_tick(pack, *pipeline, *state, *report, tick.time_s, record);
        watch.look(record, [&] {
            return camera_views(pack, *pipeline, *state, *report, record.cameras, tick.files);
        });
        if (!progress(record.ticks.size(), take->ticks.size())) break;
    }
    record.moments = watch.taken();
    return record;
}

}  // namespace rig::host
