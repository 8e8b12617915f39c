#include "tests/support/pack_samples/sample_pack.hpp"

namespace rig::test {

namespace {

// Repeatable numbers in [-1, 1) without any pattern that a bug could mirror.
class Numbers {
  public:
    float next() {
        state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
        return static_cast<float>(static_cast<std::int64_t>(state_ >> 40) - (1 << 23)) /
               static_cast<float>(1 << 23);
    }
    std::vector<float> many(std::size_t count, float scale, float offset = 0.0F) {
        std::vector<float> out(count);
        for (float& x : out) x = offset + scale * next();
        return out;
    }

  private:
    std::uint64_t state_ = 1;
};

}  // namespace

SamplePack::SamplePack(const SamplePackSize& size) {
    Numbers numbers;
    const std::size_t rows = 3UL * size.markers;
    neutral = numbers.many(rows, 80.0F);
    basis = numbers.many(rows * size.shapes, 8.0F);
    low.assign(size.shapes, 0.0F);
    high.assign(size.shapes, 1.0F);
    mean = numbers.many(size.shapes, 0.1F, 0.2F);
    sigma = numbers.many(size.shapes, 0.1F, 0.3F);
    gamma = numbers.many(size.shapes, 1.0F, 2.0F);
    for (std::size_t i = 0; i < size.shapes; ++i) names.push_back("shape_" + std::to_string(i));
    for (std::size_t i = 0; i < size.markers; ++i) names.push_back("marker_" + std::to_string(i));

    view.marker_count = size.markers;
    view.shape_count = size.shapes;
    view.solver = size.solver;
    view.neutral_mm = neutral;
    view.basis_mm = basis;
    view.weight_low = low;
    view.weight_high = high;
    view.prior_mean = mean;
    view.prior_sigma = sigma;
    view.temporal_gamma = gamma;
    view.sparsity_mm2 = 0.05F;
    view.ridge_mm2 = 0.01F;
    for (std::size_t i = 0; i < size.shapes; ++i) view.shape_names[i] = names[i];
    for (std::size_t i = 0; i < size.markers; ++i) view.marker_names[i] = names[size.shapes + i];
    view.camera_count = size.cameras;
    for (std::size_t c = 0; c < size.cameras; ++c) {
        CameraModel& camera = view.cameras[c];
        camera.width_px = 640;
        camera.height_px = 480;
        camera.fx_px = camera.fy_px = 500.0;
        camera.cx_px = 319.5;
        camera.cy_px = 239.5;
        camera.k1 = -0.1;
        camera.camera_from_headset << 1, 0, 0, 0, -1, 0, 0, 0, -1;
        camera.centre_mm = Vec3(10.0 * static_cast<double>(c), -40.0, 200.0);
    }
    if (size.solver != SolverKind::kRbf) return;
    RbfModel& rbf = view.rbf;
    rbf.dimension_count = size.rbf_dimensions;
    rbf.centre_count = size.rbf_centres;
    rbf_mean = neutral;
    rbf_basis.assign(size.rbf_dimensions * rows, 0.0F);
    for (std::size_t i = 0; i < size.rbf_dimensions; ++i) rbf_basis[i * rows + i] = 1.0F;
    rbf_centres = numbers.many(std::size_t{size.rbf_centres} * size.rbf_dimensions, 30.0F);
    rbf_widths = numbers.many(size.rbf_centres, 5.0F, 12.0F);
    rbf_weights = numbers.many(std::size_t{size.rbf_centres} * size.shapes, 1.0F);
    rbf_offset = numbers.many(size.shapes, 0.1F, 0.1F);
    rbf.mean_mm = rbf_mean;
    rbf.basis = rbf_basis;
    rbf.centres = rbf_centres;
    rbf.widths_mm = rbf_widths;
    rbf.weights = rbf_weights;
    rbf.offset = rbf_offset;
}

}  // namespace rig::test
