// A camera that honours exposure and gain, two frames after they were set, under a lamp that changes: scales
// and clips what another camera delivers. Gain raises no noise here; hal's world camera does that.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "hal/frame_source.hpp"

namespace rig::test {

class LampSource final : public FrameSource {
  public:
    static constexpr double kNominal_us = 2000.0;
    using Lamp = std::function<double(std::uint32_t frame)>;

    LampSource(FrameSource& inner, Lamp lamp) : inner_(inner), lamp_(std::move(lamp)) {
        pending_.fill({kNominal_us, 0.0});
    }
    Result<FrameFormat, FrameError> start() override {
        auto format = inner_.start();
        if (!format) return format;
        const auto count = static_cast<std::size_t>(format->width_px * format->height_px);
        for (auto& pixels : slots_) pixels.resize(count);
        return format;
    }
    void stop() override { inner_.stop(); }
    Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) override {
        auto frame = inner_.wait_frame(deadline_us);
        if (!frame) return frame;
        const double scale = lamp_(frame->sequence) * pending_[0].exposure_us / kNominal_us *
                             std::pow(10.0, pending_[0].gain_db / 20.0);
        std::vector<std::uint8_t>& pixels = slots_[frame->token % slots_.size()];
        auto out = pixels.begin();
        for (int y = 0; y < frame->image.height_px; ++y) {
            const std::uint8_t* row = frame->image.row(y);
            for (int x = 0; x < frame->image.width_px; ++x) {
                *out++ = static_cast<std::uint8_t>(std::min(255.0, scale * row[x] + 0.5));
            }
        }
        frame->image.pixels = pixels.data();
        frame->image.stride_bytes = frame->image.width_px;
        std::shift_left(pending_.begin(), pending_.end(), 1);
        pending_.back() = newest_;
        return frame;
    }
    void release(std::uint32_t token) override { inner_.release(token); }
    [[nodiscard]] int borrow_limit() const override { return std::min<int>(inner_.borrow_limit(), 3); }
    Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) override {
        auto set = inner_.set_exposure_us(exposure_us);
        if (set) newest_.exposure_us = pending_.back().exposure_us = exposure_us;
        return set;
    }
    Result<void, FrameError> set_gain_db(float gain_db) override {
        auto set = inner_.set_gain_db(gain_db);
        if (set) newest_.gain_db = pending_.back().gain_db = static_cast<double>(gain_db);
        return set;
    }
    [[nodiscard]] double exposure_us() const { return newest_.exposure_us; }

  private:
    struct Setting {
        double exposure_us = kNominal_us;
        double gain_db = 0.0;
    };
    FrameSource& inner_;
    Lamp lamp_;
    Setting newest_;
    std::array<Setting, 3> pending_{};
    std::array<std::vector<std::uint8_t>, 8> slots_;
};

}  // namespace rig::test
