#include "tests/support/pack_samples/sample_pack.hpp"

#include "core/base/float_kernels.hpp"

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
    view.reference_mark_count = size.reference_marks;
    for (std::size_t i = 0; i < size.reference_marks; ++i) {
        view.reference_marks[i].headset_mm = Vec3(10.0 * static_cast<double>(i), 60.0, -7.25);
        view.reference_marks[i].cameras =
            i % 2 == 0 ? std::uint8_t{1} : static_cast<std::uint8_t>((1U << size.cameras) - 1U);
    }
    if (is_regional(size.solver)) add_regions(size);
    if (size.marker_sets) add_marker_sets(size);
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

void SamplePack::add_regions(const SamplePackSize& size) {
    Numbers numbers;
    regions.resize(2);
    for (std::uint16_t k = 0; k < size.markers; ++k) {
        if (k < 3) regions[0].markers.push_back(k);
        if (k >= 2) regions[1].markers.push_back(k);
    }
    const RegionSolver own =
        size.solver == SolverKind::kExamples ? RegionSolver::kSimplex : RegionSolver::kNonNegative;
    const RegionSolver other =
        own == RegionSolver::kSimplex ? RegionSolver::kNonNegative : RegionSolver::kSimplex;
    for (std::size_t r = 0; r < 2; ++r) {
        Region& region = regions[r];
        const std::size_t n = r == 0 ? size.region_examples : 2;
        const std::size_t m = region.markers.size();
        region.marker_blend.assign(m, 1.0F);
        for (std::size_t a = 0; a < m; ++a) {
            if (region.markers[a] == 2) region.marker_blend[a] = r == 0 ? 0.25F : 0.75F;
        }
        const RegionSolver solver = r == 0 ? own : other;
        region.origin = numbers.many(3 * m, 50.0F);
        for (std::size_t row = 0; row < 3 * m; ++row) {
            float sum = 0.0F;
            for (const std::uint16_t k : region.markers) sum += neutral[3U * k + row % 3];
            if (solver == RegionSolver::kNonNegative) region.origin[row] = sum / static_cast<float>(m);
            std::vector<float> examples = numbers.many(n, 10.0F);
            float middle = 0.0F;
            for (const float x : examples) middle += x / static_cast<float>(n);
            for (float& x : examples) x -= solver == RegionSolver::kSimplex ? middle : 0.0F;
            examples.resize(padded(n), 0.0F);
            region.examples.insert(region.examples.end(), examples.begin(), examples.end());
        }
        region.shapes = numbers.many(n * size.shapes, 0.5F, 0.5F);
        for (std::size_t i = 0; i < size.shapes; ++i)
            region.shape_blend.push_back(i == 0 ? 0.5F : i % 2 == r ? 1.0F : 0.0F);
        RegionModel& model = view.regions[r];
        model.name = r == 0 ? "upper" : "lower";
        model.solver = solver;
        model.marker_count = static_cast<std::uint16_t>(m);
        model.example_count = static_cast<std::uint16_t>(n);
        model.markers = region.markers;
        model.marker_blend = region.marker_blend;
        model.origin_mm = region.origin;
        model.examples_mm = region.examples;
        model.shapes = region.shapes;
        model.shape_blend = region.shape_blend;
    }
    view.region_count = 2;
}

void SamplePack::add_marker_sets(const SamplePackSize& size) {
    Numbers numbers;
    constexpr const char* kNames[] = {"face", "most", "two"};
    sets.resize(3);
    for (std::uint16_t k = 0; k < size.markers; ++k) {
        sets[0].markers.push_back(k);
        if (k + 1 < size.markers) sets[1].markers.push_back(k);
        if (k < 2) sets[2].markers.push_back(k);
    }
    for (std::size_t f = 0; f < sets.size(); ++f) {
        Set& set = sets[f];
        const std::size_t rows = 3 * set.markers.size();
        const std::size_t modes = 4 - f;
        set.mean = numbers.many(rows, 2.0F);
        set.modes.assign(modes * rows, 0.0F);
        for (std::size_t j = 0; j < modes; ++j) {
            // Unit vectors, each in a plane of two coordinates of its own.
            set.modes[j * rows + j] = 0.6F;
            set.modes[j * rows + rows - 1 - j] = 0.8F;
            set.variance.push_back(8.0F / static_cast<float>(j + 1));
        }
        set.residual = numbers.many(set.markers.size(), 0.01F, 0.02F);
        MarkerSetModel& model = view.marker_sets[f];
        model.name = kNames[f];
        model.level = static_cast<std::uint8_t>(f);
        model.marker_count = static_cast<std::uint16_t>(set.markers.size());
        model.mode_count = static_cast<std::uint16_t>(modes);
        model.markers = set.markers;
        model.mean_mm = set.mean;
        model.modes = set.modes;
        model.variance_mm2 = set.variance;
        model.residual_mm2 = set.residual;
    }
    view.marker_set_count = 3;
}

}  // namespace rig::test
