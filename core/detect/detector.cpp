#include "core/detect/detector.hpp"

#include <algorithm>
#include <span>
#include <tuple>

#include "core/base/math.hpp"
#include "core/base/ranked.hpp"
#include "core/detect/blob_shape.hpp"
#include "core/detect/components.hpp"
#include "core/detect/edge_slope.hpp"
#include "core/image/kernels.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr int kBlock = static_cast<int>(kBlockPx);
constexpr int kLumaRows = 8;    // every so manieth row is enough for the mean
constexpr int kCorePixels = 3;  // beyond one and a half thresholds
constexpr std::array<double, kSplitLevels> kSplitDepths{0.0, 0.5, 0.75};  // of a component's own range
constexpr double kFringe = 4.0;           // px by which blur and noise lengthen a component
constexpr double kSizeMargin = 1.6;       // largest marker of an image / usual marker
constexpr double kSettledQuality = 4.0;   // summed scores below which a settled polarity is doubted
constexpr std::uint32_t kSparse = 2;      // boxes are that much larger than what is in them
constexpr double kDimmest = 0.4;          // of the least contrast, in a dim image
constexpr double kTriedSizes = 1.5;       // long components are no one marker
constexpr double kLobedSizes = 24.0;      // so long at most is what a marker sticks out of, with it; and
constexpr double kLobedPartSizes = 5.0;   // a part at a deeper level
constexpr double kLineSizes = 1.35;       // so long is a line, and so thin
constexpr double kLineAspect = 3.3;       // length^2 / area; a disc: 1.3
constexpr double kHopelessBadness = 1.5;  // score 0
constexpr double kLittlePart =
    0.3;  // of a usual size's square, some 0.4 of a marker seen from the front; and one
constexpr std::size_t kFewParts = 2;  // among more parts than these is texture, not a core

// Sixteen pixels of a row from x on; beyond the image, zeros.
SixteenBytes pixels_at(const ImageView& image, int x, int y) {
    const std::uint8_t* from = image.row(y) + x;
    if (x + kByteLanes <= image.width_px) return load_bytes(from);
    std::array<std::uint8_t, kByteLanes> rest{};
    std::copy(from, image.row(y) + image.width_px, rest.begin());
    return load_bytes(rest.data());
}

// 0xFF in the bytes from `count` on.
SixteenBytes beyond_first(int count) {
    static constexpr std::array<std::uint8_t, 2UL * kByteLanes> kEdge = [] {
        std::array<std::uint8_t, 2UL * kByteLanes> edge{};
        std::fill(edge.begin() + kByteLanes, edge.end(), std::uint8_t{0xFF});
        return edge;
    }();
    return load_bytes(&kEdge[static_cast<std::size_t>(kByteLanes - count)]);
}

// The parts of `runs` whose pixels are marked, as runs; marked(x, y, count): one bit for each of up to
// sixteen pixels from x on, bits beyond them mean nothing.
template <class Marked>
std::size_t cut(std::span<const Run> runs, std::span<Run> out, bool& truncated, Marked marked) {
    std::size_t count = 0;
    for (const Run& run : runs) {
        if (out.size() - count < static_cast<std::size_t>(run.end - run.begin) / 2 + 1) {
            truncated = true;
            break;
        }
        std::uint64_t inside = 0;  // whether the pixel before is
        int begin = 0;
        const auto turn = [&](int at) {
            if (inside != 0) {
                out[count++] = {run.y, static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(at)};
            }
            begin = at;
            inside ^= 1;
        };
        for (int x = run.begin; x < run.end; x += kByteLanes) {
            const int pixels = std::min(kByteLanes, run.end - x);
            const std::uint64_t bits = marked(x, run.y, pixels);
            std::uint64_t changes = (bits ^ (bits << 1 | inside)) & row_mask(pixels);
            for (; changes != 0; changes &= changes - 1) turn(x + std::countr_zero(changes));
        }
        if (inside != 0) turn(run.end);
    }
    return count;
}

bool in_range(double value, double low, double high) {
    return value >= low && value <= high;  // false for NaN
}

std::size_t cut_at_background(const Detector::Search& search, std::span<const Run> runs, std::span<Run> out,
                              bool& truncated) {
    const bool dark = search.side == Side::kBelow;
    return cut(runs, out, truncated, [&](int x, int y, int pixels) {
        const std::uint8_t* values = search.image.row(y) + x;
        std::uint64_t bits = 0;
        for (int i = 0; i < pixels; ++i) {
            const int level = search.level(x + i, y);
            if (dark ? values[i] < level : values[i] > level) bits |= std::uint64_t{1} << i;
        }
        return bits;
    });
}

std::size_t cut_at_depth(const Detector::Search& search, double depth, std::span<const Run> runs,
                         std::span<Run> out, bool& truncated) {
    const std::uint8_t turn = search.side == Side::kBelow ? 255 : 0;
    SixteenBytes most{};
    SixteenBytes least = most + 255;
    for (const Run& run : runs) {
        for (int x = run.begin; x < run.end; x += kByteLanes) {
            const SixteenBytes outside = beyond_first(std::min(kByteLanes, run.end - x));
            const SixteenBytes v = pixels_at(search.image, x, run.y) ^ turn;
            most = most > (v & ~outside) ? most : (v & ~outside);
            least = least < (v | outside) ? least : (v | outside);
        }
    }
    int deepest = 0;
    int shallowest = 255;
    for (int i = 0; i < kByteLanes; ++i) {
        deepest = std::max<int>(deepest, most[i]);
        shallowest = std::min<int>(shallowest, least[i]);
    }
    const int level = shallowest + static_cast<int>(depth * (deepest - shallowest));
    const SixteenBytes levels = SixteenBytes{} + static_cast<std::uint8_t>(level);
    return cut(runs, out, truncated, [&](int x, int y, int) {
        const SixteenBytes v = pixels_at(search.image, x, y) ^ turn;
        const SixteenBytes lesser = v < levels ? v : levels;
        return std::uint64_t{~bits_of_bytes(reinterpret_cast<SixteenBytes>(lesser == v))};
    });
}

// Longer than a marker and thinner than one seen aslant, as an ellipse of its length and area.
bool is_line(const Component& component, double usual_size_px) {
    const double length = length_of(component);
    return usual_size_px > 0.0 && length > kLineSizes * usual_size_px &&
           length * length > kLineAspect * component.area_px;
}

// Whether no other part of the same larger component reaches into the window around this one; crumbs of
// noise do not count.
bool stands_alone(const Component& component, const Siblings& siblings) {
    for (const Component& other : siblings.components) {
        const bool apart =
            other.right + kQuickMarginPx < component.left || other.left > component.right + kQuickMarginPx ||
            other.bottom + kQuickMarginPx < component.top || other.top > component.bottom + kQuickMarginPx;
        const bool itself =
            other.left == component.left && other.top == component.top && other.first == component.first;
        if (!apart && !itself && other.area_px * kPeerAreas >= component.area_px) return false;
    }
    return true;
}

bool is_apart(const Component& component, std::span<const Run> runs, const Siblings& siblings) {
    return stands_alone(component, siblings) && holds_its_middle(component, runs);
}

}  // namespace

void add_counts(DetectorReport& total, const DetectorReport& part) {
    total.runs += part.runs;
    total.candidates += part.candidates;
    for (std::size_t i = 0; i < total.rejected.size(); ++i) total.rejected[i] += part.rejected[i];
    total.runs_full |= part.runs_full;
    total.blobs_full |= part.blobs_full;
}

Result<void, DetectorError> Detector::configure(const DetectorConfig& config) {
    const BlobLimits& blob = config.blob;
    if (!in_range(blob.max_diameter_px, 3.0, kMaxDotDiameterPx) ||
        !in_range(blob.min_diameter_px, 2.0, blob.max_diameter_px)) {
        return failure(DetectorError::kDiameters);
    }
    if (!in_range(blob.min_contrast, 3.0, 128.0) || !in_range(config.relative_contrast, 0.0, 0.9)) {
        return failure(DetectorError::kContrast);
    }
    if (!in_range(blob.max_aspect, 1.01, 100.0) || !in_range(blob.max_deviation, 0.0, 1.0) ||
        !in_range(blob.max_deviation_px, 0.01, 10.0) || !in_range(blob.max_open, 0.01, 1.0) ||
        !in_range(config.population.size_ratio, 1.31, 100.0) ||
        !in_range(config.population.ink_spread, 0.01, 100.0) ||
        !in_range(config.population.retro_spread, 0.01, 100.0) || config.population.quorum < 3) {
        return failure(DetectorError::kShape);
    }
    if (!in_range(config.min_score, 0.0, 1.0)) return failure(DetectorError::kScore);
    if (!in_range(config.dark_luma, 0.0, 255.0) || !in_range(config.saturated_fraction, 0.0, 1.0) ||
        !in_range(config.luma_step, 0.0, 1e6)) {
        return failure(DetectorError::kExposure);
    }
    config_ = config;
    reset();
    return {};
}

void Detector::measure_exposure(const ImageView& image, DetectorReport& report) {
    const LumaSums sums = luma_sums(image, kLumaRows);
    report.mean_luma = static_cast<double>(sums.sum) / sums.samples;
    report.saturated_fraction = static_cast<double>(sums.saturated) / sums.samples;
    state_.luma = report.mean_luma;
    if (report.mean_luma < config_.dark_luma)
        report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kDark);
    if (report.saturated_fraction > config_.saturated_fraction) {
        report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kFlooded);
    }
    if (state_.usual_luma >= 0.0) {
        const double change = report.mean_luma - state_.usual_luma;
        const double allowed = config_.luma_step * std::max(state_.usual_luma, 1.0);
        if (change > allowed || change < -allowed)
            report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kStep);
        state_.usual_luma += 0.25 * change;  // a lasting change is the new normal within some ten frames
    } else {
        state_.usual_luma = report.mean_luma;
    }
    if (report.exposure != 0) report.faults |= fault_bit(Fault::kExposure);
}

// In an image with little light all contrasts are small, and so is its noise.
double Detector::least_contrast(Side side) const {
    const double enough = side == Side::kBelow ? config_.dim_luma_ink : config_.dim_luma_retro;
    const double part = state_.luma < 0.0 ? 1.0 : state_.luma / enough;
    return config_.blob.min_contrast * std::clamp(part, kDimmest, 1.0);
}

// The background is what remains when everything narrower than the largest disc is taken away (a closing for
// dark discs, an opening for bright ones); a pixel is a candidate when it differs from it by a part of it.
void Detector::set_thresholds(const BlockGrid& means, const BlockGrid& thresholds, Side side,
                              double largest_px) {
    std::copy(means.values.begin(), means.values.end(), thresholds.values.begin());
    const int radius = (static_cast<int>(largest_px) / static_cast<int>(kBlockPx) + 2) / 2;
    const int least = static_cast<int>(least_contrast(side));
    const int part = static_cast<int>(config_.relative_contrast * 256.0);
    if (side == Side::kBelow) {
        sliding_max(thresholds, radius, workspace_.slide);
        sliding_min(thresholds, radius, workspace_.slide);
    } else {
        sliding_min(thresholds, radius, workspace_.slide);
        sliding_max(thresholds, radius, workspace_.slide);
    }
    step_levels(thresholds, side, least, part);
}

// Texture and noise just reach the threshold; a marker whose mid contrast does has pixels well beyond it.
void Detector::set_core_steps(Side side) {
    const int least = static_cast<int>(least_contrast(side));
    const int part = static_cast<int>(config_.relative_contrast * 256.0);
    const int whole = side == Side::kBelow ? 256 - part : 256 + part;
    for (int level = 0; level < 256; ++level) {  // twice the difference is a step or more
        workspace_.core_steps[static_cast<std::size_t>(level)] =
            static_cast<std::uint16_t>((std::max(least, level * part / whole) + 1) / 2);
    }
}

// From the middle on, where a marker is deepest.
bool Detector::has_core(const Search& search, std::span<const Run> runs) const {
    const int sign = search.side == Side::kBelow ? 1 : -1;
    int deep = 0;
    const std::size_t middle = runs.size() / 2;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const Run& run = runs[i + middle < runs.size() ? i + middle : i + middle - runs.size()];
        const std::uint8_t* pixels = search.image.row(run.y);
        for (int x = run.begin; x < run.end;) {
            const int level = search.level(x, run.y);
            const int step = workspace_.core_steps[static_cast<std::size_t>(level)];
            const int end = std::min<int>(run.end, x + kBlock - (x - search.left) % kBlock);
            for (; x < end; ++x) {
                if (sign * (level - pixels[x]) >= step && ++deep == kCorePixels) return true;
            }
        }
    }
    return false;
}

void Detector::detect_side(const ImageView& image, const BlockGrid& means, Side side, SideResult& result) {
    Workspace& w = workspace_;
    result.blobs.clear();
    result.report = DetectorReport{};
    result.second_looks = 0;
    result.tiles = 0;
    w.failed.clear();
    const BlockGrid thresholds{std::span(w.background).first(means.values.size()), means.width, means.height};
    const double largest = largest_marker(state_.usual_size_px);
    set_thresholds(means, thresholds, side, largest);
    set_core_steps(side);
    const std::size_t count = threshold_runs(image, thresholds, side, w.runs, result.report.runs_full);
    result.report.runs = static_cast<std::uint32_t>(count);
    const ComponentCounts counts =
        connect(std::span<const Run>(w.runs).first(count), {least_area_px(config_.blob)},
                {w.labels, w.label_of, w.grouped, w.components});
    result.report.blobs_full = counts.dropped > 0;
    const Search search{.image = image,
                        .thresholds = thresholds,
                        .side = side,
                        .largest_px = largest,
                        .usual_size_px = state_.usual_size_px,
                        .usual_depth = state_.usual_depth,
                        .first_look = !(state_.usual_size_px > 0.0),
                        .right = image.width_px,
                        .bottom = image.height_px};
    for (std::size_t c = 0; c < counts.components; ++c) {
        const Component& component = w.components[c];
        const std::size_t before = result.blobs.size();
        if (examine(search, component, members_of(component, w.grouped), {}, result)) {
            if (result.blobs.size() > before) w.origins[before] = static_cast<std::uint16_t>(c);
            continue;
        }
        if (!w.failed.push_back(static_cast<std::uint16_t>(c))) result.report.blobs_full = true;
    }
    split_failed(search, means, result);
    apply_population(image, side, result);
}

// Blobs that are no markers may hold some: a marker hangs together with a shadow, a strip of light or another
// marker. Now that the size of the image's markers is known, the background is taken at that scale.
void Detector::split_failed(const Search& wide, const BlockGrid& means, SideResult& result) {
    Workspace& w = workspace_;
    if (w.failed.empty() && !wide.first_look) return;
    Search search = wide;
    search.first_look = false;
    if (wide.first_look) {
        const Population population = population_of(result.blobs.span(), config_.population.quorum);
        search.usual_size_px = population.size_px;
        search.usual_depth = population.depth;
        search.largest_px = largest_marker(population.size_px);
    }
    const double usual = search.usual_size_px;
    search.little_area_px = static_cast<std::uint32_t>(kLittlePart * usual * usual);
    const bool narrower = search.largest_px < wide.largest_px;
    if (narrower) set_thresholds(means, wide.thresholds, wide.side, search.largest_px);
    if (wide.first_look) examine_pieces(search, result);
    for (const std::uint16_t c : w.failed) {
        const Component& component = w.components[c];
        const std::span<const Run> runs = members_of(component, w.grouped);
        if (wide.first_look && examine(search, component, runs, {}, result)) continue;
        // What a marker may be a part of was tried as a whole; then its own parts are not.
        Search inner = search;
        if (length_of(component) < kTriedSizes * usual) inner.usual_size_px = 0.0;
        split(inner, narrower ? 0 : 1, component, runs, result);
        examine_lobes(inner, component, runs, kLobedSizes, result);
    }
}

// What is too short for a marker of the image was measured before that was known.
void Detector::examine_pieces(const Search& search, SideResult& result) {
    Workspace& w = workspace_;
    std::size_t kept = 0;
    BoundedVector<std::uint16_t, kMaxBlobs> pieces;
    for (std::size_t i = 0; i < result.blobs.size(); ++i) {
        if (result.blobs[i].long_axis_px < kPieceSize * search.usual_size_px) {
            if (pieces.push_back(w.origins[i])) continue;
        }
        result.blobs[kept++] = result.blobs[i];
    }
    result.blobs.resize(kept);
    for (const std::uint16_t c : pieces) {
        const Component& component = w.components[c];
        if (!examine(search, component, members_of(component, w.grouped), {}, result)) {
            if (!w.failed.push_back(c)) result.report.blobs_full = true;
        }
    }
}

// True if the blob is done with: a marker, or so faint or small that nothing is inside it either.
bool Detector::examine(const Search& search, const Component& component, std::span<const Run> runs,
                       const Siblings& siblings, SideResult& result) {
    const auto reject = [&](Rejection reason) { ++result.report.rejected[static_cast<std::size_t>(reason)]; };
    if (!has_core(search, runs)) {
        reject(Rejection::kFaint);
        return true;
    }
    const int longest = length_of(component);
    if (longest > search.largest_px + kFringe) {
        reject(Rejection::kLarge);
        return false;
    }
    if (is_line(component, search.usual_size_px)) return reject(Rejection::kElongated), false;
    BlobLimits limits = config_.blob;
    limits.usual_size_px = result.second_looks < kMostSecondLooks ? search.usual_size_px : 0.0;
    limits.usual_depth = search.usual_depth;
    limits.min_contrast = least_contrast(search.side);
    Blob blob;
    QuickStart start;
    const bool alone = is_apart(component, runs, siblings) && frame_component(search.image, component, start);
    const bool quick =
        alone && measure_quickly(search.image, search.side, start, limits, workspace_.quick, blob);
    if (!quick || blob.long_axis_px < kPieceSize * limits.usual_size_px) {
        blob = measure_blob(search.image, search.side, component, runs, siblings, limits, workspace_.blob);
        if (may_be_completed(search.side, limits, blob)) ++result.second_looks;
    }
    ++result.report.candidates;
    if (blob.rejection != Rejection::kNone) {
        reject(blob.rejection);
        const auto box = static_cast<std::uint32_t>((component.right - component.left + 1) *
                                                    (component.bottom - component.top + 1));
        const bool sparse = component.area_px * kSparse < box;  // something deep, and shade around it
        return blob.rejection == Rejection::kSmall || (blob.rejection == Rejection::kFaint && !sparse);
    }
    // Another look once the size of the image's markers is known.
    if (search.first_look && blob.badness > kSureBadness) return false;
    if (!result.blobs.push_back(blob)) result.report.blobs_full = true;
    return true;
}

// Level 0 cuts at the local background, deeper levels at a part of the component's own range of grey.
void Detector::split(const Search& search, std::size_t level, const Component& component,
                     std::span<const Run> runs, SideResult& result) {
    Workspace& w = workspace_;
    SplitStorage& storage = w.split[level];
    bool truncated = false;
    const std::size_t count = level == 0
                                  ? cut_at_background(search, runs, storage.runs, truncated)
                                  : cut_at_depth(search, kSplitDepths[level], runs, storage.runs, truncated);
    result.report.runs_full |= truncated;
    const ComponentCounts counts =
        connect(std::span<const Run>(storage.runs).first(count), {least_area_px(config_.blob)},
                {w.labels, w.label_of, storage.grouped, storage.components});
    result.report.blobs_full |= counts.dropped > 0;
    const Siblings all{std::span<const Component>(storage.components).first(counts.components),
                       storage.grouped};
    const bool whole = counts.components == 1 && storage.components[0].area_px == component.area_px;
    for (std::size_t c = 0; c < counts.components; ++c) {
        const Component& part = storage.components[c];
        const std::span<const Run> members = members_of(part, storage.grouped);
        if (search.cuts_off(part)) continue;  // another window sees all of it, or nobody does
        // One little part among several is texture, unless it is clear of the others.
        const bool little = part.area_px < search.little_area_px;
        if (little && counts.components > kFewParts && !is_apart(part, members, all)) continue;
        if (!whole && examine(search, part, members, all, result)) continue;
        const bool crumb = little && search.usual_size_px > 0.0;
        if (level + 1 < kSplitLevels && !crumb) split(search, level + 1, part, members, result);
        examine_lobes(search, part, members, level == 0 ? kLobedSizes : kLobedPartSizes, result);
    }
}

double Detector::largest_marker(double usual_size_px) const {
    return usual_size_px > 0.0 ? std::min(usual_size_px * kSizeMargin, config_.blob.max_diameter_px)
                               : config_.blob.max_diameter_px;
}

// A completed marker and its pieces, or the same one completed from two pieces: the best one stays. What lies
// in a completed one that is dropped itself goes too; the order of the blobs does not matter.
void Detector::drop_pieces(SideResult& result) {
    const auto blobs = std::span(result.blobs.begin(), result.blobs.size());
    std::array<bool, kMaxCandidates> dropped{};
    const auto key = [](const Blob& blob) { return std::tuple(blob.badness, blob.y_px, blob.x_px); };
    for (std::size_t i = 0; i < blobs.size(); ++i) {
        const Blob& whole = blobs[i];
        if (!whole.completed) continue;
        for (std::size_t k = 0; k < blobs.size(); ++k) {
            const Blob& other = blobs[k];
            if (k == i ||
                !(is_inside(whole, other.x_px, other.y_px) || is_inside(other, whole.x_px, whole.y_px)))
                continue;
            const bool worse = key(other) < key(whole) || (k < i && key(other) == key(whole));
            dropped[worse ? i : k] = true;
        }
    }
    for (std::size_t i = 0; i < blobs.size(); ++i) {
        if (dropped[i]) blobs[i].badness += 2.0 * kHopelessBadness;
    }
}

// The markers of one image are of one make: what is unlike them is an eye, a nostril, a tooth, a mole or a
// shadow.
void Detector::apply_population(const ImageView& image, Side side, SideResult& result) const {
    for (Blob& blob : result.blobs) {
        const bool matters = side == Side::kBelow && blob.badness < kHopelessBadness;
        if (matters && blob.short_axis_px > kLeastSlopeWidthPx) blob.slope = edge_slope(image, side, blob);
    }
    const Population population = population_of(result.blobs.span(), config_.population.quorum);
    result.usual_size_px = population.size_px;
    result.usual_depth = population.depth;
    result.quality = 0.0;
    for (Blob& blob : result.blobs) {
        blob.badness += oddness(population, config_.population, side, blob);
    }
    drop_pieces(result);
    for (Blob& blob : result.blobs) {
        blob.score = std::clamp(1.0 - blob.badness / kHopelessBadness, 0.0, 1.0);
        result.quality += blob.score * std::min(1.0, blob.contrast / 40.0);
    }
}

bool Detector::is_settled() const {
    return config_.polarity != MarkerPolarity::kAuto || state_.agreed >= config_.polarity_frames;
}

std::size_t Detector::likely_side() const {
    const bool automatic = config_.polarity == MarkerPolarity::kAuto;
    return (automatic ? state_.polarity : config_.polarity) == MarkerPolarity::kBright ? 1 : 0;
}

void Detector::decide(std::size_t dark_or_bright) {
    const MarkerPolarity decision = dark_or_bright == 0 ? MarkerPolarity::kDark : MarkerPolarity::kBright;
    if (decision != state_.polarity) state_.agreed = 0;
    state_.polarity = decision;
    if (state_.agreed < 255) ++state_.agreed;
}

void Detector::hand_on(const SideResult& result, Observations& observations, DetectorReport& report) const {
    // With more good blobs than room, the score that the last one kept must have.
    std::array<float, kMaxCandidates> scores{};
    std::size_t good = 0;
    for (const Blob& blob : result.blobs) {
        if (blob.rejection != Rejection::kNone) continue;
        if (blob.score < config_.min_score) {
            ++report.low_score;
            continue;
        }
        scores[good++] = static_cast<float>(blob.score);
    }
    float least = 0.0F;
    if (good > kMaxObservations) {
        const auto last = scores.begin() + static_cast<std::ptrdiff_t>(kMaxObservations - 1);
        std::nth_element(scores.begin(), last, scores.begin() + static_cast<std::ptrdiff_t>(good),
                         [](float a, float b) { return a > b; });
        least = *last;
    }
    for (const Blob& blob : result.blobs) {
        if (blob.rejection != Rejection::kNone || blob.score < config_.min_score) continue;
        const auto score = static_cast<float>(blob.score);
        const Observation seen{static_cast<float>(blob.x_px),
                               static_cast<float>(blob.y_px),
                               static_cast<float>(blob.diameter_px),
                               static_cast<float>(std::min(1.0, blob.contrast / 255.0)),
                               score,
                               static_cast<float>(completed_sigma_px(blob))};
        if (score < least || !observations.push_back(seen)) {
            ++report.left_out;
            report.observations_full = true;
        }
    }
}

// What exposure control goes by. A tenth either way leaves out what is no marker after all.
void Detector::measure_markers(const SideResult& result, DetectorReport& report) const {
    std::array<float, kMaxCandidates> levels{};
    std::array<float, kMaxCandidates> contrasts{};
    std::size_t count = 0;
    for (const Blob& blob : result.blobs) {
        if (blob.rejection != Rejection::kNone || blob.score < config_.min_score) continue;
        // Bright sides are measured inverted: there the paint, not the skin, is the brighter one.
        const bool dark = report.polarity == MarkerPolarity::kDark;
        const double level = dark ? blob.background : 255.0 - blob.background + blob.contrast;
        levels[count] = static_cast<float>(std::clamp(level, 0.0, 255.0));
        contrasts[count++] = static_cast<float>(std::clamp(blob.contrast, 0.0, 255.0));
    }
    if (count == 0) return;
    const std::size_t tenth = count / 10;
    report.brightest_level = ranked(std::span(levels).first(count), count - 1 - tenth);
    report.faintest_contrast = ranked(std::span(contrasts).first(count), tenth);
}

// Which side the markers are on. Both are tried until the decision has settled, and again when that side
// fails.
std::size_t Detector::look(const ImageView& image, const BlockGrid& means, DetectorReport& report) {
    Workspace& w = workspace_;
    const auto try_side = [&](std::size_t index) {
        detect_side(image, means, kSides[index], w.sides[index]);
        add_counts(report, w.sides[index].report);
    };
    const bool automatic = config_.polarity == MarkerPolarity::kAuto;
    const std::size_t first = likely_side();
    try_side(first);
    if (is_settled() && (!automatic || w.sides[first].quality >= kSettledQuality)) return first;
    try_side(1 - first);
    const std::size_t chosen = w.sides[1].quality > w.sides[0].quality ? 1 : 0;
    decide(chosen);
    return chosen;
}

void Detector::detect(const ImageView& image, Observations& observations, DetectorReport& report) {
    observations.clear();
    report = DetectorReport{};
    if (!is_processable(image)) {
        report.unprocessable = true;
        return;
    }
    measure_exposure(image, report);
    detect_whole(image, observations, report);
}

void Detector::detect_whole(const ImageView& image, Observations& observations, DetectorReport& report) {
    report.whole_image = true;
    const BlockGrid means = block_means(image, workspace_.means);
    finish(look(image, means, report), observations, report);
}

void Detector::finish(std::size_t side, Observations& observations, DetectorReport& report) {
    const SideResult& result = workspace_.sides[side];
    report.polarity = side == 0 ? MarkerPolarity::kDark : MarkerPolarity::kBright;
    state_.usual_size_px = result.usual_size_px;
    state_.usual_depth = result.usual_depth;
    hand_on(result, observations, report);
    measure_markers(result, report);
    if (report.runs_full || report.blobs_full || report.observations_full) {
        report.faults |= fault_bit(Fault::kBlobCapacity);
    }
}

}  // namespace rig
