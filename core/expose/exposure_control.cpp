#include "core/expose/exposure_control.hpp"

#include <algorithm>

#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kSaturatedLevel = 248.0;          // grey levels: noise keeps it below 255
constexpr double kFloodedFraction = 0.25;          // of the picture, without markers to go by
constexpr double kBlindBand = 1.6;                 // the picture's mean says less than the markers
constexpr double kLeastSignal = 1.0;               // grey levels over black, for ratios
constexpr double kDbPerNeper = 8.685889638065037;  // 20 / ln 10

bool in_range(double value, double low, double high) {
    return value >= low && value <= high;  // false for NaN
}

// 20 log10(ratio) for 1 <= ratio <= 1e3: Newton's method on exp, which converges from above for every start
// at or below the root's value plus one; ten rounds reach 1e-12.
double decibels(double ratio) {
    double y = 0.0;
    for (int round = 0; round < 12; ++round) {
        const double e = exp(y);
        y += 2.0 * (ratio - e) / (ratio + e);  // Halley's step: never overshoots by more than two
    }
    return kDbPerNeper * y;
}

bool is_sighted(const LightReading& r, const ExposureConfig& c) {
    return r.marker_count >= c.least_markers && in_range(r.brightest_level, 0.0, 255.0) &&
           in_range(r.faintest_contrast, 0.0, 255.0);
}

std::uint8_t bit(ExposureTrouble trouble) {
    return static_cast<std::uint8_t>(trouble);
}

}  // namespace

Result<void, ExposureError> ExposureControl::configure(const ExposureConfig& c) {
    if (!in_range(c.shortest_us, 1.0, 1e6) || !in_range(c.longest_us, c.shortest_us, 1e6) ||
        !in_range(c.blur_limit_us, c.shortest_us, 1e6) || !in_range(c.most_gain_db, 0.0, 60.0) ||
        !in_range(c.start_exposure_us, c.shortest_us, std::min(c.longest_us, c.blur_limit_us)) ||
        !in_range(c.start_gain_db, 0.0, c.most_gain_db)) {
        return failure(ExposureError::kRange);
    }
    if (!in_range(c.black_level, 0.0, 64.0) || !in_range(c.target_level, c.black_level + 16.0, 240.0) ||
        !in_range(c.band, 1.05, 4.0) || !in_range(c.largest_step, c.band, 16.0) ||
        !in_range(c.least_contrast, 0.0, 255.0)) {
        return failure(ExposureError::kTarget);
    }
    if (!(c.mains_hz == 0.0 || in_range(c.mains_hz, 10.0, 1000.0)) || c.window_frames == 0) {
        return failure(ExposureError::kTiming);
    }
    *this = ExposureControl{};
    config_ = c;
    longest_us_ = std::min(c.longest_us, c.blur_limit_us);
    most_gain_ = exp(c.most_gain_db / kDbPerNeper);
    split(c.start_exposure_us * exp(c.start_gain_db / kDbPerNeper));
    return {};
}

double ExposureControl::least_light() const {
    return config_.shortest_us;
}

double ExposureControl::most_light() const {
    return longest_us_ * most_gain_;
}

// Exposure before gain, as far as motion allows; a whole number of the lamps' half periods when there is room
// for one. Gain makes up what the exposure cannot.
void ExposureControl::split(double light) {
    exposure_us_ = std::clamp(light, config_.shortest_us, longest_us_);
    if (config_.mains_hz > 0.0) {
        const double flash_us = 5e5 / config_.mains_hz;
        const auto flashes = static_cast<int>(exposure_us_ / flash_us);
        if (flashes * flash_us >= config_.shortest_us) exposure_us_ = flashes * flash_us;
    }
    const auto whole_us = static_cast<double>(static_cast<std::int32_t>(exposure_us_));
    exposure_us_ = whole_us >= config_.shortest_us ? whole_us : std::min(whole_us + 1.0, longest_us_);
    gain_ = std::clamp(light / exposure_us_, 1.0, most_gain_);
}

void ExposureControl::gather(const LightReading& r) {
    const bool sighted = is_sighted(r, config_);
    ++window_.frames;
    if (sighted) {
        ++window_.sighted;
        window_.level += r.brightest_level;
        window_.contrast += r.faintest_contrast;
        window_.saturated += r.brightest_level >= kSaturatedLevel ? 1 : 0;
    }
    window_.luma += in_range(r.mean_luma, 0.0, 255.0) ? r.mean_luma : usual_luma_;
    if (!sighted && in_range(r.saturated_fraction, kFloodedFraction, 1.0)) ++window_.saturated;
}

// By how much more light the picture should have.
double ExposureControl::wanted_ratio(bool sighted) const {
    // How far above full scale nobody can say; a single frame is a flash, not the light.
    if (2 * window_.saturated > window_.frames) return 1.0 / config_.largest_step;
    const double level = sighted ? window_.level / window_.sighted : window_.luma / window_.frames;
    const double target = sighted ? config_.target_level : usual_luma_;
    return (target - config_.black_level) / std::max(kLeastSignal, level - config_.black_level);
}

void ExposureControl::apply(double ratio) {
    const double now = exposure_us_ * gain_;
    const double light = now * std::clamp(ratio, 1.0 / config_.largest_step, config_.largest_step);
    split(std::clamp(light, least_light(), most_light()));
}

void ExposureControl::decide() {
    const bool sighted = 2 * window_.sighted > window_.frames;
    const double ratio = wanted_ratio(sighted);
    const double band = sighted ? config_.band : std::max(kBlindBand, config_.band);
    const bool steady = ratio <= band && ratio * band >= 1.0;
    const double old_us = exposure_us_;
    const double old_gain = gain_;
    trouble_ = sighted ? 0 : bit(ExposureTrouble::kBlind);
    if (steady) {
        if (sighted) usual_luma_ = std::clamp(window_.luma / window_.frames, 16.0, 160.0);
    } else {
        apply(ratio);
    }
    const double change = exposure_us_ * gain_ / (old_us * old_gain);
    // A last step smaller than the band is the range's end: taken, and called what it is.
    const bool at_end = !steady && change < band && change * band > 1.0;
    if (at_end) trouble_ |= bit(ratio > 1.0 ? ExposureTrouble::kTooDark : ExposureTrouble::kTooBright);
    if (sighted && (steady || at_end) && window_.contrast < config_.least_contrast * window_.sighted) {
        trouble_ |= bit(ExposureTrouble::kFaint);
    }
    window_ = Window{};
    if (exposure_us_ != old_us || gain_ != old_gain) wait_ = config_.settle_frames;
}

ExposureProposal ExposureControl::proposal(bool changed) const {
    ExposureProposal result;
    result.exposure_us = static_cast<std::int32_t>(exposure_us_);
    result.gain_db = static_cast<float>(std::clamp(decibels(gain_), 0.0, config_.most_gain_db));
    result.changed = changed;
    result.trouble = trouble_;
    if (config_.mains_hz > 0.0 && exposure_us_ + 1.0 < 5e5 / config_.mains_hz) {
        result.trouble |= bit(ExposureTrouble::kFlicker);
    }
    const int dark_or_bright = bit(ExposureTrouble::kTooDark) | bit(ExposureTrouble::kTooBright);
    if ((trouble_ & dark_or_bright) != 0) result.faults = fault_bit(Fault::kExposure);
    return result;
}

ExposureProposal ExposureControl::step(const LightReading& reading) {
    if (!told_) {
        told_ = true;
        wait_ = config_.settle_frames;
        return proposal(true);
    }
    if (wait_ > 0) {
        --wait_;
        return proposal(false);
    }
    gather(reading);
    if (window_.frames < config_.window_frames) return proposal(false);
    const double old_us = exposure_us_;
    const double old_gain = gain_;
    decide();
    return proposal(exposure_us_ != old_us || gain_ != old_gain);
}

}  // namespace rig
