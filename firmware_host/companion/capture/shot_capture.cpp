#include "firmware_host/companion/capture/shot_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <utility>

#include "firmware_host/companion/calibrate/shot_files.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

PictureSize size_of(const GreyImage& image) {
    return {image.width_px, image.height_px};
}

}  // namespace

ShotCapture::ShotCapture(CaptureTask task)
    : task_(std::move(task)),
      plan_(task_.board, task_.names.size(), task_.goal),
      watches_(task_.names.size(), BoardWatch(task_.watch)),
      seen_(task_.names.size(), 0),
      reasons_(task_.names.size()) {
    status_.plan = &plan_;
    status_.cameras.resize(task_.names.size());
}

fs::path ShotCapture::shot_path(std::size_t camera, std::size_t number) const {
    return task_.folder / task_.names[camera] / fmt::format("{:04}.png", number);
}

Result<std::size_t, FileError> ShotCapture::resume_shots() {
    std::map<std::size_t, std::vector<std::size_t>> cameras_of;  // by number
    for (std::size_t c = 0; c < task_.names.size(); ++c) {
        const fs::path folder = task_.folder / task_.names[c];
        std::error_code ignored;
        if (!fs::exists(folder, ignored)) continue;
        const auto files = pictures_in(folder);
        if (!files) return failure(files.error());
        for (const fs::path& file : *files) {
            const std::string stem = file.stem().string();
            std::size_t number = 0;
            const auto read = std::from_chars(stem.data(), stem.data() + stem.size(), number);
            if (read.ec == std::errc{} && shot_path(c, number) == file) cameras_of[number].push_back(c);
        }
    }
    for (const auto& [number, cameras] : cameras_of) {
        std::vector<BoardSighting> sightings(task_.names.size());
        std::vector<PictureSize> sizes(task_.names.size());
        for (const std::size_t c : cameras) {
            const auto image = read_grey_image(shot_path(c, number));
            if (!image) return failure(image.error());
            sightings[c] = find_board(image->view(), task_.board);
            sizes[c] = size_of(*image);
        }
        plan_.take(sightings, sizes);
        next_number_ = number + 1;
    }
    return cameras_of.size();
}

Result<void, FileError> ShotCapture::save(const LiveMoment& moment,
                                          const std::vector<BoardSighting>& sightings) {
    for (std::size_t c = 0; c < task_.names.size(); ++c) {
        if (sightings[c].points.size() < kLeastPoints) continue;
        const fs::path path = shot_path(c, next_number_);
        std::error_code fault;
        fs::create_directories(path.parent_path(), fault);
        if (fault) return file_failure(path.parent_path(), "cannot be made: " + fault.message());
        if (const auto written = write_grey_image(path, moment.pictures[c].image.view()); !written)
            return failure(written.error());
    }
    ++next_number_;
    return {};
}

Result<void, FileError> ShotCapture::look_at(const LiveMoment& moment) {
    std::vector<BoardSighting> sightings;
    std::vector<PictureSize> sizes;
    bool still = true;
    for (std::size_t c = 0; c < task_.names.size(); ++c) {
        const GreyImage& image = moment.pictures[c].image;
        sizes.push_back(size_of(image));
        sightings.push_back(find_board(image.view(), task_.board));
        const BoardSighting& sighting = sightings.back();
        CameraStatusLine& line = status_.cameras[c];
        line.motion = watches_[c].push(moment.pictures[c].time_us, sighting);
        line.points = sighting.points.size();
        line.fault = sighting.fault;
        if (sighting.points.size() >= kLeastPoints) {
            ++seen_[c];
            still = still && line.motion == BoardMotion::kStill;
        } else if (!sighting.fault.empty()) {
            auto at =
                std::ranges::find(reasons_[c], sighting.fault, &std::pair<std::string, std::size_t>::first);
            if (at == reasons_[c].end()) at = reasons_[c].insert(at, {sighting.fault, 0});
            ++at->second;
        }
    }
    ++status_.moments;
    status_.took = still && plan_.adds(sightings, sizes);
    if (!status_.took) return {};
    if (const auto saved = save(moment, sightings); !saved) return saved;
    plan_.take(sightings, sizes);
    return {};
}

CaptureEnd ShotCapture::ended(CaptureEndKind kind) const {
    CaptureEnd end;
    end.kind = kind;
    end.shots = plan_.shots();
    end.seen = seen_;
    for (const auto& reasons : reasons_) {
        const auto most = std::ranges::max_element(reasons, {}, &std::pair<std::string, std::size_t>::second);
        end.commonest.push_back(most == reasons.end() ? std::string() : most->first);
    }
    return end;
}

Result<CaptureEnd, FileError> ShotCapture::run(LiveCameras& cameras, const CaptureEvents& events) {
    std::size_t waits = 0;
    while (!plan_.complete()) {
        if (events.stop()) return ended(CaptureEndKind::kStopped);
        const auto moment = cameras.next(task_.patience_us);
        if (!moment) {
            const LiveEnd& why = moment.error();
            if (why.kind == StreamEnd::kNothingYet && ++waits < task_.most_waits) continue;
            CaptureEnd end =
                ended(why.kind == StreamEnd::kEnded ? CaptureEndKind::kEnded : CaptureEndKind::kGone);
            end.camera = why.camera;
            end.fault = cameras.stream(why.camera).fault();
            if (end.fault.empty() && end.kind == CaptureEndKind::kGone)
                end.fault = "no picture for seconds that goes with the other cameras'";
            return end;
        }
        waits = 0;
        if (const auto looked = look_at(*moment); !looked) return failure(looked.error());
        events.show(status_);
    }
    return ended(CaptureEndKind::kComplete);
}

}  // namespace rig::host
