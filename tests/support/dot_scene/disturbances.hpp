// What lies over the discs of a disc_scene, drawn into its samples: specular light is added, dark things
// multiply.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/support/dot_scene/disc_scene.hpp"
#include "tests/support/dot_scene/light_field.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

inline constexpr int kFine = 4;  // samples per pixel and axis

// Light at every sample, which disc it is on (-1: none), and whether something lies over it.
class FineField {
  public:
    FineField(int width_px, int height_px);
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] float& light(int u, int v) { return light_[at(u, v)]; }
    [[nodiscard]] std::int16_t& owner(int u, int v) { return owner_[at(u, v)]; }
    void hide(int u, int v) { hidden_[at(u, v)] = 1; }
    [[nodiscard]] static double pixel_of(int sample) { return (sample + 0.5) / kFine - 0.5; }
    [[nodiscard]] int first(double px) const;  // sample at or before this coordinate, inside the field
    [[nodiscard]] int end(double px, int limit) const;  // one past the sample at or after it
    void note_hidden(std::vector<DiscTruth>& discs) const;
    [[nodiscard]] LightField pixels() const;

  private:
    [[nodiscard]] std::size_t at(int u, int v) const {
        return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
    }
    int width_;
    int height_;
    std::vector<float> light_;
    std::vector<std::int16_t> owner_;
    std::vector<std::uint8_t> hidden_;
};

// What happens to the whole picture.
struct Film {
    double exposure = 1.0;
    double motion_px = 0.0;
    double motion_rad = 0.0;
};

Film disturb(const DiscSceneConfig& config, const std::vector<DiscTruth>& discs, FineField& fine,
             SeededRandom& random);

}  // namespace rig::test
