// Pictures of the synthetic face, good enough to be solved: dark discs on noisy skin, as two helmet cameras
// see them. Not for judging accuracy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "hal/sim/memory_frame_source.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {

inline constexpr double kTakeRate_hz = 60.0;

struct PaintedTakeOptions {
    std::vector<HelmetMark> marks;  // dots fixed to the helmet, in the pictures and in the pack
    std::size_t knocked_camera = 0;
    std::uint32_t knocked_from = 0;  // first frame in which it is turned
    Vec3 knock_rad = Vec3::Zero();   // camera axes
    bool at_rest = false;            // the face does nothing
    double aside_mm = 0.0;           // how far every dot is glued aside, its own way
};

class PaintedTake {
  public:
    PaintedTake() : PaintedTake(PaintedTakeOptions{}) {}
    explicit PaintedTake(PaintedTakeOptions options);
    [[nodiscard]] const SolvePack& pack() const { return pack_; }
    // The same bytes for the same camera and frame, always.
    void paint(std::size_t camera, std::uint32_t frame, std::span<std::uint8_t> pixels) const;
    [[nodiscard]] sim::FramePainter painter(std::size_t camera) const {
        return [this, camera](std::uint32_t frame, std::span<std::uint8_t> pixels) {
            paint(camera, frame, pixels);
        };
    }
    [[nodiscard]] std::vector<double> weights_at(std::uint32_t frame) const {
        return options_.at_rest ? std::vector<double>(face_.shape_count(), 0.0)
                                : face_.weights_at(frame / kTakeRate_hz);
    }
    [[nodiscard]] int width_px() const { return pack_.cameras[0].width_px; }
    [[nodiscard]] int height_px() const { return pack_.cameras[0].height_px; }

  private:
    PaintedTakeOptions options_;
    SyntheticFace face_;
    SolvePack pack_;
};

// One for all tests of a program: it is the same.
[[nodiscard]] const PaintedTake& painted_take();

}  // namespace rig::test
