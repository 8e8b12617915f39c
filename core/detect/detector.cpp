#include "core/detect/detector.hpp"

#include <algorithm>

#include "core/base/math.hpp"
#include "core/detect/components.hpp"
#include "core/image/kernels.hpp"

namespace rig {

namespace {

constexpr int kCorePixels = 3;  // beyond one and a half thresholds
constexpr std::array<double, 2> kSplitDepths = {0.5, 0.75};  // of a component's own contrast

// The least pixels a disc of the least diameter shows above mid contrast, with a margin for blur.
std::uint32_t least_area(const BlobLimits& limits) {
    const double area = 0.5 * 0.785398 * limits.min_diameter_px * limits.min_diameter_px;
    return area < 2.0 ? 2U : static_cast<std::uint32_t>(area);
}

bool in_range(double value, double low, double high) {
    return value >= low && value <= high;  // false for NaN
}

void add_reports(DetectorReport& total, const DetectorReport& side) {
    total.runs += side.runs;
    total.candidates += side.candidates;
    for (std::size_t i = 0; i < total.rejected.size(); ++i) total.rejected[i] += side.rejected[i];
    total.runs_full |= side.runs_full;
    total.blobs_full |= side.blobs_full;
}

}  // namespace

Result<void, DetectorError> Detector::configure(const DetectorConfig& config) {
    const BlobLimits& blob = config.blob;
    if (!in_range(blob.max_diameter_px, 3.0, kMaxDotDiameterPx) || !in_range(blob.min_diameter_px, 2.0, blob.max_diameter_px)) {
        return failure(DetectorError::kDiameters);
    }
    if (!in_range(blob.min_contrast, 3.0, 128.0) || !in_range(config.relative_contrast, 0.0, 0.9)) {
        return failure(DetectorError::kContrast);
    }
    if (!in_range(blob.max_aspect, 1.0, 100.0) || !in_range(blob.max_deviation, 0.0, 1.0) ||
        !in_range(blob.max_open, 0.01, 1.0) || !in_range(config.size_ratio, 1.0, 100.0) || config.size_quorum < 3) {
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
    const LumaSums sums = luma_sums(image);
    report.mean_luma = static_cast<double>(sums.sum) / sums.samples;
    report.saturated_fraction = static_cast<double>(sums.saturated) / sums.samples;
    if (report.mean_luma < config_.dark_luma) report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kDark);
    if (report.saturated_fraction > config_.saturated_fraction) {
        report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kFlooded);
    }
    if (state_.usual_luma >= 0.0) {
        const double change = report.mean_luma - state_.usual_luma;
        const double allowed = config_.luma_step * std::max(state_.usual_luma, 1.0);
        if (change > allowed || change < -allowed) report.exposure |= static_cast<std::uint8_t>(ExposureFlag::kStep);
        state_.usual_luma += 0.25 * change;  // a lasting change is the new normal within some ten frames
    } else {
        state_.usual_luma = report.mean_luma;
    }
    if (report.exposure != 0) report.faults |= fault_bit(Fault::kExposure);
}

// The background is what remains when everything narrower than the largest disc is taken away (a closing for dark
// discs, an opening for bright ones); a pixel is a candidate when it differs from it by a part of it.
void Detector::set_thresholds(const BlockGrid& means, const BlockGrid& thresholds, Side side) const {
    std::copy(means.values.begin(), means.values.end(), thresholds.values.begin());
    const int radius = (static_cast<int>(config_.blob.max_diameter_px) / static_cast<int>(kBlockPx) + 2) / 2;
    const int least = static_cast<int>(config_.blob.min_contrast);
    const int part = static_cast<int>(config_.relative_contrast * 256.0);
    if (side == Side::kBelow) {
        sliding_max(thresholds, radius);
        sliding_min(thresholds, radius);
    } else {
        sliding_min(thresholds, radius);
        sliding_max(thresholds, radius);
    }
    for (std::uint8_t& level : thresholds.values) {
        const int step = std::max(least, level * part >> 8);
        level = static_cast<std::uint8_t>(side == Side::kBelow ? std::max(0, level - step) : std::min(250, level + step));
    }
}

// Texture and noise just reach the threshold; a marker whose mid contrast does has pixels well beyond it.
bool Detector::has_core(const ImageView& image, const BlockGrid& thresholds, Side side, std::span<const Run> runs) const {
    const int least = static_cast<int>(config_.blob.min_contrast);
    const int part = static_cast<int>(config_.relative_contrast * 256.0);
    const int whole = side == Side::kBelow ? 256 - part : 256 + part;
    const int sign = side == Side::kBelow ? 1 : -1;
    int deep = 0;
    for (const Run& run : runs) {
        const std::uint8_t* pixels = image.row(run.y);
        const std::uint8_t* levels = &thresholds.values[static_cast<std::size_t>(run.y / kBlockPx) *
                                                        static_cast<std::size_t>(thresholds.width)];
        for (std::size_t x = run.begin; x < run.end; ++x) {
            const int level = levels[x / kBlockPx];
            const int step = std::max(least, level * part / whole);
            deep += sign * (level - pixels[x]) * 2 >= step ? 1 : 0;
        }
        if (deep >= kCorePixels) return true;
    }
    return false;
}

void Detector::detect_side(const ImageView& image, const BlockGrid& means, Side side, SideResult& result) {
    Workspace& w = workspace_;
    result.blobs.clear();
    result.report = DetectorReport{};
    const BlockGrid thresholds{std::span(w.background).first(means.values.size()), means.width, means.height};
    set_thresholds(means, thresholds, side);
    const std::size_t count = threshold_runs(image, thresholds, side, w.runs, result.report.runs_full);
    result.report.runs = static_cast<std::uint32_t>(count);
    const ComponentCounts counts = connect(std::span<const Run>(w.runs).first(count), {least_area(config_.blob)},
                                           {w.parents, w.areas, w.grouped, w.components});
    result.report.blobs_full = counts.dropped > 0;
    for (std::size_t c = 0; c < counts.components; ++c) {
        const Component component = w.components[c];
        const std::span<const Run> members = std::span<const Run>(w.grouped).subspan(component.first, component.count);
        if (!has_core(image, thresholds, side, members)) {
            ++result.report.rejected[static_cast<std::size_t>(Rejection::kFaint)];
            continue;
        }
        examine(image, side, component, members, result);
    }
    apply_population(result);
}

void Detector::examine(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                       SideResult& result) {
    const Blob blob = measure_blob(image, side, component, runs, config_.blob, workspace_.blob);
    ++result.report.candidates;
    if (blob.rejection == Rejection::kNone) {
        if (!result.blobs.push_back(blob)) result.report.blobs_full = true;
        return;
    }
    ++result.report.rejected[static_cast<std::size_t>(blob.rejection)];
    if (blob.rejection != Rejection::kSmall && blob.rejection != Rejection::kFaint) {
        split(image, side, component, runs, result);
    }
}

// A marker that hangs together with a shadow, a line or another marker stands alone at some deeper threshold.
void Detector::split(const ImageView& image, Side side, const Component& component, std::span<const Run> runs,
                     SideResult& result) {
    Workspace& w = workspace_;
    int deepest = 0;
    const std::uint8_t turn = side == Side::kBelow ? 255 : 0;
    int shallow = 255;
    for (const Run& run : runs) {
        const std::uint8_t* pixels = image.row(run.y);
        for (int x = run.begin; x < run.end; ++x) {
            const int value = pixels[x] ^ turn;
            deepest = std::max(deepest, value);
            shallow = std::min(shallow, value);
        }
    }
    for (const double depth : kSplitDepths) {
        const int level = shallow + static_cast<int>(depth * (deepest - shallow));
        std::size_t count = 0;
        for (const Run& run : runs) {
            if (w.split_runs.size() - count < static_cast<std::size_t>(run.end - run.begin) / 2 + 1) {
                result.report.runs_full = true;
                break;
            }
            const std::uint8_t* pixels = image.row(run.y);
            int begin = -1;
            for (int x = run.begin; x <= run.end; ++x) {
                const bool inside = x < run.end && (pixels[x] ^ turn) > level;
                if (inside && begin < 0) begin = x;
                if (!inside && begin >= 0) {
                    w.split_runs[count++] = {run.y, static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(x)};
                    begin = -1;
                }
            }
        }
        const ComponentCounts counts =
            connect(std::span<const Run>(w.split_runs).first(count), {least_area(config_.blob)},
                    {w.parents, w.areas, w.split_grouped, w.split_components});
        result.report.blobs_full |= counts.dropped > 0;
        for (std::size_t c = 0; c < counts.components; ++c) {
            const Component& part = w.split_components[c];
            const Blob blob = measure_blob(image, side, part,
                                           std::span<const Run>(w.split_grouped).subspan(part.first, part.count),
                                           config_.blob, w.blob);
            ++result.report.candidates;
            if (blob.rejection != Rejection::kNone) {
                ++result.report.rejected[static_cast<std::size_t>(blob.rejection)];
                continue;
            }
            // Found at both depths: the first stands.
            const auto same = [&](const Blob& other) {
                const double dx = other.x_px - blob.x_px;
                const double dy = other.y_px - blob.y_px;
                return dx * dx + dy * dy < 0.25 * blob.diameter_px * blob.diameter_px;
            };
            if (std::any_of(result.blobs.begin(), result.blobs.end(), same)) continue;
            if (!result.blobs.push_back(blob)) result.report.blobs_full = true;
        }
    }
    (void)component;
}

// The markers of one image are of one make: sizes far from the median are eyes, nostrils, teeth or moles.
void Detector::apply_population(SideResult& result) const {
    std::array<float, kMaxCandidates> sizes{};
    std::size_t count = 0;
    for (const Blob& blob : result.blobs) {
        if (blob.score >= 0.4) sizes[count++] = static_cast<float>(blob.long_axis_px);
    }
    if (count >= config_.size_quorum) {
        const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(count / 2);
        std::nth_element(sizes.begin(), middle, sizes.begin() + static_cast<std::ptrdiff_t>(count));
        const double median = static_cast<double>(*middle);
        for (Blob& blob : result.blobs) {
            const double ratio = blob.long_axis_px / median;
            if (ratio <= config_.size_ratio && ratio * config_.size_ratio >= 1.0) continue;
            blob.rejection = Rejection::kOddSize;
            ++result.report.rejected[static_cast<std::size_t>(Rejection::kOddSize)];
        }
    }
    result.quality = 0.0;
    for (const Blob& blob : result.blobs) {
        if (blob.rejection == Rejection::kNone) result.quality += blob.score * std::min(1.0, blob.contrast / 40.0);
    }
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
        std::nth_element(scores.begin(), last, scores.begin() + static_cast<std::ptrdiff_t>(good), [](float a, float b) { return a > b; });
        least = *last;
    }
    for (const Blob& blob : result.blobs) {
        if (blob.rejection != Rejection::kNone || blob.score < config_.min_score) continue;
        const auto score = static_cast<float>(blob.score);
        const Observation seen{static_cast<float>(blob.x_px), static_cast<float>(blob.y_px),
                               static_cast<float>(blob.diameter_px), static_cast<float>(std::min(1.0, blob.contrast / 255.0)),
                               score};
        if (score < least || !observations.push_back(seen)) {
            ++report.left_out;
            report.observations_full = true;
        }
    }
}

void Detector::detect(const ImageView& image, Observations& observations, DetectorReport& report) {
    observations.clear();
    report = DetectorReport{};
    if (!is_processable(image)) {
        report.unprocessable = true;
        return;
    }
    measure_exposure(image, report);
    Workspace& w = workspace_;
    const BlockGrid means = block_means(image, w.means);
    MarkerPolarity polarity = config_.polarity;
    if (polarity == MarkerPolarity::kAuto && state_.agreed >= config_.polarity_frames) polarity = state_.polarity;
    std::size_t chosen = polarity == MarkerPolarity::kBright ? 1 : 0;
    if (polarity == MarkerPolarity::kAuto) {
        detect_side(image, means, Side::kBelow, w.sides[0]);
        detect_side(image, means, Side::kAbove, w.sides[1]);
        chosen = w.sides[1].quality > w.sides[0].quality ? 1 : 0;
        add_reports(report, w.sides[0].report);
        add_reports(report, w.sides[1].report);
        decide(chosen);
    } else {
        const Side side = chosen == 0 ? Side::kBelow : Side::kAbove;
        detect_side(image, means, side, w.sides[chosen]);
        add_reports(report, w.sides[chosen].report);
    }
    report.polarity = chosen == 0 ? MarkerPolarity::kDark : MarkerPolarity::kBright;
    hand_on(w.sides[chosen], observations, report);
    if (report.runs_full || report.blobs_full || report.observations_full) {
        report.faults |= fault_bit(Fault::kBlobCapacity);
    }
}

}  // namespace rig
