// Markers that come off or slide in the recorded takes: which are flagged, after how long, and who else is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/identity_scene.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kFrames = 1500;
constexpr std::size_t kBegin = 300;  // of what happens to the marker
constexpr double kSlideMm = 3.0;     // towards the nearest neighbour

enum class Mishap : std::uint8_t { kNone, kFallsOff, kSlides, kKnocked, kHidden };
struct MishapCase {
    Mishap mishap;
    const char* name;
    std::size_t lasts;  // frames that it takes
    MarkerTrouble expected;
};
constexpr std::array kCases{
    MishapCase{Mishap::kFallsOff, "falls off", 0, MarkerTrouble::kFallen},
    MishapCase{Mishap::kSlides, "slides by 3 mm in 5 s", 300, MarkerTrouble::kSlid},
    MishapCase{Mishap::kKnocked, "is knocked aside by 3 mm", 1, MarkerTrouble::kSlid},
    MishapCase{Mishap::kHidden, "hidden for 2 s", 120, MarkerTrouble::kNone},
    MishapCase{Mishap::kNone, "nothing happens", 0, MarkerTrouble::kNone},
};

struct MishapFigures {
    std::size_t runs = 0;
    std::size_t missed = 0;         // that should have been flagged and were not
    std::size_t flagged_wrong = 0;  // markers flagged that nothing happened to, or as something else
    std::size_t wrong_names = 0;    // sightings
    std::size_t slowest_frames = 0;
    double weakest_mm = std::numeric_limits<double>::infinity();  // slide as measured
};

// Where the marker is in a frame of the run; false: nowhere to be seen.
bool place(const MishapCase& mishap, std::size_t frame, const Vec3& slide_mm, Vec3& marker_mm) {
    if (frame < kBegin) return true;
    const std::size_t since = frame - kBegin;
    if (mishap.mishap == Mishap::kFallsOff) return false;
    if (mishap.mishap == Mishap::kHidden) return since >= mishap.lasts;
    if (mishap.mishap == Mishap::kNone) return true;
    marker_mm += std::min(1.0, static_cast<double>(since) / static_cast<double>(mishap.lasts)) * slide_mm;
    return true;
}

void run_mishap(const IdentityScene& scene, const Take& take, const MishapCase& mishap, std::size_t marker,
                MishapFigures& out) {
    WhiteNoise random(900 + marker);
    IdentityRun run(scene.view);
    const MarkerLayout& layout = scene.head.layout;
    const std::size_t near = nearest_neighbour(layout, marker);
    Vec3 slide =
        point_at(layout.markers[near].neutral_mm, 0) - point_at(layout.markers[marker].neutral_mm, 0);
    slide *= kSlideMm / slide.norm();
    const std::size_t first = (97 * marker) % (take.frame_count - kFrames);
    std::array<bool, kMaxMarkers> blamed{};
    std::size_t noticed = 0;
    for (std::size_t f = 0; f < kFrames; ++f) {
        const std::vector<Vec3> markers = face_markers(scene.head.model, take, first + f);
        std::vector<Vec3> points;
        std::vector<int> truth;
        for (std::size_t k = 0; k < markers.size(); ++k) {
            Vec3 point = markers[k] + 0.1 * Vec3{random.next(), random.next(), random.next()};
            if (k == marker && !place(mishap, f, slide, point)) continue;
            points.push_back(point);
            truth.push_back(static_cast<int>(k));
        }
        run.begin_frame();
        run.add_points(points, truth);
        out.wrong_names += run.track().wrong;
        for (std::size_t k = 0; k < markers.size(); ++k) {
            const MarkerTrouble trouble = run.report().trouble[k];
            if (trouble == MarkerTrouble::kNone) continue;
            if (k == marker && trouble == mishap.expected) {
                if (noticed == 0) noticed = f + 1 - kBegin;
            } else {
                blamed[k] = true;
            }
        }
    }
    ++out.runs;
    out.flagged_wrong += static_cast<std::size_t>(std::count(blamed.begin(), blamed.end(), true));
    out.slowest_frames = std::max(out.slowest_frames, noticed);
    if (mishap.expected != MarkerTrouble::kNone && noticed == 0) ++out.missed;
    if (mishap.expected == MarkerTrouble::kSlid && noticed > 0)
        out.weakest_mm = std::min(out.weakest_mm, static_cast<double>(run.report().off_mm[marker]));
}

}  // namespace

Result<ExperimentTable, FileError> identity_troubles(const std::filesystem::path& data) {
    const auto scene = load_identity_scene(data);
    if (!scene) return failure(scene.error());
    ExperimentTable out;
    out.columns = {"take, one marker", "markers tried",   "not flagged",
                   "others flagged",   "slowest, frames", "slide measured, least mm",
                   "wrong names"};
    for (const bool speech : {false, true}) {
        const Take& take = speech ? (*scene)->head.speech : (*scene)->head.range_of_motion;
        for (const MishapCase& mishap : kCases) {
            MishapFigures figures;
            const std::size_t step = mishap.mishap == Mishap::kNone ? 20 : 3;
            for (std::size_t k = 0; k < (*scene)->head.layout.markers.size(); k += step)
                run_mishap(**scene, take, mishap, k, figures);
            const std::string name =
                fmt::format("{}, {}", speech ? "speech" : "range of motion", mishap.name);
            out.rows.push_back({name, fmt::format("{}", figures.runs), fmt::format("{}", figures.missed),
                                fmt::format("{}", figures.flagged_wrong),
                                fmt::format("{}", figures.slowest_frames),
                                std::isfinite(figures.weakest_mm) ? fmt::format("{:.1f}", figures.weakest_mm)
                                                                  : std::string("-"),
                                fmt::format("{}", figures.wrong_names)});
            out.bounds.push_back({name + ": not flagged", static_cast<double>(figures.missed), 0.0});
            out.bounds.push_back(
                {name + ": others flagged", static_cast<double>(figures.flagged_wrong), 0.0});
            out.bounds.push_back({name + ": wrong names", static_cast<double>(figures.wrong_names), 0.0});
        }
    }
    out.remarks = {
        "Every third marker, 25 s of the take each, 0.1 mm of noise; what happens begins after 5 s."};
    return out;
}

}  // namespace rig::host
