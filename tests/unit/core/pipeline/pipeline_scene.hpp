// A synthetic face, its performance under slip, and a pipeline that solves it frame by frame.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {

inline constexpr std::int64_t kFrameUs = 16'667;

struct PipelineScene {
    explicit PipelineScene(const PipelineConfig& config = {}, const SyntheticFaceOptions& options = {})
        : face(options) {
        EXPECT_TRUE(pipeline->configure(face.pack(), config).has_value());
    }

    std::vector<Vec3> seen_at(int at) {
        const double time_s = at / 60.0;
        std::vector<Vec3> points = moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
        add_noise(points, 0.1, random);
        return points;
    }
    // One labelled frame of the performance, or a tick with nothing.
    void labelled() {
        const std::vector<Vec3> points = seen_at(frame);
        pipeline->step(LabelledFrame{now(), points}, state, report);
        after();
    }
    // What the first two cameras observe of it; valid until the next call.
    [[nodiscard]] ObservationFrame observed(const std::vector<Vec3>& points) {
        ObservationFrame seen;
        seen.capture_us = now();
        seen.camera_count = 2;
        for (std::size_t c = 0; c < 2; ++c) {
            views_[c] = face.observe(c, points, 0.1, 0.0, 0, random);
            seen.status[c] = CameraStatus::kGood;
            seen.cameras[c] = views_[c].observations;
        }
        return seen;
    }
    void idle() {
        pipeline->idle(now(), state, report);
        after();
    }
    [[nodiscard]] std::int64_t now() const { return 1'000'000 + frame * kFrameUs; }
    [[nodiscard]] double weight_rms() const {
        const std::vector<double> truth = face.weights_at((frame - 1) / 60.0);
        double sum = 0.0;
        for (std::size_t i = 0; i < truth.size(); ++i) {
            const double e = static_cast<double>(state.weights[i]) - truth[i];
            sum += e * e;
        }
        return std::sqrt(sum / static_cast<double>(truth.size()));
    }
    // Largest change of a weight since the tick before.
    double step_size = 0.0;

    SyntheticFace face;
    std::unique_ptr<Pipeline> pipeline = std::make_unique<Pipeline>();
    FaceState state;
    FrameReport report;
    int frame = 0;
    SeededRandom random{161};

  private:
    void after() {
        ++frame;
        step_size = 0.0;
        for (std::size_t i = 0; i < face.shape_count(); ++i) {
            step_size = std::max(step_size, std::fabs(static_cast<double>(state.weights[i] - before_[i])));
        }
        before_ = state.weights;
    }
    std::array<float, kMaxShapes> before_{};
    std::array<SyntheticFace::View, 2> views_;
};

}  // namespace rig::test
