// Bytes as a picture: width, height, extra stride and polarity come from the first bytes, the rest repeats as
// pixels.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/detect/detector.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace rig;
    if (size < 6) return 0;
    const int width = 1 + (data[0] | data[1] << 8) % 400;
    const int height = 1 + (data[2] | data[3] << 8) % 300;
    const int stride = width + data[4] % 16;
    const std::size_t count = static_cast<std::size_t>(stride) * static_cast<std::size_t>(height - 1) +
                              static_cast<std::size_t>(width);
    std::vector<std::uint8_t> pixels(count);
    const std::size_t period = size - 5;
    for (std::size_t i = 0; i < count; ++i) pixels[i] = data[5 + i % period];

    static const auto detector = std::make_unique<Detector>();
    DetectorConfig config;
    config.polarity = static_cast<MarkerPolarity>(data[4] / 16 % 3);
    if (!detector->configure(config)) std::abort();
    static Observations observations;
    DetectorReport report;
    detector->detect(
        {.pixels = pixels.data(), .width_px = width, .height_px = height, .stride_bytes = stride},
        observations, report);
    if (report.unprocessable) std::abort();
    for (const Observation& seen : observations) {
        const bool inside = seen.x_px >= 0.0F && seen.x_px <= static_cast<float>(width - 1) &&
                            seen.y_px >= 0.0F && seen.y_px <= static_cast<float>(height - 1);
        const bool sane = seen.diameter_px > 0.0F && seen.diameter_px <= 64.0F && seen.contrast >= 0.0F &&
                          seen.contrast <= 1.0F && seen.score >= 0.0F && seen.score <= 1.0F;
        if (!inside || !sane) std::abort();
    }
    return 0;
}
