#include "firmware_host/companion/commands/calibrate_live.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

#include "core/limits.hpp"
#include "firmware_host/companion/capture/capture_text.hpp"
#include "firmware_host/companion/capture/live_cameras.hpp"
#include "firmware_host/companion/capture/shot_capture.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLineEvery = 50;  // moments without a shot, on a pipe

struct NamedSource {
    std::string name;
    std::string source;
};

// "left=/dev/video2" or "/dev/video2", which is called a, b, c... by its place.
std::vector<NamedSource> named_sources(const std::vector<std::string>& texts) {
    std::vector<NamedSource> named;
    for (const std::string& text : texts) {
        const std::size_t mark = text.find('=');
        const bool has_name = mark != std::string::npos && text.find('/') > mark;
        NamedSource each{std::string(1, static_cast<char>('a' + named.size() % 26)), text};
        if (has_name) each = {text.substr(0, mark), text.substr(mark + 1)};
        named.push_back(std::move(each));
    }
    return named;
}

std::string fault_of(const std::vector<NamedSource>& named) {
    if (named.size() > kMaxCameras)
        return fmt::format("{} cameras are given; a rig carries at most {}", named.size(), kMaxCameras);
    constexpr const char* kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-";
    for (std::size_t i = 0; i < named.size(); ++i) {
        const std::string& name = named[i].name;
        if (name.empty() || name.size() > 24 || name.find_first_not_of(kAllowed) != std::string::npos)
            return fmt::format("camera name \"{}\": letters, digits and - only, up to 24", name);
        for (std::size_t j = 0; j < i; ++j)
            if (named[j].name == name) return fmt::format("two cameras are called {}", name);
    }
    return {};
}

// Draws over its own lines on a terminal; on a pipe one line a shot and now and then.
class CaptureScreen {
  public:
    explicit CaptureScreen(std::vector<std::string> names) : names_(std::move(names)) {}

    void show(const CaptureStatus& status) {
        if (is_interactive()) {
            std::string text = drawn_ == 0 ? std::string() : fmt::format("\x1b[{}A", drawn_);
            if (status.took) text += '\a';
            const std::size_t columns = error_columns() - 1;  // a line that wraps would not be drawn over
            const std::vector<std::string> lines = capture_lines(status, names_);
            for (const std::string& line : lines) text += "\r\x1b[K" + line.substr(0, columns) + "\n";
            fmt::print(stderr, "{}", text);
            drawn_ = lines.size();
        } else if (status.took || status.moments - said_at_ >= kLineEvery) {
            fmt::print(stderr, "{}\n", capture_line(status, names_));
            said_at_ = status.moments;
        }
        std::fflush(stderr);
    }

  private:
    std::vector<std::string> names_;
    std::size_t drawn_ = 0;
    std::size_t said_at_ = 0;
};

std::string folders_text(const std::vector<std::string>& folders) {
    return fmt::format("--images {}", fmt::join(folders, " "));
}

// Empty, or what stands in the way of taking shots into these folders.
std::string shots_in_the_way(const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) {
        std::error_code ignored;
        if (fs::exists(folder, ignored) && !fs::is_empty(folder, ignored)) {
            return fmt::format(
                "{} has shots of an earlier session: --continue goes on from them, --shots FOLDER takes "
                "another folder, {} calibrates from them",
                folder, folders_text(folders));
        }
    }
    return {};
}

int finished(const CaptureEnd& end, const CoveragePlan& plan, const std::vector<std::string>& names,
             const fs::path& shots, const std::vector<std::string>& images) {
    const std::string text = capture_end_text(end, names, shots.string());
    if (end.shots == 0 || end.kind == CaptureEndKind::kGone) {
        print_error(text + (end.shots == 0 ? "" : " " + folders_text(images)));
        return kExitInput;
    }
    for (std::size_t c = 0; c < names.size(); ++c) {
        if (plan.camera(c).pictures > 0) continue;
        print_error(
            fmt::format("{}, none of camera {}: it never saw the board{}; --continue goes on from them", text,
                        names[c], end.commonest[c].empty() ? "" : " (" + end.commonest[c] + ")"));
        return kExitInput;
    }
    fmt::print("{}; the same again: {}\n", text, folders_text(images));
    return kExitOk;
}

}  // namespace

int take_live_shots(const LiveOptions& options, const BoardSpec& board, const fs::path& result,
                    std::vector<std::string>& images) {
    const std::vector<NamedSource> named = named_sources(options.sources);
    if (const std::string fault = fault_of(named); !fault.empty()) {
        print_error(fault);
        return kExitUsage;
    }
    CaptureTask task;
    task.board = board;
    task.folder = options.shots;
    if (options.shots.empty()) {
        task.folder = result;
        task.folder.replace_filename(result.stem().string() + "_shots");
    }
    for (const NamedSource& each : named) {
        task.names.push_back(each.name);
        images.push_back((task.folder / each.name).string());
    }
    if (const std::string way = shots_in_the_way(images); !options.go_on && !way.empty()) {
        print_error(way);
        return kExitUsage;
    }
    std::vector<std::unique_ptr<PictureStream>> streams;
    for (const NamedSource& each : named) {
        auto stream = open_picture_stream(each.source);
        if (!stream) {
            print_error(fmt::format("camera {}: {}", each.name, stream.error().message));
            return kExitInput;
        }
        streams.push_back(std::move(*stream));
    }
    LiveCameras cameras(std::move(streams));
    ShotCapture capture(task);
    if (options.go_on) {
        const auto found = capture.resume_shots();
        if (!found) {
            print_error(found.error().message);
            return kExitInput;
        }
        fmt::print("{} shots in {} already\n", *found, task.folder.string());
    }
    CaptureScreen screen(task.names);
    const CaptureEvents events{[] { return interrupted() || enter_pressed(); },
                               [&screen](const CaptureStatus& status) { screen.show(status); }};
    const auto end = capture.run(cameras, events);
    clear_interrupt();  // Ctrl-C ended the pictures; a second one ends the calibration
    if (!end) {
        print_error(end.error().message);
        return kExitOutput;
    }
    return finished(*end, capture.plan(), task.names, task.folder, images);
}

}  // namespace rig::host
