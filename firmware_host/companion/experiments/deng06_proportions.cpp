// Deng06 section 7 and Fig. 6: a captured face of other proportions than the model's. Equation solving scales
// the capture per axis by ratios of landmark distances and solves for the weights; the RBF learned from
// reference frames of the capture itself.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/quadratic_solvers.hpp"
#include "firmware_host/companion/experiments/rbf_regression.hpp"

namespace rig::host {

namespace {

constexpr double kNoiseMm = 0.1;
constexpr std::size_t kStride = 8;

// The performer's face is the model's, wider at the forehead and narrower at the chin, longer below, and
// flatter: smooth, within 15 % everywhere, and no scaling per axis.
constexpr double kWidth = 1.06;
constexpr double kWidthPerMm = 0.0012;
constexpr double kHeight = 1.05;
constexpr double kHeightPerMm = -0.0008;
constexpr double kDepth = 0.94;

MarkerModel other_proportions(const MarkerModel& model) {
    MarkerModel out = model;
    const std::size_t n = model.basis_mm.size() / model.neutral_mm.size();
    for (std::size_t r = 0; r < model.neutral_mm.size(); r += 3) {
        const auto x = static_cast<double>(model.neutral_mm[r]);
        const auto y = static_cast<double>(model.neutral_mm[r + 1]);
        const auto z = static_cast<double>(model.neutral_mm[r + 2]);
        out.neutral_mm[r] = static_cast<float>((kWidth + kWidthPerMm * y) * x);
        out.neutral_mm[r + 1] = static_cast<float>(kHeight * y + kHeightPerMm * y * y);
        out.neutral_mm[r + 2] = static_cast<float>(kDepth * z);
        for (std::size_t i = 0; i < n; ++i) {
            // motions by the derivative of the same map
            const auto dx = static_cast<double>(model.basis_mm[r * n + i]);
            const auto dy = static_cast<double>(model.basis_mm[(r + 1) * n + i]);
            const auto dz = static_cast<double>(model.basis_mm[(r + 2) * n + i]);
            out.basis_mm[r * n + i] =
                static_cast<float>((kWidth + kWidthPerMm * y) * dx + kWidthPerMm * x * dy);
            out.basis_mm[(r + 1) * n + i] = static_cast<float>((kHeight + 2.0 * kHeightPerMm * y) * dy);
            out.basis_mm[(r + 2) * n + i] = static_cast<float>(kDepth * dz);
        }
    }
    return out;
}

// Per axis: mean and extent of the neutral face.
struct Extent {
    std::array<double, 3> centre{};
    std::array<double, 3> size{};
};

Extent extent_of(const MarkerModel& model) {
    Extent out;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double low = 1e9;
        double high = -1e9;
        for (std::size_t r = axis; r < model.neutral_mm.size(); r += 3) {
            const auto x = static_cast<double>(model.neutral_mm[r]);
            low = std::min(low, x);
            high = std::max(high, x);
            out.centre[axis] += 3.0 * x / static_cast<double>(model.neutral_mm.size());
        }
        out.size[axis] = high - low;
    }
    return out;
}

std::vector<float> scaled(const std::vector<float>& t, const Extent& from, const Extent& to) {
    std::vector<float> out(t.size());
    for (std::size_t r = 0; r < t.size(); ++r) {
        const std::size_t axis = r % 3;
        const double ratio = to.size[axis] / from.size[axis];
        out[r] =
            static_cast<float>(to.centre[axis] + ratio * (static_cast<double>(t[r]) - from.centre[axis]));
    }
    return out;
}

struct Scores {
    double equations = 0.0;
    double equations_clamped = 0.0;
    double box = 0.0;
    double stillness = 0.0;
};

Scores score_solvers(const RecordedHead& head, const MarkerModel& performer, const Take& take,
                     BoxQpPipeline& box) {
    const Extent from = extent_of(performer);
    const Extent to = extent_of(head.model);
    const EquationSolving equations(head.model);
    WeightError raw(head.model);
    WeightError bounded(head.model);
    WeightError boxed(head.model);
    WeightError still(head.model);
    const std::vector<float> rest(take.shape_names.size(), 0.0F);
    box.restart();
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        // Every frame for the one that remembers, some for the others.
        const std::vector<float> t = scaled(marker_frame(performer, take, f, kNoiseMm, 79), from, to);
        const std::span<const float> solved = box.solve(t);
        if (f < 30 || f % kStride != 0) continue;
        const std::span<const float> truth = frame_weights(take, f);
        boxed.add(solved, truth);
        const std::vector<float> w = equations.solve(t);
        raw.add(w, truth);
        bounded.add(clamped(w), truth);
        still.add(rest, truth);
    }
    return {raw.rms(), bounded.rms(), boxed.rms(), still.rms()};
}

}  // namespace

Result<ExperimentTable, FileError> deng06_proportions(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    const MarkerModel performer = other_proportions(head->model);
    auto box = BoxQpPipeline::learn(*head, false);
    if (!box) return failure(box.error());
    const Scores in_take = score_solvers(*head, performer, head->range_of_motion, *box);
    const Scores across = score_solvers(*head, performer, head->speech, *box);
    ExperimentTable out;
    out.columns = {"solver", "same take", "distance p50 / p95", "other take (speech)", "distance p50 / p95"};
    const auto plain = [&](const char* name, double same, double other) {
        out.rows.push_back({name, fmt::format("{:.4f}", same), "-", fmt::format("{:.4f}", other), "-"});
    };
    plain("no motion at all", in_take.stillness, across.stillness);
    plain("least squares", in_take.equations, across.equations);
    plain("least squares, clamped", in_take.equations_clamped, across.equations_clamped);
    plain("box QP", in_take.box, across.box);
    for (const std::size_t dimensions : {4, 20}) {
        auto rbf =
            RbfRegression::learn(performer, head->range_of_motion, kNoiseMm, {.dimensions = dimensions});
        if (!rbf) return failure(rbf.error());
        const TakeScore same = score(*rbf, performer, head->range_of_motion, kNoiseMm, kStride);
        const TakeScore other = score(*rbf, performer, head->speech, kNoiseMm, kStride);
        out.rows.push_back({fmt::format("RBF, {} components", dimensions),
                            fmt::format("{:.4f}", same.weight_rms),
                            fmt::format("{:.2f} / {:.2f}", same.distance_p50, same.distance_p95),
                            fmt::format("{:.4f}", other.weight_rms),
                            fmt::format("{:.2f} / {:.2f}", other.distance_p50, other.distance_p95)});
        if (dimensions != 4) continue;
        out.bounds.push_back({"RBF(4) over clamped least squares, same take",
                              same.weight_rms / in_take.equations_clamped, 0.5});
    }
    out.remarks = {
        "Weight rms over shapes > 1 mm, 60 markers, 0.1 mm noise; distances to the nearest reference in "
        "its widths; the regression learned from the range-of-motion take.",
        "The truth is exactly linear in the shapes, which flatters least squares and high dimensions."};
    return out;
}

}  // namespace rig::host
