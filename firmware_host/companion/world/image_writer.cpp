#include "firmware_host/companion/world/image_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

struct Run {
    const World& world;
    const std::filesystem::path& folder;
    const ImageOptions& options;
    TruthRecorder* truth;
    const ImageProgress& progress;
    std::vector<std::vector<MarkerSight>> sights{};  // per written frame, cameras outermost
    std::atomic<std::size_t> next{0};
    std::mutex mutex{};
    std::uint64_t done = 0;
    bool stop = false;
    std::string fault{};

    [[nodiscard]] std::size_t count() const {
        return (world.frame_count() + options.step - 1) / options.step;
    }
};

std::string stem(const World& world, std::size_t frame, std::size_t camera) {
    return fmt::format("f{:05}_{}", world.take_frame(frame), world.cameras()[camera].name);
}

std::string file_name(const Run& run, std::size_t frame, std::size_t camera) {
    return stem(run.world, frame, camera) + (run.options.png ? ".png" : ".pgm");
}

void draw_frames(Run& run) {
    WorldRenderer renderer(run.world);
    GreyImage image{run.world.cameras()[0].width_px, run.world.cameras()[0].height_px, {}};
    image.pixels.resize(run.world.image_bytes());
    const std::size_t markers = run.world.marker_count();
    for (std::size_t i = run.next++; i < run.count(); i = run.next++) {
        const std::size_t frame = i * run.options.step;
        std::vector<MarkerSight> sights(run.world.cameras().size() * markers);
        std::string fault;
        for (std::size_t camera = 0; camera < run.world.cameras().size() && fault.empty(); ++camera) {
            renderer.render(frame, camera, run.options.control, image.pixels,
                            std::span(sights).subspan(camera * markers, markers));
            const auto written = write_grey_image(run.folder / file_name(run, frame, camera), image.view());
            if (!written) fault = written.error().message;
        }
        if (run.truth != nullptr) run.truth->add(frame, sights);
        const std::lock_guard lock(run.mutex);
        run.sights[i] = std::move(sights);
        ++run.done;
        if (!fault.empty()) run.fault = fault;
        if (run.progress && !run.progress(run.done)) run.stop = true;
        if (run.stop || !run.fault.empty()) return;
    }
}

Result<void, FileError> save_truth(const Run& run) {
    CsvWriter table({"image", "marker", "name", "x_px", "y_px", "dot_cx_px", "dot_cy_px", "visible",
                     "dot_area_px", "cos_view", "X_mm", "Y_mm", "Z_mm"});
    const std::size_t markers = run.world.marker_count();
    for (std::size_t i = 0; i < run.sights.size(); ++i) {
        const std::size_t frame = i * run.options.step;
        const FrameTruth truth = run.world.truth(frame);
        for (std::size_t j = 0; j < run.sights[i].size(); ++j) {
            const std::size_t marker = j % markers;
            const MarkerSight& sight = run.sights[i][j];
            table.text(stem(run.world, frame, j / markers)).integer(static_cast<std::int64_t>(marker));
            table.text(run.world.marker_names()[marker]).number(sight.x_px, 4).number(sight.y_px, 4);
            table.number(sight.dot_x_px, 4).number(sight.dot_y_px, 4).integer(sight.visible ? 1 : 0);
            table.number(sight.dot_area_px, 1).number(sight.cos_view, 3);
            for (const double mm : truth.face_mm[marker]) table.number(mm, 4);
            table.end_row();
        }
    }
    return table.save(run.folder / "truth.csv");
}

std::vector<ImageRecord> records(const Run& run) {
    std::vector<ImageRecord> all;
    for (std::size_t i = 0; i < run.sights.size(); ++i) {
        const std::size_t frame = i * run.options.step;
        if (run.sights[i].empty()) continue;
        for (std::size_t camera = 0; camera < run.world.cameras().size(); ++camera) {
            const FaceView view = run.world.view(frame, camera);
            all.push_back({file_name(run, frame, camera), run.world.take_frame(frame), camera,
                           run.world.config().style == DotStyle::kInk ? "ink" : "retro", view.rotation,
                           -1.0 * multiply(transposed(view.rotation), view.offset_mm)});
        }
    }
    return all;
}

}  // namespace

Result<std::size_t, FileError> write_world_images(const World& world, const std::filesystem::path& folder,
                                                  const ImageOptions& options, TruthRecorder* truth,
                                                  const ImageProgress& progress) {
    if (auto made = make_folder(folder); !made) return failure(made.error());
    Run run{world, folder, options, truth, progress};
    run.sights.resize(run.count());
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 1; t < options.threads; ++t) threads.emplace_back([&run] { draw_frames(run); });
        draw_frames(run);
    }
    if (!run.fault.empty()) return failure(FileError{run.fault});
    const std::vector<ImageRecord> images = records(run);
    if (auto saved = save_truth(run); !saved) return failure(saved.error());
    if (auto saved = save_helmet(folder / "cameras.json", world.cameras(), world.config().dot_radius_mm,
                                 options.layout, images);
        !saved) {
        return failure(saved.error());
    }
    return images.size();
}

}  // namespace rig::host
