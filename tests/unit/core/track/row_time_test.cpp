// A rolling shutter exposes a frame row by row; the tracker moves what it saw to the frame's capture time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/base/math.hpp"
#include "core/track/tracker.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr double kFrameUs = 1e6 / 60.0;

struct Errors {
    double sum_mm2 = 0.0;
    int count = 0;
    int wrong_names = 0;
    [[nodiscard]] double rms_mm() const { return std::sqrt(sum_mm2 / count); }
};

class RollingScene {
  public:
    RollingScene(double row_time_us, double speed, double sigma_px)
        : face_({.camera_count = 2}), row_time_us_(row_time_us), speed_(speed), sigma_px_(sigma_px) {
        model_ = test::shape_model_of(face_.pack());
    }

    // `spoil_from`: a marker, and the two after it, take the place of the next in frame 60, names and memory;
    // counted is then only the frame in which that is noticed.
    Errors run(bool correct_rows, int frames, int spoil_from = -1) {
        TrackerConfig config;
        config.correct_rows = correct_rows;
        test::SeededRandom random(515);
        Errors errors;
        for (int i = 0; i < frames; ++i) {
            if (spoil_from >= 0 && i == 60) spoil(static_cast<std::size_t>(spoil_from));
            const double time_us = 1e6 + i * kFrameUs;
            sightings_->clear();
            sightings_->capture_us = std::llround(time_us);
            std::vector<std::vector<int>> behind(2);
            for (std::size_t c = 0; c < 2; ++c) {
                CameraModel camera = face_.pack().cameras[c];
                camera.row_time_us = row_time_us_;
                const test::SyntheticFace::View view = look(c, time_us, random);
                add_camera_view(camera, view.observations, 0.15, 210.0, *sightings_);
                behind[c] = view.marker;
            }
            track(*model_, config, *sightings_, *state_, *workspace_, *named_, *report_);
            if (spoil_from < 0 ? i >= 5 : i >= 60 && report_->reconsidered > 0)
                count(time_us, behind, errors);
        }
        return errors;
    }

  private:
    // Names move on by one place among three neighbours, and what is remembered agrees.
    void spoil(std::size_t from) {
        std::array<std::size_t, 4> row{from};
        for (std::size_t i = 1; i < row.size(); ++i) {
            double nearest = 1e9;
            for (std::size_t k = 0; k < model_->marker_count; ++k) {
                const double apart = (state_->position_mm[k] - state_->position_mm[row[i - 1]]).norm();
                if (std::find(row.begin(), row.begin() + i, k) != row.begin() + i || apart >= nearest)
                    continue;
                nearest = apart;
                row[i] = k;
            }
        }
        for (std::size_t i = 0; i + 1 < row.size(); ++i) {
            const Vec3 aside = state_->position_mm[row[i + 1]] - state_->position_mm[row[i]];
            state_->bias_mm[row[i]] += aside;
            state_->position_mm[row[i]] += aside;
        }
        state_->bias_mm[row.back()] += Vec3{0.0, 0.0, 60.0};
        state_->missed[row.back()] = 1;
    }
    // A head that nods and turns beside its helmet, faster than one does, and talks.
    [[nodiscard]] std::vector<Vec3> truth(double time_us) const {
        const double t = speed_ * 2.0 * 3.141592653589793 * 1e-6 * time_us;
        const Vec3 turn{0.06 * std::sin(1.3 * t), 0.05 * std::sin(0.9 * t + 1.0), 0.03 * std::sin(1.1 * t)};
        const Vec3 shift{3.0 * std::sin(0.8 * t), 8.0 * std::sin(1.5 * t + 0.5), 2.0 * std::sin(1.2 * t)};
        return test::moved({rotation_from_vector(turn), shift},
                           face_.positions(face_.weights_at(speed_ * 1e-6 * time_us)));
    }

    // Every marker as it is when its own row is exposed.
    [[nodiscard]] test::SyntheticFace::View look(std::size_t c, double time_us,
                                                 test::SeededRandom& random) const {
        const CameraModel camera = face_.pack().cameras[c];
        const std::vector<Vec3> middle = truth(time_us);
        std::vector<Vec3> exposed = middle;
        for (std::size_t k = 0; k < middle.size(); ++k) {
            for (int round = 0; round < 4; ++round) {
                const double row = static_cast<double>(test::reference_project(camera, exposed[k]).y_px);
                const double delay_us = (row - 0.5 * (camera.height_px - 1)) * row_time_us_;
                exposed[k] = truth(time_us + delay_us)[k];
            }
        }
        return face_.observe(c, exposed, sigma_px_, 0.0, 0, random);
    }

    void count(double time_us, const std::vector<std::vector<int>>& behind, Errors& errors) const {
        const std::vector<Vec3> expected = truth(time_us);
        for (std::size_t k = 0; k < expected.size(); ++k) {
            for (std::size_t c = 0; c < 2; ++c) {
                const std::int16_t at = report_->matches[c][k];
                if (at < 0) continue;
                const std::uint16_t source = sightings_->source[c][static_cast<std::size_t>(at)];
                errors.wrong_names += behind[c][source] != static_cast<int>(k) ? 1 : 0;
            }
            if (named_->markers[k].views < 2) continue;
            errors.sum_mm2 += (named_->markers[k].position_mm - expected[k]).squaredNorm();
            ++errors.count;
        }
    }

    test::SyntheticFace face_;
    double row_time_us_;
    double speed_;
    double sigma_px_;
    std::unique_ptr<ShapeModel> model_;
    std::unique_ptr<SightingSet> sightings_ = std::make_unique<SightingSet>();
    std::unique_ptr<TrackerState> state_ = std::make_unique<TrackerState>();
    std::unique_ptr<TrackerWorkspace> workspace_ = std::make_unique<TrackerWorkspace>();
    std::unique_ptr<NamedMarkers> named_ = std::make_unique<NamedMarkers>();
    std::unique_ptr<TrackerReport> report_ = std::make_unique<TrackerReport>();
};

Errors run(double row_time_us, double speed, double sigma_px, bool correct_rows) {
    return RollingScene(row_time_us, speed, sigma_px).run(correct_rows, 240);
}

TEST(RowTime, MovingHeadIsSeenWhereItIsAtTheCaptureTime) {
    constexpr double kRowUs = 20.0;
    const Errors global = run(0.0, 1.0, 0.1, true);
    const Errors without = run(kRowUs, 1.0, 0.1, false);
    const Errors with = run(kRowUs, 1.0, 0.1, true);
    std::printf(
        "rms of markers, 480 rows of 20 us: global shutter %.3f mm, not corrected %.3f, corrected %.3f\n",
        global.rms_mm(), without.rms_mm(), with.rms_mm());
    EXPECT_GT(with.count, 5000);
    EXPECT_EQ(with.wrong_names, 0);
    EXPECT_GT(without.rms_mm(), 1.3 * global.rms_mm()) << "the scene moves fast enough to matter";
    EXPECT_LT(with.rms_mm(), 1.05 * global.rms_mm());
}

TEST(RowTime, WithoutNoiseWhatIsLeftIsTheChangeOfVelocity) {
    const Errors without = run(20.0, 1.0, 0.0, false);
    const Errors with = run(20.0, 1.0, 0.0, true);
    std::printf("without noise: not corrected %.4f mm, corrected %.4f\n", without.rms_mm(), with.rms_mm());
    EXPECT_LT(with.rms_mm(), without.rms_mm() / 8.0);
}

TEST(RowTime, AFaceAtRestIsNotMadeNoisier) {
    const Errors without = run(20.0, 0.0, 0.1, false);
    const Errors with = run(20.0, 0.0, 0.1, true);
    std::printf("at rest: not corrected %.4f mm, corrected %.4f\n", without.rms_mm(), with.rms_mm());
    EXPECT_LT(with.rms_mm(), 1.02 * without.rms_mm());
}

// The frame in which a second opinion changes names has rows as every other.
TEST(RowTime, ReconsideredFramesAreCorrectedToo) {
    const Errors without = run(20.0, 1.0, 0.0, false);
    Errors reconsidered;
    for (int from = 0; from < 60; from += 7) {
        const Errors then = RollingScene(20.0, 1.0, 0.0).run(true, 120, from);
        reconsidered.sum_mm2 += then.sum_mm2;
        reconsidered.count += then.count;
    }
    ASSERT_GT(reconsidered.count, 100);
    std::printf("reconsidered frames, without noise: %.4f mm, not corrected %.4f\n", reconsidered.rms_mm(),
                without.rms_mm());
    EXPECT_LT(reconsidered.rms_mm(), 0.5 * without.rms_mm());
}

// With every row exposed at once the correction is not even computed.
TEST(RowTime, GlobalShutterGivesTheSameBits) {
    const Errors a = run(0.0, 1.0, 0.1, false);
    const Errors b = run(0.0, 1.0, 0.1, true);
    EXPECT_EQ(a.sum_mm2, b.sum_mm2);
}

}  // namespace
}  // namespace rig
