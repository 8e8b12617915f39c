// Auto-exposure for markers: from what a camera's detector measured, the exposure time and gain that keep
// the dots' contrast and let nothing saturate beside them. A face is not a photograph: what counts is the
// light at the markers, not in the picture. Not for: setting a camera, or finding markers.
#pragma once

#include <cstdint>

#include "core/base/faults.hpp"
#include "core/base/result.hpp"

namespace rig {

// What one frame says of its light; grey levels 0..255. NaN or out of range: as if no marker had been seen.
struct LightReading {
    double brightest_level = 0.0;     // the brighter side of the markers (skin beside ink, retro-reflective
                                      // paint), of the brightest tenth of them
    double faintest_contrast = 0.0;   // of the faintest tenth
    std::uint16_t marker_count = 0;   // sightings those two come from
    double mean_luma = 0.0;           // of the whole image
    double saturated_fraction = 0.0;  // of its pixels
};

struct ExposureConfig {
    double shortest_us = 20.0;  // what the camera can
    double longest_us = 16000.0;
    double most_gain_db = 24.0;  // 0 dB is the least
    double blur_limit_us =
        4000.0;             // longest exposure that motion allows: 0.25 m/s moves 1 mm, 3 px; gain beyond
    double mains_hz = 0.0;  // 50 or 60 where lamps flicker: exposures are multiples of half its period if
                            // long enough; 0 for lamps that do not
    double target_level =
        165.0;                  // of the brightest tenth of the markers: 50 % more light is no saturation yet
    double black_level = 2.0;   // of the sensor, at no light
    double band = 1.25;         // light off by less than this factor either way is left alone
    double largest_step = 2.0;  // factor of one change, either way
    double least_contrast = 20.0;     // grey levels, below which markers are called faint
    std::uint16_t least_markers = 4;  // below: the picture's own brightness leads
    std::uint8_t settle_frames =
        3;  // from a change until it is seen: two frames of latency, and one to spare
    std::uint8_t window_frames = 3;     // that agree before a change: a flash is no light
    double start_exposure_us = 2000.0;  // where it begins; shared out anew between the two
    double start_gain_db = 0.0;
};

enum class ExposureError : std::uint8_t { kRange, kTarget, kTiming };

enum class ExposureTrouble : std::uint8_t {
    kTooDark = 1,    // all the exposure and gain there is, and still dark
    kTooBright = 2,  // the least there is, and still saturated
    kFaint = 4,      // the light is right, or cannot be better, and the markers' contrast is small
    kFlicker = 8,    // shorter than half a period of the mains: brightness may beat
    kBlind = 16,     // too few markers to go by
};

struct ExposureProposal {
    std::int32_t exposure_us = 0;
    float gain_db = 0.0F;
    bool changed = false;      // to be set on the camera; true on the first frame
    std::uint8_t trouble = 0;  // ExposureTrouble bits
    FaultMap faults = 0;       // kExposure when too dark or too bright
};

// One camera. Deterministic: a function of the readings since configure(). Every proposal is finite and in
// the camera's range, whatever the readings.
class ExposureControl {
  public:
    // Validates once. On failure the control keeps its configuration.
    [[nodiscard]] Result<void, ExposureError> configure(const ExposureConfig& config);

    // One call per frame that was delivered, in order.
    [[nodiscard]] ExposureProposal step(const LightReading& reading);

  private:
    struct Window {
        int frames = 0;
        int sighted = 0;     // frames with enough markers
        double level = 0.0;  // sums
        double contrast = 0.0;
        double luma = 0.0;
        int saturated = 0;  // frames whose level, or without markers whose picture, is
    };

    void gather(const LightReading& reading);
    void decide();
    [[nodiscard]] double wanted_ratio(bool sighted) const;
    void apply(double ratio);
    void split(double light);
    [[nodiscard]] double least_light() const;
    [[nodiscard]] double most_light() const;
    [[nodiscard]] ExposureProposal proposal(bool changed) const;

    ExposureConfig config_;
    double longest_us_ = 4000.0;  // camera and blur limit
    double most_gain_ = 15.848931924611133;
    double exposure_us_ = 2000.0;
    double gain_ = 1.0;         // amplitude ratio
    double usual_luma_ = 60.0;  // of the picture when the markers are right; a guess before that
    Window window_;
    int wait_ = 0;
    bool told_ = false;  // the first proposal has been made
    std::uint8_t trouble_ = 0;
};

}  // namespace rig
