#include "firmware_host/companion/world/sensor.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/world/vector.hpp"
#include "firmware_host/companion/world/wide_loops.hpp"

namespace rig::host {

namespace {

// A small global-shutter sensor: 10 000 electrons at 255 DN without gain, 12 electrons of read noise.
constexpr float kElectronsPerDn = 39.0F;
constexpr float kReadNoise_dn = 0.55F;
constexpr float kBlackLevel_dn = 2.0F;
constexpr std::size_t kQuantileBits = 12;
constexpr std::size_t kLanes = 8;

// Inverse of the normal distribution by bisection on erfc: slow and exact, a table is made of it once.
double normal_quantile(double p) {
    double low = -8.0, high = 8.0;
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Eight xorshift32 generators side by side (Marsaglia 2003): a pure function of its seed, row by row.
void fill_normal(std::uint64_t seed, std::span<const float> quantiles, std::span<float> row) {
    std::array<std::uint32_t, kLanes> state{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        state[lane] = static_cast<std::uint32_t>(mix_bits(seed + lane) >> 32) | 1U;
    }
    for (std::size_t x = 0; x < row.size(); x += kLanes) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            std::uint32_t s = state[lane];
            s ^= s << 13;
            s ^= s >> 17;
            s ^= s << 5;
            state[lane] = s;
        }
        const std::size_t here = std::min(kLanes, row.size() - x);
        for (std::size_t lane = 0; lane < here; ++lane)
            row[x + lane] = quantiles[state[lane] >> (32 - kQuantileBits)];
    }
}

// out[x] = k0 in[x] + sum over k of taps[k] (in[x - k step] + in[x + k step])
RIG_WIDE_LOOPS void convolve(const float* in, std::size_t step, std::span<const float> taps,
                             std::size_t count, float* __restrict__ out) {
    for (std::size_t x = 0; x < count; ++x) out[x] = taps[0] * in[x];
    for (std::size_t k = 1; k < taps.size(); ++k) {
        const float tap = taps[k];
        const float* before = in - k * step;
        const float* after = in + k * step;
        for (std::size_t x = 0; x < count; ++x) out[x] += tap * (before[x] + after[x]);
    }
}

struct Amplifier {
    float scale;  // exposure times gain
    float shot;   // variance per DN of signal
    float read;   // variance
};

RIG_WIDE_LOOPS void digitise(const Amplifier& amplifier, const float* light, const float* shade,
                             const float* normal, std::size_t count, std::uint8_t* __restrict__ out) {
    for (std::size_t x = 0; x < count; ++x) {
        const float signal = light[x] * shade[x] * amplifier.scale;
        const float value =
            kBlackLevel_dn + 0.5F + signal + std::sqrt(amplifier.shot * signal + amplifier.read) * normal[x];
        const float low = value > 0.0F ? value : 0.0F;
        out[x] = static_cast<std::uint8_t>(static_cast<int>(low < 255.0F ? low : 255.0F));
    }
}

}  // namespace

Sensor::Sensor(const HelmetCamera& camera, double defocus_px, double vignetting, double noise)
    : width_(static_cast<std::size_t>(camera.width_px)),
      height_(static_cast<std::size_t>(camera.height_px)),
      noise_(static_cast<float>(noise)) {
    const double sigma = std::clamp(defocus_px, 0.0, 3.0);
    const int reach = sigma > 0.05 ? static_cast<int>(std::ceil(3.0 * sigma)) : 0;
    double sum = 0.0;
    std::vector<double> kernel;
    for (int k = 0; k <= reach; ++k) {
        kernel.push_back(reach == 0 ? 1.0 : std::exp(-0.5 * k * k / (sigma * sigma)));
        sum += (k == 0 ? 1.0 : 2.0) * kernel.back();
    }
    for (const double k : kernel) taps_.push_back(static_cast<float>(k / sum));
    const double corner = std::hypot(0.5 * camera.width_px, 0.5 * camera.height_px);
    for (std::size_t y = 0; y < height_; ++y) {
        for (std::size_t x = 0; x < width_; ++x) {
            const double r =
                std::hypot(static_cast<double>(x) - camera.cx_px, static_cast<double>(y) - camera.cy_px);
            vignetting_.push_back(
                static_cast<float>(1.0 - vignetting * std::min(1.3, (r * r) / (corner * corner))));
        }
    }
    constexpr std::size_t kCount = std::size_t{1} << kQuantileBits;
    for (std::size_t i = 0; i < kCount; ++i) {
        quantiles_.push_back(static_cast<float>(normal_quantile((static_cast<double>(i) + 0.5) / kCount)));
    }
    scratch_.resize(width_ * height_);
    noise_row_.resize(width_);
}

// Separable; inside the lit rectangle widened by the kernel's reach, where anything can change.
void Sensor::blur(Radiance& light) {
    const std::size_t reach = taps_.size() - 1;
    if (reach == 0) return;
    const std::size_t left =
        std::max<std::size_t>(static_cast<std::size_t>(light.first_column), 2 * reach) - reach;
    const std::size_t right = std::min(static_cast<std::size_t>(light.end_column) + reach, width_ - reach);
    const std::size_t top =
        std::max<std::size_t>(static_cast<std::size_t>(light.first_row), 2 * reach) - reach;
    const std::size_t bottom = std::min(static_cast<std::size_t>(light.end_row) + reach, height_ - reach);
    if (left >= right || top >= bottom) return;
    const std::size_t span = right - left;
    for (std::size_t y = top - reach; y < bottom + reach; ++y) {
        convolve(light.values.data() + y * width_ + left, 1, taps_, span,
                 scratch_.data() + y * width_ + left);
    }
    for (std::size_t y = top; y < bottom; ++y) {
        convolve(scratch_.data() + y * width_ + left, width_, taps_, span,
                 light.values.data() + y * width_ + left);
    }
}

void Sensor::expose(Radiance& light, const CameraControl& control, std::uint64_t seed, std::uint64_t frame,
                    std::uint64_t camera, std::span<std::uint8_t> image) {
    blur(light);
    const float gain = std::pow(10.0F, std::clamp(control.gain_db, -20.0F, 48.0F) / 20.0F);
    const float exposure = std::clamp(control.exposure_us, 0.0F, 100000.0F) / kNominalExposure_us;
    const float shot = noise_ * noise_ * gain / kElectronsPerDn;  // variance per DN of signal after gain
    const float read = noise_ * noise_ * gain * gain * kReadNoise_dn * kReadNoise_dn;
    const std::uint64_t stream = mix_bits(mix_bits(seed + 11) + 4096 * frame + camera);
    for (std::size_t y = 0; y < height_; ++y) {
        fill_normal(mix_bits(stream + y), quantiles_, noise_row_);
        const Amplifier amplifier{exposure * gain, shot, read};
        digitise(amplifier, light.values.data() + y * width_, vignetting_.data() + y * width_,
                 noise_row_.data(), width_, image.data() + y * width_);
    }
}

}  // namespace rig::host
