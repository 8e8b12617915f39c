// Core's tracker, fed with sightings whose truth is known, and the count of what it names them: what the
// identity experiments share. Not for: making the sightings.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "core/track/tracker.hpp"

namespace rig::host {

// A name that is wrong for more frames in a row than this has converged to a wrong state.
inline constexpr std::size_t kPassingFrames = 10;

// Counts of sightings; a sighting is one marker in one view of one frame.
struct IdentityFigures {
    std::size_t frames = 0;
    std::size_t visible = 0;  // sightings of a marker
    std::size_t right = 0;
    std::size_t wrong = 0;   // named as another marker; the rest got no name
    std::size_t ghosts = 0;  // sightings of nothing
    std::size_t ghosts_taken = 0;
    std::size_t longest_wrong_frames = 0;  // in a row, one marker and view
    std::size_t converged_wrong = 0;       // markers in a view that were wrong for more than kPassingFrames

    void add(const IdentityFigures& other);
    [[nodiscard]] double right_share() const;
};

class IdentityRun {
  public:
    // The pack outlives the run.
    explicit IdentityRun(const SolvePack& pack, const TrackerConfig& config = {});

    // Identities are forgotten, counts stay.
    void restart();
    void begin_frame();
    // truth[i]: marker of point or observation i, -1 a ghost. Non-finite points are empty slots.
    void add_points(std::span<const Vec3> points_mm, std::span<const int> truth);
    void add_view(std::size_t camera, std::span<const Observation> observations, std::span<const int> truth);
    // Tracks the frame; what it was named alone, added to figures() when `count` is set. A run of wrong names
    // ends with a frame in which the name is right, free, or not counted.
    IdentityFigures track(bool count = true);

    // A labelled frame instead: entry k claims to be marker k. Nothing is counted.
    void check(std::span<const Vec3> labelled_mm);
    // What the tracker remembers of two markers changes places.
    void exchange_memories(std::size_t a, std::size_t b);

    [[nodiscard]] const IdentityFigures& figures() const { return figures_; }
    [[nodiscard]] const TrackerReport& report() const { return *report_; }
    [[nodiscard]] const NamedMarkers& named() const { return *named_; }
    // Of the last frame: the name of sighting i of a view, -1 none.
    [[nodiscard]] int name_of(std::size_t view, std::size_t i) const { return names_[view][i]; }

  private:
    void name_view(std::size_t view);
    void count_view(std::size_t view, IdentityFigures& frame);
    void count_runs(std::size_t view);

    const SolvePack& pack_;
    TrackerConfig config_;
    std::unique_ptr<ShapeModel> model_ = std::make_unique<ShapeModel>();
    std::unique_ptr<SightingSet> sightings_ = std::make_unique<SightingSet>();
    std::unique_ptr<TrackerState> state_ = std::make_unique<TrackerState>();
    std::unique_ptr<TrackerWorkspace> workspace_ = std::make_unique<TrackerWorkspace>();
    std::unique_ptr<NamedMarkers> named_ = std::make_unique<NamedMarkers>();
    std::unique_ptr<TrackerReport> report_ = std::make_unique<TrackerReport>();
    std::array<std::vector<int>, kMaxCameras> truth_;
    std::array<std::vector<int>, kMaxCameras> names_;
    std::array<std::array<std::size_t, kMaxMarkers>, kMaxCameras> wrong_run_{};
    IdentityFigures figures_;
};

}  // namespace rig::host
