// A small face made of arithmetic, for tests: markers on the front of an ellipsoid, smooth local shapes,
// curves that move them, helmet slips, and the views of helmet cameras. Deterministic from its options. Its
// own positions are exact (double), so that it can contradict core. Not for: pictures or plausible heads; the
// simulated world makes those.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/linalg.hpp"
#include "core/detect/observation.hpp"
#include "core/geometry/shape_model.hpp"
#include "core/pack/solve_pack.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

struct SyntheticFaceOptions {
    std::size_t marker_count = 60;
    std::size_t shape_count = 30;
    std::size_t duplicate_columns = 0;  // of these, the last ones copy earlier shapes
    std::size_t zero_columns = 0;       // ... move nothing
    std::size_t dependent_columns = 0;  // ... are the sum of two earlier ones
    std::size_t camera_count = 0;       // on the helmet, about 210 mm in front
    double noise_mm = 0.1;
    double temporal_gamma_mm2 = 0.0;
    double ridge_mm2 = 1e-4;
    SolverKind solver = SolverKind::kBoxQp;
    std::uint64_t seed = 1;
};

// The shape model of a pack's basis and priors.
[[nodiscard]] std::unique_ptr<ShapeModel> shape_model_of(const SolvePack& pack);

class SyntheticFace {
  public:
    explicit SyntheticFace(const SyntheticFaceOptions& options);

    // Spans into this object, which outlives every use of it.
    [[nodiscard]] SolvePack pack() const;

    [[nodiscard]] std::size_t marker_count() const { return options_.marker_count; }
    [[nodiscard]] std::size_t shape_count() const { return options_.shape_count; }
    [[nodiscard]] const Vec3& outward(std::size_t marker) const { return outward_[marker]; }

    // Smooth curves in [0, 1], most of them near 0 most of the time, as a face's are. mean 0.19, speed up to
    // 4/s.
    [[nodiscard]] std::vector<double> weights_at(double time_s) const;
    // Independent draws from the pack's prior, clamped to the range.
    [[nodiscard]] std::vector<double> random_weights(SeededRandom& random) const;

    // neutral + B w, face frame, mm.
    [[nodiscard]] std::vector<Vec3> positions(std::span<const double> weights) const;

    // Root mean square over coordinates of B (a - b), mm.
    [[nodiscard]] double marker_rms(std::span<const double> a, std::span<const double> b) const;
    // Length of a shape's column in B, mm.
    [[nodiscard]] double column_length(std::size_t shape) const;

    // What camera c sees of markers at these headset positions; those turned away or outside the image are
    // left out. marker[i] is the marker behind observation i, -1 for a false dot. Shuffled.
    struct View {
        std::vector<Observation> observations;
        std::vector<int> marker;
    };
    [[nodiscard]] View observe(std::size_t camera, std::span<const Vec3> headset_mm, double sigma_px,
                               double hide_probability, int false_dots, SeededRandom& random) const;

  private:
    void place_markers(SeededRandom& random);
    void make_shapes(SeededRandom& random);
    void make_cameras();

    SyntheticFaceOptions options_;
    std::vector<Vec3> neutral_;
    std::vector<Vec3> outward_;
    std::vector<float> neutral_mm_;
    std::vector<float> basis_mm_;
    std::vector<float> low_;
    std::vector<float> high_;
    std::vector<float> mean_;
    std::vector<float> sigma_;
    std::vector<float> gamma_;
    std::vector<std::string> names_;
    std::vector<std::array<double, 3>> curves_;  // frequency Hz, phase rad, height
    std::array<CameraModel, kMaxCameras> cameras_{};
};

// The pose of a helmet that creeps, and jumps at some frames. headset_from_face.
[[nodiscard]] Rigid creeping_slip(double time_s);
// Uniform within +-rotation_rad about each axis and +-translation_mm along each.
[[nodiscard]] Rigid random_slip(SeededRandom& random, double rotation_rad, double translation_mm);

[[nodiscard]] std::vector<Vec3> moved(const Rigid& pose, std::span<const Vec3> points);
void add_noise(std::span<Vec3> points, double sigma_mm, SeededRandom& random);

// Projection through either lens model in long double from the published formulas, independent of core's.
struct ReferencePixel {
    long double x_px;
    long double y_px;
    long double z_mm;
};
[[nodiscard]] ReferencePixel reference_project(const CameraModel& camera, const Vec3& headset_point_mm);

}  // namespace rig::test
