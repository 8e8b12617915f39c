#include "tests/sim/daemon/painted_take.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/random.hpp"

namespace rig::test {

namespace {

constexpr double kSkin = 150.0;
constexpr double kInk = 45.0;
constexpr double kDotRadius_mm = 1.9;
constexpr double kGrazing = 0.3;

SyntheticFaceOptions options() {
    SyntheticFaceOptions result;
    result.camera_count = 2;
    return result;
}

// A disc with one pixel of soft edge.
void paint_disc(std::span<std::uint8_t> pixels, int width, int height, double cx, double cy, double radius) {
    const int reach = static_cast<int>(radius) + 2;
    const int left = std::max(0, static_cast<int>(cx) - reach);
    const int right = std::min(width - 1, static_cast<int>(cx) + reach);
    const int top = std::max(0, static_cast<int>(cy) - reach);
    const int bottom = std::min(height - 1, static_cast<int>(cy) + reach);
    for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
            const double cover = std::clamp(radius + 0.5 - std::hypot(x - cx, y - cy), 0.0, 1.0);
            std::uint8_t& pixel = pixels[static_cast<std::size_t>(y * width + x)];
            pixel = static_cast<std::uint8_t>(pixel + cover * (kInk - kSkin));
        }
    }
}

}  // namespace

PaintedTake::PaintedTake(PaintedTakeOptions chosen)
    : options_(std::move(chosen)), face_(options()), pack_(face_.pack()) {
    for (const HelmetMark& mark : options_.marks) pack_.reference_marks[pack_.reference_mark_count++] = mark;
}

void PaintedTake::paint(std::size_t camera, std::uint32_t frame, std::span<std::uint8_t> pixels) const {
    // Eight pixels a draw: grain of a few grey levels.
    SeededRandom random((std::uint64_t{frame} << 8) + camera + 1);
    for (std::size_t i = 0; i < pixels.size(); i += 8) {
        const std::uint64_t bits = random.bits();
        for (std::size_t k = 0; k < 8 && i + k < pixels.size(); ++k) {
            pixels[i + k] =
                static_cast<std::uint8_t>(kSkin - 3.0 + static_cast<double>(bits >> (8 * k) & 7U));
        }
    }
    const bool knocked = camera == options_.knocked_camera && frame >= options_.knocked_from;
    const CameraModel model =
        knocked ? turned_camera(pack_.cameras[camera], options_.knock_rad) : pack_.cameras[camera];
    auto positions = face_.positions(weights_at(frame));
    for (std::size_t k = 0; k < positions.size(); ++k) {
        SeededRandom way(k + 1);
        const Vec3 aside{way.normal(0.0, 1.0), way.normal(0.0, 1.0), way.normal(0.0, 1.0)};
        positions[k] += options_.aside_mm * aside.normalized();
    }
    const auto paint_dot = [&](const Vec3& position) {
        const ReferencePixel at = reference_project(model, position);
        const double radius = kDotRadius_mm * model.fx_px / static_cast<double>(at.z_mm);
        paint_disc(pixels, model.width_px, model.height_px, static_cast<double>(at.x_px),
                   static_cast<double>(at.y_px), radius);
    };
    for (std::size_t k = 0; k < positions.size(); ++k) {
        const Vec3 to_camera = (model.centre_mm - positions[k]).normalized();
        if (to_camera.dot(face_.outward(k)) >= kGrazing) paint_dot(positions[k]);
    }
    for (const HelmetMark& mark : options_.marks) {
        if ((mark.cameras >> camera & 1U) != 0) paint_dot(mark.headset_mm);
    }
}

const PaintedTake& painted_take() {
    static const PaintedTake take;
    return take;
}

}  // namespace rig::test
