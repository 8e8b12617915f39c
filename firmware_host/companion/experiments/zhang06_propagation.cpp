// Zhang06 Fig. 12: motion propagation from 17 feature points, the error at them against the number of
// sweeps, on expressions that the components were made from; and what the figure does not show, the error at
// the inferred points of other expressions.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/marker_completion.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/experiments/region_fit.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kKnown = 17;
constexpr std::size_t kExamples = 35;     // the source: 30 to 40
constexpr std::size_t kExpressions = 25;  // the source's test
constexpr std::size_t kComponents = 10;
constexpr double kNoiseMm = 0.1;  // what the closed form expects; the points have none
constexpr std::array<std::uint16_t, 9> kSweeps{1, 2, 5, 10, 20, 50, 100, 200, 1000};

using Faces = std::vector<std::vector<Vec3>>;

// Points that are as far from each other as can be, from the one in the middle on. 0 known, 1 hidden.
std::vector<char> hidden_but_spread(const SetsOfFace& face) {
    const std::size_t m = face.marker_count();
    Vec3 middle = Vec3::Zero();
    for (std::size_t k = 0; k < m; ++k) middle += face.neutral_mm(k) / static_cast<double>(m);
    std::vector<double> gap_mm(m);
    for (std::size_t k = 0; k < m; ++k) gap_mm[k] = -(face.neutral_mm(k) - middle).norm();
    std::vector<char> hidden(m, 1);
    for (std::size_t i = 0; i < std::min(kKnown, m); ++i) {
        const auto next = static_cast<std::size_t>(std::ranges::max_element(gap_mm) - gap_mm.begin());
        hidden[next] = 0;
        for (std::size_t k = 0; k < m; ++k) {
            const double gap = (face.neutral_mm(k) - face.neutral_mm(next)).norm();
            gap_mm[k] = i == 0 ? gap : std::min(gap_mm[k], gap);
        }
    }
    return hidden;
}

std::vector<Vec3> face_at(const MarkerModel& model, const Eigen::VectorXd& weights) {
    std::vector<Vec3> out(model.neutral_mm.size() / 3);
    const auto n = static_cast<std::size_t>(weights.size());
    for (std::size_t r = 0; r < model.neutral_mm.size(); ++r) {
        auto x = static_cast<double>(model.neutral_mm[r]);
        for (std::size_t i = 0; i < n; ++i)
            x += static_cast<double>(model.basis_mm[r * n + i]) * weights[static_cast<Eigen::Index>(i)];
        out[r / 3][static_cast<Eigen::Index>(r % 3)] = x;
    }
    return out;
}

// Frames at even times.
Faces frames_of(const MarkerModel& model, const Take& take, std::size_t count) {
    Faces out;
    for (std::size_t i = 0; i < count; ++i) {
        const std::span<const float> w = frame_weights(take, (2 * i + 1) * take.frame_count / (2 * count));
        out.push_back(face_at(
            model,
            Eigen::Map<const Eigen::VectorXf>(w.data(), static_cast<Eigen::Index>(w.size())).cast<double>()));
    }
    return out;
}

struct Errors {
    double known_mm = 0.0;     // mean distance at the known points, as the source's figure
    double inferred_mm = 0.0;  // rms distance at the others
};

double inferred_rms(const Faces& truth, const Faces& made, const std::vector<char>& hidden) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t e = 0; e < truth.size(); ++e) {
        for (std::size_t k = 0; k < hidden.size(); ++k) {
            if (hidden[k] == 0) continue;
            sum += (made[e][k] - truth[e][k]).squaredNorm();
            ++count;
        }
    }
    return std::sqrt(sum / static_cast<double>(count));
}

Errors propagated(const SetsOfFace& face, const Faces& truth, const std::vector<char>& hidden,
                  const PropagationConfig& config) {
    Propagation propagation(face, config);
    Faces made = truth;
    Errors out;
    for (std::vector<Vec3>& positions : made) {
        out.known_mm +=
            propagation.complete(positions, hidden).known_error_mm / static_cast<double>(made.size());
    }
    out.inferred_mm = inferred_rms(truth, made, hidden);
    return out;
}

double closed_rms(const SetsOfFace& face, const Faces& truth, const std::vector<char>& hidden) {
    ClosedForm closed(face);
    Faces made = truth;
    for (std::size_t e = 0; e < truth.size(); ++e) {
        const InferenceOutput& output = closed.complete(truth[e], hidden);
        std::copy_n(output.position_mm.begin(), made[e].size(), made[e].begin());
    }
    return inferred_rms(truth, made, hidden);
}

double known_displacement(const SetsOfFace& face, const Faces& truth, const std::vector<char>& hidden) {
    double sum = 0.0;
    for (const std::vector<Vec3>& positions : truth) {
        for (std::size_t k = 0; k < hidden.size(); ++k) {
            if (hidden[k] == 0) sum += (positions[k] - face.neutral_mm(k)).norm();
        }
    }
    return sum / static_cast<double>(truth.size() * kKnown);
}

}  // namespace

Result<ExperimentTable, FileError> zhang06_propagation(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "102");
    if (!head) return failure(head.error());
    const Eigen::MatrixXd examples = face_examples(*head, head->range_of_motion, kExamples);
    const SetsOfFace face(head->layout, head->model, spread_of_expressions(examples), kNoiseMm,
                          {.face_modes = kComponents, .set_modes = kComponents});
    const std::vector<char> hidden = hidden_but_spread(face);
    Faces own;
    for (std::size_t e = 0; e < kExpressions; ++e) {
        const auto at =
            static_cast<Eigen::Index>(e * static_cast<std::size_t>(examples.rows()) / kExpressions);
        own.push_back(face_at(head->model, examples.row(at).transpose()));
    }
    const Faces motion = frames_of(head->model, head->range_of_motion, kExpressions);
    const Faces speech = frames_of(head->model, head->speech, kExpressions);
    ExperimentTable out;
    out.columns = {"sweeps",
                   "known points, mm",
                   "from the whole face first",
                   "inferred, mm",
                   "inferred, other expressions",
                   "inferred, other performer"};
    const auto cell = [](double x) { return fmt::format("{:.3f}", x); };
    out.rows.push_back({"0", cell(known_displacement(face, own, hidden)), "", "", "", ""});
    double at_fifty = std::numeric_limits<double>::quiet_NaN();
    double floor = std::numeric_limits<double>::quiet_NaN();
    for (const std::uint16_t sweeps : kSweeps) {
        PropagationConfig config{.most_sweeps = sweeps, .most_modes = kComponents, .least_progress_mm = -1e9};
        const Errors fine = propagated(face, own, hidden, config);
        const Errors moving = propagated(face, motion, hidden, config);
        const Errors speaking = propagated(face, speech, hidden, config);
        config.begins_fine = false;
        const Errors coarse = propagated(face, own, hidden, config);
        out.rows.push_back({std::to_string(sweeps), cell(fine.known_mm), cell(coarse.known_mm),
                            cell(fine.inferred_mm), cell(moving.inferred_mm), cell(speaking.inferred_mm)});
        if (sweeps == 50) at_fifty = fine.known_mm;
        floor = fine.known_mm;
    }
    out.rows.push_back({"closed form, 10 components", "", "", cell(closed_rms(face, own, hidden)),
                        cell(closed_rms(face, motion, hidden)), cell(closed_rms(face, speech, hidden))});
    const SetsOfFace all(head->layout, head->model, spread_of_expressions(examples), kNoiseMm);
    out.rows.push_back({"closed form, all components", "", "", cell(closed_rms(all, own, hidden)),
                        cell(closed_rms(all, motion, hidden)), cell(closed_rms(all, speech, hidden))});
    out.bounds.push_back({"error at the known points, 50 sweeps over the floor", at_fifty / floor, 1.25});
    out.remarks = {fmt::format(
        "{} of 102 markers known, {} sets, {} components, {} examples of the range-of-motion take; the first "
        "columns are {} of the examples themselves, as in the source, the last two frames at even times of "
        "the takes. Known: mean distance, 0 sweeps: nothing moved. Inferred: rms distance. The floor is at "
        "1000 sweeps.",
        kKnown, face.sets().size(), kComponents, examples.rows(), kExpressions)};
    return out;
}

}  // namespace rig::host
