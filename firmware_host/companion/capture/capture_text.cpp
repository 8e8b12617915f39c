#include "firmware_host/companion/capture/capture_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rig::host {

namespace {

std::string motion_text(const CameraStatusLine& line) {
    if (line.motion == BoardMotion::kUnseen) return line.fault.empty() ? "board not seen" : line.fault;
    return fmt::format("{}, {} points", line.motion == BoardMotion::kStill ? "held still" : "moving",
                       line.points);
}

// The tilts that are still lacking, one letter each: top, bottom, left, right of the board away.
std::string tilts_text(const CoverageProgress& camera, const CoverageGoal& goal) {
    std::string text;
    for (std::size_t t = 1; t < kTiltCount; ++t)
        if (camera.tilts[t] < goal.each_tilt) text += "?TBLR"[t];
    return text.empty() ? "all tilts" : "lacks tilt " + text;
}

std::string next_text(const CaptureStatus& status, std::span<const std::string> names) {
    const bool moving = std::ranges::any_of(
        status.cameras, [](const CameraStatusLine& line) { return line.motion == BoardMotion::kMoving; });
    const std::string advice = status.plan->advice(names);
    if (advice.empty()) return "done";
    return moving ? advice + "; keep it still" : advice;
}

}  // namespace

std::vector<std::string> capture_lines(const CaptureStatus& status, std::span<const std::string> names) {
    const CoveragePlan& plan = *status.plan;
    std::vector<std::string> lines;
    lines.push_back(fmt::format("shots {}, {:.0f} % of what is needed; Enter ends", plan.shots(),
                                100.0 * plan.progress()));
    for (std::size_t c = 0; c < names.size(); ++c) {
        const CoverageProgress& camera = plan.camera(c);
        lines.push_back(
            fmt::format("camera {:<8} pictures {:>2}/{}  coverage {:>3.0f}/{:.0f} %  {:<15}{}  {}", names[c],
                        camera.pictures, plan.goal().pictures, 100.0 * camera.share(),
                        100.0 * plan.goal().fields, tilts_text(camera, plan.goal()),
                        camera.linked ? "" : "  not linked", motion_text(status.cameras[c])));
    }
    lines.push_back("next: " + next_text(status, names));
    return lines;
}

std::string capture_line(const CaptureStatus& status, std::span<const std::string> names) {
    const CoveragePlan& plan = *status.plan;
    std::string cameras;
    for (std::size_t c = 0; c < names.size(); ++c) {
        cameras += fmt::format(" {} {}/{} pictures {:.0f} %,", names[c], plan.camera(c).pictures,
                               plan.goal().pictures, 100.0 * plan.camera(c).share());
    }
    return fmt::format("shot {}:{} next: {}", plan.shots(), cameras, next_text(status, names));
}

std::string capture_end_text(const CaptureEnd& end, std::span<const std::string> names,
                             const std::string& shots) {
    if (end.shots == 0) {
        std::string text = "no shot was taken";
        for (std::size_t c = 0; c < names.size(); ++c) {
            if (end.seen[c] == 0) {
                text += fmt::format("; camera {} never saw the board{}", names[c],
                                    end.commonest[c].empty() ? "" : " (" + end.commonest[c] + ")");
            } else {
                text += fmt::format("; camera {} saw it in {} pictures, never still", names[c], end.seen[c]);
            }
        }
        if (end.kind == CaptureEndKind::kGone)
            return fmt::format("{}; camera {} went away: {}", text, names[end.camera], end.fault);
        return text +
               ". Is --board what is printed, is it lit evenly, wholly in the picture, and held still?";
    }
    const std::string kept = fmt::format("{} shots are kept in {}", end.shots, shots);
    switch (end.kind) {
        case CaptureEndKind::kComplete:
            return kept + ": enough of every camera";
        case CaptureEndKind::kStopped:
            return kept + ": ended before everything was covered";
        case CaptureEndKind::kEnded:
            return fmt::format("{}: the pictures of camera {} are over", kept, names[end.camera]);
        case CaptureEndKind::kGone:
            break;
    }
    return fmt::format(
        "camera {} went away: {}; {}. Plug it in and run the same command with --continue, or calibrate from "
        "what is there with --images",
        names[end.camera], end.fault, kept);
}

}  // namespace rig::host
