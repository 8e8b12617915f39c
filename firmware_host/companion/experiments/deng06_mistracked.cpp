// Deng06 section 7 and Fig. 7: "when markers are not perfectly tracked, our approach can automatically deal
// with it reasonably well, because the regression inputs are in the reduced PCA space".
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/quadratic_solvers.hpp"
#include "firmware_host/companion/experiments/rbf_regression.hpp"
#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kTrials = 12;  // pairs of markers
constexpr double kOffsetMm = 10.0;
constexpr double kNoiseMm = 0.1;
constexpr std::size_t kFrames = 600;       // 10 s out of the middle of the take
constexpr std::size_t kSettleFrames = 30;  // the pipeline finds its feet; not judged

// Two markers and where they seem to be, the same for a whole trial.
struct Mistake {
    std::array<std::size_t, 2> marker{};
    std::array<std::array<double, 3>, 2> offset_mm{};
};

Mistake mistake_of(std::size_t trial, std::size_t marker_count) {
    WhiteNoise random(4000 + trial);
    Mistake out;
    out.marker[0] = static_cast<std::size_t>(random.uniform() * static_cast<double>(marker_count));
    out.marker[1] = (out.marker[0] + 1 +
                     static_cast<std::size_t>(random.uniform() * static_cast<double>(marker_count - 1))) %
                    marker_count;
    for (auto& offset : out.offset_mm) {
        double length = 0.0;
        for (double& x : offset) {
            x = random.next();
            length += x * x;
        }
        for (double& x : offset) x *= kOffsetMm / std::sqrt(length);
    }
    return out;
}

void apply(const Mistake& mistake, std::vector<float>& t) {
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            t[3 * mistake.marker[i] + axis] += static_cast<float>(mistake.offset_mm[i][axis]);
    }
}

// Weight rms of every solver over the window.
struct Scores {
    double equations = 0.0;
    double rbf = 0.0;
    double box = 0.0;
};

class Trials {
  public:
    Trials(const RecordedHead& head, RbfRegression& rbf, BoxQpPipeline& box)
        : head_(head), equations_(head.model), rbf_(rbf), box_(box) {}

    Scores run(const Mistake* mistake) {
        WeightError equations(head_.model);
        WeightError rbf(head_.model);
        WeightError box(head_.model);
        const Take& take = head_.range_of_motion;
        const std::size_t first = take.frame_count / 2;
        box_.restart();
        for (std::size_t f = first; f < first + kFrames; ++f) {
            std::vector<float> t = marker_frame(head_.model, take, f, kNoiseMm, 73);
            if (mistake != nullptr) apply(*mistake, t);
            const std::span<const float> boxed = box_.solve(t);
            if (f < first + kSettleFrames) continue;
            const std::span<const float> truth = frame_weights(take, f);
            box.add(boxed, truth);
            equations.add(clamped(equations_.solve(t)), truth);
            rbf.add(rbf_.evaluate(t), truth);
        }
        return {equations.rms(), rbf.rms(), box.rms()};
    }

  private:
    const RecordedHead& head_;
    EquationSolving equations_;
    RbfRegression& rbf_;
    BoxQpPipeline& box_;
};

std::vector<std::string> row(const char* name, double clean, double bad, double worst) {
    return {name,
            fmt::format("{:.4f}", clean),
            fmt::format("{:.4f}", bad),
            fmt::format("{:.4f}", worst),
            fmt::format("{:+.4f}", bad - clean),
            fmt::format("{:+.0f} %", 100.0 * (bad / clean - 1.0))};
}

}  // namespace

Result<ExperimentTable, FileError> deng06_mistracked(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    auto rbf = RbfRegression::learn(head->model, head->range_of_motion, kNoiseMm, {.dimensions = 4});
    if (!rbf) return failure(rbf.error());
    auto box = BoxQpPipeline::learn(*head, true);
    if (!box) return failure(box.error());
    Trials trials(*head, *rbf, *box);
    const Scores clean = trials.run(nullptr);
    Scores mean;  // of squares, then their root
    Scores worst;
    for (std::size_t trial = 0; trial < kTrials; ++trial) {
        const Mistake mistake = mistake_of(trial, head->layout.markers.size());
        const Scores bad = trials.run(&mistake);
        const auto add = [](double value, double& square, double& most) {
            square += value * value / static_cast<double>(kTrials);
            most = std::max(most, value);
        };
        add(bad.equations, mean.equations, worst.equations);
        add(bad.rbf, mean.rbf, worst.rbf);
        add(bad.box, mean.box, worst.box);
    }
    ExperimentTable out;
    out.columns = {"solver", "clean", "two markers off, rms", "worst pair", "rise", "rise, relative"};
    out.rows = {row("least squares, clamped", clean.equations, std::sqrt(mean.equations), worst.equations),
                row("RBF, 4 components", clean.rbf, std::sqrt(mean.rbf), worst.rbf),
                row("box QP with gating", clean.box, std::sqrt(mean.box), worst.box)};
    const double rbf_rise = std::sqrt(mean.rbf) / clean.rbf - 1.0;
    const double box_rise = std::sqrt(mean.box) / clean.box - 1.0;
    out.bounds = {{"relative rise of the RBF with 4 components", rbf_rise, 0.25},
                  {"relative rise of the box QP with gating, at most the RBF's", box_rise, rbf_rise}};
    out.remarks = {
        fmt::format("Weight rms over shapes > 1 mm; {} pairs of markers at random, each {} mm off in a "
                    "fixed direction; {} frames of the range-of-motion take, 60 markers, {} mm noise.",
                    kTrials, kOffsetMm, kFrames, kNoiseMm),
        "The regression learned from the same take; the truth is exactly linear in the shapes, which "
        "flatters least squares."};
    return out;
}

}  // namespace rig::host
