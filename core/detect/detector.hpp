// The detection stage: a grey image in, marker observations out. Adaptive threshold against a morphological
// background, connected runs, and for every blob its own mid-contrast measurement. Not for: names, memory of
// positions, distortion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/base/faults.hpp"
#include "core/base/result.hpp"
#include "core/detect/blob.hpp"
#include "core/detect/lobes.hpp"
#include "core/detect/observation.hpp"
#include "core/detect/population.hpp"
#include "core/detect/quick_blob.hpp"
#include "core/image/view.hpp"
#include "core/limits.hpp"

namespace rig {

struct DetectorConfig {
    MarkerPolarity polarity = MarkerPolarity::kAuto;
    BlobLimits blob;                  // see there: diameters, contrast, shape
    double relative_contrast = 0.25;  // of the background, that a pixel needs to belong to a candidate
    double min_score = 0.15;          // 0..1, below which a blob is not handed on
    PopulationLimits population;      // how far from the other markers of the image
    double dim_luma_ink = 24.0;  // mean grey level below which dark markers may have less than min_contrast,
    double dim_luma_retro = 12.0;      // and bright ones
    double dark_luma = 4.0;            // mean grey level below which the image is called dark (F13)
    double saturated_fraction = 0.25;  // of 255s, above which it is called flooded (F13)
    double luma_step = 0.4;  // change of the mean, relative to the usual, that is called a step (F13)
    std::uint8_t polarity_frames =
        8;  // equal decisions before automatic polarity stops looking at both sides
};

enum class DetectorError : std::uint8_t { kDiameters, kContrast, kShape, kScore, kExposure };

enum class ExposureFlag : std::uint8_t { kDark = 1, kFlooded = 2, kStep = 4 };

// Where a marker is expected: within `reach_px` of a pixel. Not finite: left out.
struct ExpectedMarker {
    float x_px = 0.0F;
    float y_px = 0.0F;
    float reach_px = 0.0F;
    bool surely = true;  // it was there in the last frame; others are looked for without missing them
};

struct DetectorReport {
    std::uint32_t runs = 0;
    std::uint32_t candidates = 0;                                                       // blobs measured
    std::array<std::uint32_t, static_cast<std::size_t>(Rejection::kCount)> rejected{};  // by Rejection
    std::uint32_t low_score = 0;
    std::uint32_t left_out = 0;  // good blobs beyond kMaxObservations, the lowest scored
    bool runs_full = false;      // a capacity was reached: runs, blobs, observations
    bool blobs_full = false;
    bool observations_full = false;
    bool whole_image = false;                         // every pixel was looked at, not windows only
    bool unprocessable = false;                       // no image, or larger than the limits
    MarkerPolarity polarity = MarkerPolarity::kDark;  // the side the observations come from
    double mean_luma = 0.0;                           // grey levels
    double saturated_fraction = 0.0;
    // Of the observations handed on, grey levels; 0 without any. Skin beside ink, paint of bright markers.
    double brightest_level = 0.0;    // brighter side of a marker: a tenth of the markers are brighter
    double faintest_contrast = 0.0;  // a tenth of the markers have less
    std::uint8_t exposure = 0;       // ExposureFlag bits
    FaultMap faults = 0;             // kExposure, kBlobCapacity
};

// Of the background at the scale of the largest marker.
inline constexpr int kBackgroundRadius = static_cast<int>((kMaxDotDiameterPx / kBlockPx + 2) / 2);
inline constexpr std::size_t kSlideBytes =
    slide_scratch_bytes(kMaxImageWidth / kBlockPx, kMaxImageHeight / kBlockPx, kBackgroundRadius);
static_assert(kBackgroundRadius <= kMaxSlideRadius);

// Runs, candidates, rejections and full tables of one part of the work, added to a frame's.
void add_counts(DetectorReport& total, const DetectorReport& part);

inline constexpr float kMaxReachPx =
    24.0F;  // an expected marker farther away than that is searched for in vain
inline constexpr double kWindowShare = 0.75;

// Blobs of an image or its windows that are looked at again for pieces or for a part of an outline: texture
// like a beard has hundreds of pieces.
inline constexpr std::size_t kMostSecondLooks = 128;
inline constexpr std::size_t kMaxLobeRuns = kBlobWindowPx * (kBlobWindowPx / 2 + 1);

// How often a blob that is no marker is cut again.
inline constexpr std::size_t kSplitLevels = 3;

// One camera's detector. Memory is fixed (about 1.9 MB); detect() never allocates and never fails: hard data
// give few observations and a report. The order of observations says nothing.
class Detector {
  public:
    // Validates once. On failure the detector keeps its previous configuration.
    [[nodiscard]] Result<void, DetectorError> configure(const DetectorConfig& config);

    // Every byte of the image inside width x height must be readable; anything else about it may be wrong.
    void detect(const ImageView& image, Observations& observations, DetectorReport& report);

    // The same, reading only windows around where markers are expected: a tracker's predictions. Looks at the
    // whole image instead (report.whole_image) while polarity and size of the markers are unknown, or when
    // less than kWindowShare of the expected markers have an observation within their reach or a window holds
    // more parts than it has room for.
    void detect_around(const ImageView& image, std::span<const ExpectedMarker> expected,
                       Observations& observations, DetectorReport& report);

    // What one pass over an image looks for. Public for the file-local functions of the implementation only.
    struct Search {
        const ImageView& image;
        const BlockGrid& thresholds;
        Side side = Side::kBelow;
        double largest_px = 0.0;                   // longest marker
        double usual_size_px = 0.0;                // long axis of the image's markers; 0: unknown,
        double usual_depth = 0.0;                  // of their depths; 0: unknown
        const ExpectedMarker* expected = nullptr;  // the marker that a window is for
        bool first_look = false;           // the markers' size is not known yet: odd blobs get another look
        std::uint32_t little_area_px = 0;  // of a part among several, below which it must stand clear
        int left = 0;                      // px: what is looked at, and where the thresholds' grid begins
        int top = 0;
        int right = 0;  // exclusive
        int bottom = 0;

        [[nodiscard]] int level(int x, int y) const {
            return thresholds
                .values[static_cast<std::size_t>((y - top) / static_cast<int>(kBlockPx) * thresholds.width +
                                                 (x - left) / static_cast<int>(kBlockPx))];
        }
        // Whether it goes on where nothing is looked at.
        [[nodiscard]] bool cuts_off(const Component& component) const {
            return (component.left == left && left > 0) || (component.top == top && top > 0) ||
                   (component.right + 1 == right && right < image.width_px) ||
                   (component.bottom + 1 == bottom && bottom < image.height_px);
        }
    };

    // Forgets polarity, size and luma learnt from earlier frames.
    void reset() { state_ = State{}; }
    // The next frame looks for markers of every size: what was taken for markers may have been none.
    void forget_size() { state_.usual_size_px = 0.0; }

  private:
    struct State {
        MarkerPolarity polarity = MarkerPolarity::kAuto;  // the last decision
        std::uint8_t agreed = 0;                          // frames in a row that said so
        double usual_size_px = 0.0;                       // long axis; 0 while unknown
        double usual_depth = 0.0;
        double luma = -1.0;        // of the last frame that was looked at whole or in parts; negative before
        double usual_luma = -1.0;  // running mean; negative before the first frame
    };

    using Blobs = BoundedVector<Blob, kMaxCandidates>;

    static constexpr std::array<Side, 2> kSides{Side::kBelow, Side::kAbove};  // dark markers, bright ones

    // What one polarity makes of the image.
    struct SideResult {
        Blobs blobs;
        DetectorReport report;
        double quality = 0.0;
        double usual_size_px = 0.0;  // long axis; 0 when the markers are too few
        double usual_depth = 0.0;
        std::size_t tiles = 0;         // that were searched for lobes
        std::size_t second_looks = 0;  // blobs whose pieces or outline may have been completed
    };

    struct SplitStorage {
        std::array<Run, kMaxSplitRuns> runs{};
        std::array<Run, kMaxSplitRuns> grouped{};
        std::array<Component, kMaxBlobs> components{};
    };

    struct Workspace {
        std::array<std::uint8_t, kMaxBlocks> means{};
        std::array<std::uint8_t, kMaxBlocks> background{};
        std::array<std::uint8_t, kSlideBytes> slide{};
        std::array<std::uint16_t, 256> core_steps{};  // by threshold: how far beyond it a core is
        std::array<Run, kMaxRuns> runs{};
        std::array<ComponentLabel, kMaxRuns> labels{};
        std::array<std::uint16_t, kMaxRuns> label_of{};
        std::array<Run, kMaxRuns> grouped{};
        std::array<Component, kMaxBlobs> components{};
        std::array<SplitStorage, kSplitLevels> split{};
        BoundedVector<std::uint16_t, kMaxBlobs> failed;
        std::array<std::uint16_t, kMaxCandidates> origins{};  // component of each blob of the first pass
        BoundedVector<Component, kMaxCandidates> examined;    // by earlier windows of the frame
        BitRows window{};                                     // beyond the threshold, not examined yet
        BitRows reach{};
        BitRows part{};
        std::array<Run, kMaxLobeRuns> lobe_runs{};  // of a lobe and of the rest of its tile
        BlobWorkspace blob;
        QuickWorkspace quick;
        std::array<SideResult, 2> sides;
    };

    [[nodiscard]] double least_contrast(Side side) const;
    void measure_exposure(const ImageView& image, DetectorReport& report);
    void set_thresholds(const BlockGrid& means, const BlockGrid& thresholds, Side side, double largest_px);
    void detect_side(const ImageView& image, const BlockGrid& means, Side side, SideResult& result);
    [[nodiscard]] bool search_windows(const ImageView& image, Side side,
                                      std::span<const ExpectedMarker> expected, SideResult& result);
    [[nodiscard]] bool search_window(const ImageView& image, Side side, const ExpectedMarker& expected,
                                     SideResult& result);
    [[nodiscard]] bool examine_window(const Search& search, const ExpectedMarker& expected,
                                      SideResult& result);
    void examine_part(const Search& search, std::size_t number, SideResult& result);
    void drop_cut_off(const Search& search);
    static void drop_repeats(std::size_t first, SideResult& result);
    [[nodiscard]] bool is_settled() const;
    [[nodiscard]] std::size_t likely_side() const;
    // What detect() does when the light is measured.
    void detect_whole(const ImageView& image, Observations& observations, DetectorReport& report);
    void finish(std::size_t side, Observations& observations, DetectorReport& report);
    void examine_pieces(const Search& search, SideResult& result);
    static void drop_pieces(SideResult& result);
    void split_failed(const Search& wide, const BlockGrid& means, SideResult& result);
    [[nodiscard]] double largest_marker(double usual_size_px) const;
    void split(const Search& search, std::size_t level, const Component& component, std::span<const Run> runs,
               SideResult& result);
    [[nodiscard]] bool examine(const Search& search, const Component& component, std::span<const Run> runs,
                               const Siblings& siblings, SideResult& result);
    void set_core_steps(Side side);
    void examine_lobes(const Search& search, const Component& component, std::span<const Run> runs,
                       double most_sizes, SideResult& result);
    void examine_tile(const Search& search, std::span<const Run> runs, const RunEnds& ends,
                      const BitBox& tile, const BitBox& own, SideResult& result);
    void examine_lobe(const Search& search, const BitRows& area, const BitRows& lobe, const BitBox& tile,
                      SideResult& result);
    [[nodiscard]] static bool is_met(const ExpectedMarker& expected, const SideResult& result);
    [[nodiscard]] bool has_core(const Search& search, std::span<const Run> runs) const;
    void apply_population(const ImageView& image, Side side, SideResult& result) const;
    [[nodiscard]] std::size_t look(const ImageView& image, const BlockGrid& means, DetectorReport& report);
    void decide(std::size_t dark_or_bright);
    void measure_markers(const SideResult& result, DetectorReport& report) const;
    void hand_on(const SideResult& result, Observations& observations, DetectorReport& report) const;

    DetectorConfig config_;
    State state_;
    Workspace workspace_;
};

}  // namespace rig
