#include "core/filter/savitzky_golay.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SeededRandom;

constexpr std::int64_t kFrameUs = 16667;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Least squares by the normal equations in long double, solved by Gaussian elimination with pivoting: no
// orthogonal polynomials, no centring.
long double least_squares(const std::vector<long double>& u, const std::vector<long double>& x,
                          long double at) {
    const std::size_t terms = std::min<std::size_t>(3, u.size());
    std::array<std::array<long double, 4>, 3> a{};
    for (std::size_t k = 0; k < u.size(); ++k) {
        const std::array<long double, 3> power{1.0L, u[k], u[k] * u[k]};
        for (std::size_t r = 0; r < terms; ++r) {
            for (std::size_t c = 0; c < terms; ++c) a[r][c] += power[r] * power[c];
            a[r][3] += power[r] * x[k];
        }
    }
    for (std::size_t p = 0; p < terms; ++p) {
        std::size_t largest = p;
        for (std::size_t r = p + 1; r < terms; ++r) {
            if (std::fabs(a[r][p]) > std::fabs(a[largest][p])) largest = r;
        }
        std::swap(a[p], a[largest]);
        for (std::size_t r = 0; r < terms; ++r) {
            if (r == p) continue;
            const long double factor = a[r][p] / a[p][p];
            for (std::size_t c = 0; c < 4; ++c) a[r][c] -= factor * a[p][c];
        }
    }
    long double sum = 0.0L;
    long double power = 1.0L;
    for (std::size_t p = 0; p < terms; ++p, power *= at) sum += a[p][3] / a[p][p] * power;
    return sum;
}

// One filter over `shapes` shapes with the same or different windows, and everything it was given.
class Bench {
  public:
    Bench(std::vector<std::uint8_t> windows, std::uint16_t delay, float low = -10.0F, float high = 10.0F)
        : windows_(std::move(windows)), low_(windows_.size(), low), high_(windows_.size(), high) {
        config_.delay_frames = delay;
        config_.window_frames = windows_;
        config_.low = low_;
        config_.high = high_;
    }
    std::vector<double> run(const std::vector<double>& x, std::int64_t at_us) {
        std::vector<double> out(x.size());
        filter_savitzky_golay(config_, x, at_us, *state_, out, report);
        return out;
    }
    [[nodiscard]] const SavitzkyGolayConfig& config() const { return config_; }
    SavitzkyGolayReport report;

  private:
    std::vector<std::uint8_t> windows_;
    std::vector<float> low_, high_;
    SavitzkyGolayConfig config_;
    std::unique_ptr<SavitzkyGolayState> state_ = std::make_unique<SavitzkyGolayState>();
};

TEST(SavitzkyGolay, HasThePublishedCoefficients) {
    // Savitzky and Golay 1964, table I: quadratic, 5 and 7 points, the middle.
    const std::array<double, 5> five{-3, 12, 17, 12, -3};
    const std::array<double, 7> seven{-2, 3, 6, 7, 6, 3, -2};
    std::array<double, 7> u{0, 1, 2, 3, 4, 5, 6};
    std::array<double, 7> c{};
    savitzky_golay_coefficients(std::span(u).first(5), 2.0, std::span(c).first(5));
    for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(c[k], five[k] / 35.0, 1e-15);
    savitzky_golay_coefficients(u, 3.0, c);
    for (std::size_t k = 0; k < 7; ++k) EXPECT_NEAR(c[k], seven[k] / 21.0, 1e-15);
}

// Every window and a spread of delays, irregular times: against the long double fit of the same window.
TEST(SavitzkyGolay, EqualsLongDoubleLeastSquares) {
    SeededRandom random(11);
    for (int window = 3; window <= static_cast<int>(kMaxWindowFrames); ++window) {
        for (const int delay : {0, 1, window / 2, window - 1}) {
            Bench bench({static_cast<std::uint8_t>(window)}, static_cast<std::uint16_t>(delay));
            std::vector<long double> times;
            std::vector<long double> values;
            std::int64_t now_us = 1'000'000'000;
            for (int frame = 0; frame < window + 6; ++frame) {
                now_us += static_cast<std::int64_t>(random.uniform(5000.0, 60000.0));
                times.push_back(static_cast<long double>(now_us) * 1e-6L);
                values.push_back(random.uniform(-1.0, 1.0));
                const double got = bench.run({static_cast<double>(values.back())}, now_us)[0];
                ASSERT_FALSE(bench.report.restarted);
                const auto have = static_cast<int>(values.size());
                const int points = std::min(window, have);
                const int age = std::min(delay, have - 1);
                std::vector<long double> u;
                std::vector<long double> x;
                for (int k = have - points; k < have; ++k) {
                    u.push_back((times[static_cast<std::size_t>(k)] - times.back()) * 60.0L);
                    x.push_back(values[static_cast<std::size_t>(k)]);
                }
                const long double at = u[static_cast<std::size_t>(points - 1 - age)];
                ASSERT_NEAR(got, static_cast<double>(least_squares(u, x, at)), 1e-11)
                    << "window " << window << " delay " << delay << " frame " << frame;
                ASSERT_EQ(bench.report.delay_frames, age);
                ASSERT_EQ(bench.report.warm, have >= window);
            }
        }
    }
}

TEST(SavitzkyGolay, IsExactOnQuadraticsInTrueTime) {
    SeededRandom random(12);
    for (const int window : {3, 4, 15, 16, 60, 61}) {
        for (const int delay : {0, 2, window - 1}) {
            Bench bench({static_cast<std::uint8_t>(window)}, static_cast<std::uint16_t>(delay));
            std::vector<double> values;
            std::vector<std::int64_t> at_us;
            std::int64_t now_us = -50'000'000;
            for (int frame = 0; frame < 200; ++frame) {
                now_us += static_cast<std::int64_t>(random.uniform(4200.0, 66000.0));
                const double t = static_cast<double>(now_us) * 1e-6 + 48.0;
                values.push_back(0.3 - 0.2 * t + 0.05 * t * t);
                at_us.push_back(now_us);
                const double got = bench.run({values.back()}, now_us)[0];
                const auto age = static_cast<std::size_t>(std::min(delay, frame));
                const std::size_t answered = values.size() - 1 - age;
                ASSERT_NEAR(got, values[answered], 2e-12) << window << " " << delay << " " << frame;
                ASSERT_EQ(bench.report.answered_us, at_us[answered]);
                ASSERT_EQ(bench.report.delay_us, now_us - at_us[answered]);
            }
        }
    }
}

TEST(SavitzkyGolay, WarmsUpAtTheFirstFrameWithoutGoingBackInTime) {
    Bench bench({15}, 7);
    EXPECT_EQ(bench.run({0.25}, 0), std::vector<double>{0.25});
    std::int64_t last_us = 0;
    for (int frame = 1; frame < 30; ++frame) {
        bench.run({0.25}, frame * kFrameUs);
        EXPECT_EQ(bench.report.delay_frames, std::min(frame, 7));
        EXPECT_GE(bench.report.answered_us, last_us);
        EXPECT_EQ(bench.report.warm, frame >= 14);
        last_us = bench.report.answered_us;
    }
    EXPECT_EQ(bench.report.delay_us, 7 * kFrameUs);
}

TEST(SavitzkyGolay, StartsAnewBehindAHole) {
    Bench bench({9}, 4);
    for (int frame = 0; frame < 20; ++frame) bench.run({0.1}, frame * kFrameUs);
    // 2 frames lost: still one movement, and a quadratic stays a quadratic.
    bench.run({0.1}, 22 * kFrameUs);
    EXPECT_FALSE(bench.report.restarted);
    for (const std::int64_t at :
         {std::int64_t{28} * kFrameUs, std::int64_t{28} * kFrameUs, std::int64_t{5},
          std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
        EXPECT_EQ(bench.run({0.9}, at), std::vector<double>{0.9}) << at;
        EXPECT_TRUE(bench.report.restarted) << at;
        EXPECT_EQ(bench.report.delay_frames, 0);
        EXPECT_EQ(bench.report.answered_us, at);
    }
}

TEST(SavitzkyGolay, EachShapeHasItsWindowAndAllHaveOneDelay) {
    SeededRandom random(13);
    Bench all({1, 5, 61, 5}, 3);
    Bench five({5}, 3);
    Bench longest({61}, 3);
    std::vector<double> first;
    for (int frame = 0; frame < 100; ++frame) {
        const double x = random.uniform(0.0, 1.0);
        first.push_back(x);
        const std::int64_t at = frame * kFrameUs;
        const std::vector<double> got = all.run({x, x, x, x}, at);
        EXPECT_EQ(got[0], first[static_cast<std::size_t>(std::max(0, frame - 3))]);
        EXPECT_EQ(got[1], five.run({x}, at)[0]);
        EXPECT_EQ(got[2], longest.run({x}, at)[0]);
        EXPECT_EQ(got[3], got[1]);
        EXPECT_EQ(all.report.warm, frame >= 60);
    }
}

TEST(SavitzkyGolay, CalmsNoiseByTheShareThatTheTheoryGives) {
    // The variance of the answer is the coefficient of its own sample: for n = 15 in the middle 167 / 1105,
    // at the newest 3 (3 n^2 - 3 n + 2) / (n (n + 1) (n + 2)).
    SeededRandom random(14);
    for (const auto& [delay, share] : {std::pair{7, 167.0 / 1105.0}, std::pair{0, 1896.0 / 4080.0}}) {
        Bench bench({15}, static_cast<std::uint16_t>(delay));
        double in = 0.0;
        double out = 0.0;
        for (int frame = 0; frame < 40000; ++frame) {
            const double x = random.normal(0.0, 0.01);
            const double y = bench.run({x}, frame * kFrameUs)[0];
            in += x * x;
            out += y * y;
        }
        EXPECT_NEAR(out / in, share, 0.03 * share) << delay;
    }
}

TEST(SavitzkyGolay, RefusesWhatIsNotANumber) {
    Bench bench({5}, 0, 0.0F, 1.0F);
    EXPECT_EQ(bench.run({kNan}, 0), std::vector<double>{0.0});
    EXPECT_EQ(bench.report.inputs_refused, 1);
    for (int frame = 1; frame < 10; ++frame) bench.run({0.5}, frame * kFrameUs);
    EXPECT_NEAR(bench.run({-std::numeric_limits<double>::infinity()}, 10 * kFrameUs)[0], 0.5, 1e-12);
    EXPECT_EQ(bench.report.inputs_refused, 1);
}

TEST(SavitzkyGolay, NeverLeavesTheRanges) {
    SeededRandom random(15);
    const std::array wild{kNan, 1e300, -1e300, 1e-320,
                          0.0,  1.0,   -1.0,   std::numeric_limits<double>::infinity()};
    for (const std::uint16_t delay : {0, 3}) {
        Bench bench({5, 17, 1, 61}, delay, 0.0F, 0.7F);
        std::int64_t now_us = 0;
        bool touched = false;
        for (int frame = 0; frame < 20000; ++frame) {
            now_us += static_cast<std::int64_t>(random.uniform(-20000.0, 80000.0));
            std::vector<double> x(4);
            for (double& each : x) {
                each = random.chance(0.1) ? wild[random.below(wild.size())] : random.uniform(-0.5, 1.5);
            }
            for (const double y : bench.run(x, now_us)) {
                ASSERT_TRUE(y >= 0.0 && y <= static_cast<double>(0.7F)) << frame;
                touched = touched || y == static_cast<double>(0.7F);
            }
        }
        EXPECT_TRUE(touched);
    }
}

TEST(SavitzkyGolay, RefusesSettingsOutsideTheirRanges) {
    EXPECT_TRUE(is_valid(Bench({3}, 2).config()));
    EXPECT_TRUE(is_valid(Bench({1, 61}, 60).config()));
    EXPECT_FALSE(is_valid(Bench({3}, 3).config()));
    EXPECT_FALSE(is_valid(Bench({0}, 0).config()));
    EXPECT_FALSE(is_valid(Bench({62}, 0).config()));
    EXPECT_FALSE(is_valid(Bench({1}, 61).config()));
    SavitzkyGolayConfig rate = Bench({5}, 0).config();
    rate.window_frames = {};
    rate.low = {};
    rate.high = {};
    EXPECT_TRUE(is_valid(rate));
    rate.rate_hz = kNan;
    EXPECT_FALSE(is_valid(rate));
}

TEST(SavitzkyGolay, ResetForgets) {
    const std::array<std::uint8_t, 1> window{5};
    const std::array<float, 1> low{0.0F};
    const std::array<float, 1> high{1.0F};
    const SavitzkyGolayConfig config{60.0, 2, window, low, high};
    const auto state = std::make_unique<SavitzkyGolayState>();
    SavitzkyGolayReport report;
    std::array<double, 1> x{0.4};
    for (int frame = 0; frame < 9; ++frame)
        filter_savitzky_golay(config, x, frame * kFrameUs, *state, x, report);
    reset_savitzky_golay(*state);
    x = {0.9};
    filter_savitzky_golay(config, x, 9 * kFrameUs, *state, x, report);
    EXPECT_EQ(x[0], 0.9);
    EXPECT_FALSE(report.restarted);
    EXPECT_EQ(report.delay_frames, 0);
}

}  // namespace
}  // namespace rig
