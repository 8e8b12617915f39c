#include "core/stabilise/neutral_capture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/stabilise/stabiliser.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr double kNoiseMm = 0.1;

// A face whose dots are glued aside, seen in the headset frame under slip.
class GluedFace {
  public:
    explicit GluedFace(double aside_mm) : face_({}) {
        model_ = test::shape_model_of(face_.pack());
        for (std::size_t k = 0; k < face_.marker_count(); ++k) {
            Vec3 way{random_.normal(0.0, 1.0), random_.normal(0.0, 1.0), random_.normal(0.0, 1.0)};
            aside.push_back(aside_mm * way.normalized());
        }
    }

    // One tick; hidden markers are not seen.
    void tick(const std::vector<double>& weights, const std::vector<bool>& hidden = {}) {
        std::vector<Vec3> points = face_.positions(weights);
        for (std::size_t k = 0; k < points.size(); ++k) points[k] += aside[k];
        points = test::moved(test::creeping_slip(frame_++ / 60.0), points);
        test::add_noise(points, kNoiseMm, random_);
        named_->count = static_cast<std::uint16_t>(points.size());
        for (std::size_t k = 0; k < points.size(); ++k) {
            NamedMarker& marker = named_->markers[k];
            marker = NamedMarker{};
            if (!hidden.empty() && hidden[k]) continue;
            marker.seen = true;
            marker.position_mm = points[k];
            marker.information = Mat3::Identity() / (kNoiseMm * kNoiseMm);
        }
        StabiliserReport unused;
        subtract_offsets(*state, stabiliser_->fit.pose, *named_);
        stabilise(*model_, {}, *named_, *stabiliser_, *workspace_, *stabilised, unused);
        watch_neutral(*model_, face_.pack().neutral_mm, kNoiseMm, config, stabilised.get(), *state, report);
    }
    void rest(int ticks, const std::vector<bool>& hidden = {}) {
        const std::vector<double> still(face_.shape_count(), 0.0);
        for (int i = 0; i < ticks; ++i) tick(still, hidden);
    }
    void blank_tick() {
        watch_neutral(*model_, face_.pack().neutral_mm, kNoiseMm, config, nullptr, *state, report);
    }
    [[nodiscard]] const test::SyntheticFace& face() const { return face_; }
    // Rms distance of the stabilised markers from the neutral.
    [[nodiscard]] double off_neutral_mm() const {
        double sum = 0.0;
        for (std::size_t k = 0; k < face_.marker_count(); ++k) {
            for (std::size_t a = 0; a < 3; ++a) {
                const double e = stabilised->markers[k].position_mm[static_cast<Eigen::Index>(a)] -
                                 static_cast<double>(face_.pack().neutral_mm[3 * k + a]);
                sum += e * e;
            }
        }
        return std::sqrt(sum / static_cast<double>(face_.marker_count()));
    }

    std::vector<Vec3> aside;
    NeutralConfig config;
    std::unique_ptr<NeutralState> state = std::make_unique<NeutralState>();
    std::unique_ptr<StabiliserOutput> stabilised = std::make_unique<StabiliserOutput>();
    NeutralReport report;

  private:
    test::SyntheticFace face_;
    test::SeededRandom random_{717};
    std::unique_ptr<ShapeModel> model_;
    std::unique_ptr<NamedMarkers> named_ = std::make_unique<NamedMarkers>();
    std::unique_ptr<StabiliserState> stabiliser_ = std::make_unique<StabiliserState>();
    std::unique_ptr<StabiliserWorkspace> workspace_ = std::make_unique<StabiliserWorkspace>();
    int frame_ = 0;
};

TEST(NeutralCapture, TakesTheOffsetsOfAFaceAtRest) {
    GluedFace glued(1.0);
    glued.rest(30);
    const double before = glued.off_neutral_mm();
    begin_neutral(*glued.state);
    for (int i = 1; i < 60; ++i) {
        glued.rest(1);
        ASSERT_EQ(glued.report.phase, NeutralPhase::kCollecting) << i;
        EXPECT_EQ(glued.report.frames, i);
    }
    glued.rest(1);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kTaken);
    EXPECT_NEAR(glued.report.rms_mm, 1.0, 0.15);
    EXPECT_LT(glued.report.value, 1.6);
    glued.rest(1);
    EXPECT_EQ(glued.report.phase, NeutralPhase::kIdle);
    std::printf("off the neutral: before %.3f mm, after %.3f (noise %.3f)\n", before, glued.off_neutral_mm(),
                std::sqrt(3.0) * kNoiseMm);
    EXPECT_GT(before, 0.8);
    EXPECT_LT(glued.off_neutral_mm(), 1.15 * std::sqrt(3.0) * kNoiseMm);
    // Again: the offsets are those of both together, not the second's.
    begin_neutral(*glued.state);
    glued.rest(60);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kTaken);
    EXPECT_NEAR(glued.report.rms_mm, 1.0, 0.15);
    reset_neutral(*glued.state);
    glued.rest(30);
    EXPECT_NEAR(glued.off_neutral_mm(), before, 0.1);
}

TEST(NeutralCapture, RefusesWhileTalkingAndKeepsWhatItHad) {
    GluedFace glued(0.5);
    begin_neutral(*glued.state);
    glued.rest(60);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kTaken);
    const auto offsets = glued.state->offset_mm;
    for (int from = 0; from < 600; from += 60) {
        begin_neutral(*glued.state);
        for (int i = 0; i < 60; ++i) glued.tick(glued.face().weights_at((from + i) / 60.0));
        ASSERT_EQ(glued.report.phase, NeutralPhase::kRefused) << from;
        EXPECT_EQ(glued.report.refusal, NeutralRefusal::kMoved);
        EXPECT_GT(glued.report.value, 0.4);
        EXPECT_EQ(glued.state->offset_mm, offsets);
    }
}

TEST(NeutralCapture, RefusesAHeldExpression) {
    GluedFace glued(1.0);
    int refused = 0;
    for (std::size_t shape = 0; shape < 10; ++shape) {
        std::vector<double> held(glued.face().shape_count(), 0.0);
        for (std::size_t i = shape; i < shape + 4; ++i) held[i] = 0.7;
        begin_neutral(*glued.state);
        for (int i = 0; i < 60; ++i) glued.tick(held);
        refused += glued.report.phase == NeutralPhase::kRefused ? 1 : 0;
        if (glued.report.phase == NeutralPhase::kRefused) {
            EXPECT_TRUE(glued.report.refusal == NeutralRefusal::kExpression ||
                        glued.report.refusal == NeutralRefusal::kOffset);
        }
        reset_neutral(*glued.state);
    }
    EXPECT_EQ(refused, 10);
}

TEST(NeutralCapture, RefusesOffsetsThatNoGlueMakes) {
    GluedFace glued(0.3);
    glued.aside[17] = Vec3{0.0, 0.0, 9.0};
    begin_neutral(*glued.state);
    glued.rest(60);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kRefused);
    EXPECT_EQ(glued.report.refusal, NeutralRefusal::kOffset);
    EXPECT_EQ(glued.report.marker, 17);
    EXPECT_GT(glued.report.value, 5.0);
    EXPECT_FALSE(glued.state->any);
}

TEST(NeutralCapture, RefusesWhenTooLittleIsSeen) {
    GluedFace glued(1.0);
    std::vector<bool> hidden(glued.face().marker_count(), false);
    for (std::size_t k = 0; k < 6; ++k) hidden[10 * k] = true;
    begin_neutral(*glued.state);
    glued.rest(60, hidden);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kTaken) << "six of sixty";
    for (std::size_t k = 0; k < 60; ++k)
        EXPECT_EQ(glued.state->offset_mm[k].norm() > 0.0, !hidden[k]) << "an unseen marker learns nothing";
    for (std::size_t k = 0; k < 24; ++k) hidden[k] = true;
    begin_neutral(*glued.state);
    glued.rest(60, hidden);
    ASSERT_EQ(glued.report.phase, NeutralPhase::kRefused);
    EXPECT_EQ(glued.report.refusal, NeutralRefusal::kUnseen);
    begin_neutral(*glued.state);
    for (int i = 0; i < 179; ++i) {
        glued.blank_tick();
        ASSERT_EQ(glued.report.phase, NeutralPhase::kCollecting);
    }
    glued.blank_tick();
    EXPECT_EQ(glued.report.phase, NeutralPhase::kRefused);
    EXPECT_EQ(glued.report.refusal, NeutralRefusal::kUnseen);
    EXPECT_EQ(glued.report.value, 0.0);
}

// Four markers at the origin, and a second of what one tells of them.
struct FourMarkers {
    FourMarkers() {
        model.marker_count = 4;
        stabilised.count = 4;
        begin_neutral(state);
    }
    void see(std::size_t k, const Vec3& at_mm, const Mat3& information) {
        stabilised.markers[k].seen = true;
        stabilised.markers[k].position_mm = at_mm;
        stabilised.markers[k].information = information;
    }
    void watch() { watch_neutral(model, neutral, 0.1, {}, &stabilised, state, report); }

    ShapeModel model;
    std::vector<float> neutral = std::vector<float>(12, 0.0F);
    StabiliserOutput stabilised;
    NeutralState state;
    NeutralReport report;
};

// One camera knows nothing of the depth, so nothing is learnt along its ray.
TEST(NeutralCapture, LearnsNothingWhereNothingWasMeasured) {
    const auto face = std::make_unique<FourMarkers>();
    for (std::size_t k = 0; k < 4; ++k)
        face->see(k, Vec3{0.5, -0.25, 1.0}, Vec3{100.0, 100.0, 0.0}.asDiagonal());
    for (int i = 0; i < 60; ++i) face->watch();
    ASSERT_EQ(face->report.phase, NeutralPhase::kTaken);
    const double learnt = 100.0 / 100.2;  // a thousandth of all that is known pulls to zero
    EXPECT_NEAR(face->state.offset_mm[2][0], 0.5 * learnt, 1e-9);
    EXPECT_NEAR(face->state.offset_mm[2][1], -0.25 * learnt, 1e-9);
    EXPECT_NEAR(face->state.offset_mm[2][2], 0.0, 1e-9);
}

// A face that breathes turns under its rays: a milliradian of that is no knowledge of depth.
TEST(NeutralCapture, RaysThatTurnALittleTeachNoDepth) {
    test::SeededRandom random(5);
    for (const double tilt_rad : {1e-4, 1e-3, 3e-3}) {
        const auto face = std::make_unique<FourMarkers>();
        for (int i = 0; i < 60; ++i) {
            for (std::size_t k = 0; k < 4; ++k) {
                const Vec3 ray =
                    Vec3{random.normal(0.0, tilt_rad), random.normal(0.0, tilt_rad), 1.0}.normalized();
                const Vec3 noise{random.normal(0.0, 0.1), random.normal(0.0, 0.1), 0.0};
                face->see(k, noise - noise.dot(ray) * ray,
                          100.0 * (Mat3::Identity() - ray * ray.transpose()));
            }
            face->watch();
        }
        ASSERT_EQ(face->report.phase, NeutralPhase::kTaken) << tilt_rad;
        for (std::size_t k = 0; k < 4; ++k) {
            EXPECT_LT(std::abs(face->state.offset_mm[k][2]), 0.2) << tilt_rad;
        }
    }
}

}  // namespace
}  // namespace rig
