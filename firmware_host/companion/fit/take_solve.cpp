#include "firmware_host/companion/fit/take_solve.hpp"

#include <cmath>
#include <memory>

#include "core/infer/inference.hpp"
#include "core/solve/solver.hpp"
#include "core/stabilise/stabiliser.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kProgressFrames = 64;

// The stages between naming and filtering; some megabytes, so never on a stack.
struct Stages {
    ShapeModel model;
    ShapeModelWorkspace model_workspace;
    StabiliserConfig stabiliser_config;
    StabiliserState stabiliser;
    StabiliserWorkspace stabiliser_workspace;
    StabiliserOutput stabilised;
    StabiliserReport stabiliser_report;
    FaceGaussian face_gaussian;
    FaceGaussianWorkspace face_gaussian_workspace;
    InferenceWorkspace inference_workspace;
    InferenceOutput completed;
    SolverConfig solver_config;
    SolverState solver;
    SolverWorkspace solver_workspace;
    SolverOutput output;
    SolverReport report;
    NamedMarkers named;
};

void name_markers(const MarkerTake& take, std::size_t frame, double noise_mm, std::int64_t capture_us,
                  NamedMarkers& named) {
    named.capture_us = capture_us;
    named.count = static_cast<std::uint16_t>(take.marker_count);
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        named.markers[k] = NamedMarker{};
        if (!take.seen(frame, k)) continue;
        named.markers[k].seen = true;
        named.markers[k].position_mm = take.at(frame, k);
        named.markers[k].information = Mat3::Identity() / (noise_mm * noise_mm);
    }
}

}  // namespace

SolvedTake solve_take(const SolvePack& pack, const MarkerTake& take, bool stabilised,
                      const std::function<void(double)>& progress) {
    const auto stages = std::make_unique<Stages>();
    build_shape_model(pack.neutral_mm, pack.basis_mm, pack.prior_mean, pack.prior_sigma,
                      stages->model_workspace, stages->model);
    build_face_gaussian(pack, stages->model, stages->face_gaussian_workspace, stages->face_gaussian);
    configure_solver(pack, take.rate_hz, stages->solver_workspace, stages->solver_config);
    stages->stabiliser_config.enabled = stabilised;
    const auto shapes = static_cast<Eigen::Index>(pack.shape_count);
    SolvedTake out;
    out.weights = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(take.frame_count), shapes);
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        const auto capture_us =
            static_cast<std::int64_t>(std::llround(static_cast<double>(f) * 1e6 / take.rate_hz));
        name_markers(take, f, static_cast<double>(pack.noise_mm), capture_us, stages->named);
        stabilise(stages->model, stages->stabiliser_config, stages->named, stages->stabiliser,
                  stages->stabiliser_workspace, stages->stabilised, stages->stabiliser_report);
        infer_missing(stages->face_gaussian, stages->stabilised, stages->inference_workspace,
                      stages->completed);
        solve(stages->solver_config, stages->stabilised, stages->completed, capture_us, stages->solver,
              stages->solver_workspace, stages->output, stages->report);
        out.headset_from_face.push_back(stages->stabilised.headset_from_face);
        out.solved.push_back(stages->report.solved);
        for (Eigen::Index i = 0; i < shapes; ++i) {
            out.weights(static_cast<Eigen::Index>(f), i) =
                static_cast<double>(stages->output.weights[static_cast<std::size_t>(i)]);
        }
        if (progress && f % kProgressFrames == 0)
            progress(static_cast<double>(f) / static_cast<double>(take.frame_count));
    }
    return out;
}

}  // namespace rig::host
