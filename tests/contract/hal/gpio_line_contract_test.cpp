// The contract of hal/gpio_line.hpp, on every backend.
#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "hal/sim/manual_clock.hpp"
#include "hal/sim/memory_line.hpp"
#include "hal/sim/world_client.hpp"
#include "tests/contract/hal/fake_world.hpp"

namespace rig::test {
namespace {

class LineBench {
  public:
    virtual ~LineBench() = default;
    [[nodiscard]] virtual GpioLine& input() = 0;
    [[nodiscard]] virtual GpioLine& output() = 0;
    [[nodiscard]] virtual Clock& clock() = 0;
    virtual void drive(bool active, std::int64_t time_us) = 0;
    [[nodiscard]] virtual bool output_level() = 0;  // as the other end sees it after a change
    virtual void unplug() = 0;
};

class MemoryBench final : public LineBench {
  public:
    GpioLine& input() override { return input_; }
    GpioLine& output() override { return output_; }
    Clock& clock() override { return clock_; }
    void drive(bool active, std::int64_t time_us) override {
        clock_.advance_to_us(time_us);
        input_.drive(active);
    }
    bool output_level() override { return output_.level(); }
    void unplug() override {
        input_.unplug();
        output_.unplug();
    }

  private:
    sim::ManualClock clock_;
    sim::MemoryLine input_{clock_, sim::LineDirection::kInput};
    sim::MemoryLine output_{clock_, sim::LineDirection::kOutput};
};

class WorldBench final : public LineBench {
  public:
    WorldBench() : world_(sim::WorldPace::kLockstep) {
        std::thread greeter([this] { world_.accept_and_greet(); });
        client_ = std::move(*sim::WorldClient::connect(world_.path()));
        greeter.join();
    }
    GpioLine& input() override { return client_->line(sim::WorldLine::kButtonNeutral); }
    GpioLine& output() override { return client_->line(sim::WorldLine::kLed); }
    Clock& clock() override { return client_->clock(); }
    void drive(bool active, std::int64_t time_us) override {
        world_.send(line_edge(sim::WorldLine::kButtonNeutral, active, time_us));
        // Time goes on past it, so that whoever waits comes to an end.
        world_.send(plain(sim::WorldMessageKind::kAdvance, time_us + 1));
        client_->clock().sleep_until_us(time_us + 1);
    }
    bool output_level() override {
        sim::WorldMessage message;
        EXPECT_TRUE(world_.receive(message));
        EXPECT_EQ(message.kind, sim::WorldMessageKind::kSetLine);
        EXPECT_EQ(message.camera_or_line, static_cast<std::uint8_t>(sim::WorldLine::kLed));
        return message.active == 1;
    }
    void unplug() override {
        world_.hang_up();
        client_->clock().sleep_until_us(client_->clock().now_us() + 1);
    }

  private:
    FakeWorld world_;
    std::unique_ptr<sim::WorldClient> client_;
};

struct LineBackend {
    const char* name;
    std::unique_ptr<LineBench> (*make)();
};

class GpioLineContract : public testing::TestWithParam<LineBackend> {
  protected:
    std::unique_ptr<LineBench> bench_ = GetParam().make();
};

TEST_P(GpioLineContract, EdgesComeInOrderAndOnce) {
    bench_->drive(true, 1000);
    bench_->drive(false, 2000);
    bench_->drive(true, 3000);
    for (int i = 0; i < 3; ++i) {
        const auto edge = bench_->input().wait_edge(bench_->clock().now_us());
        ASSERT_TRUE(edge.has_value());
        EXPECT_EQ(edge->rising, i != 1);
        EXPECT_EQ(edge->time_us, 1000 * (i + 1));
    }
    EXPECT_EQ(bench_->input().wait_edge(bench_->clock().now_us()).error(), GpioError::kTimeout);
    EXPECT_TRUE(bench_->input().get().value());
}

TEST_P(GpioLineContract, ALevelThatIsThereIsNoEdge) {
    bench_->drive(false, 500);
    EXPECT_EQ(bench_->input().wait_edge(bench_->clock().now_us()).error(), GpioError::kTimeout);
    bench_->drive(true, 1000);
    bench_->drive(true, 1500);
    EXPECT_TRUE(bench_->input().wait_edge(bench_->clock().now_us()).has_value());
    EXPECT_EQ(bench_->input().wait_edge(bench_->clock().now_us()).error(), GpioError::kTimeout);
}

TEST_P(GpioLineContract, OutputsAreSetAndRead) {
    EXPECT_FALSE(bench_->output().get().value());
    ASSERT_TRUE(bench_->output().set(true));
    EXPECT_TRUE(bench_->output_level());
    EXPECT_TRUE(bench_->output().get().value());
    ASSERT_TRUE(bench_->output().set(false));
    EXPECT_FALSE(bench_->output_level());
}

TEST_P(GpioLineContract, DirectionsAreKept) {
    EXPECT_EQ(bench_->input().set(true).error(), GpioError::kWrongDirection);
    EXPECT_EQ(bench_->output().wait_edge(bench_->clock().now_us()).error(), GpioError::kWrongDirection);
}

TEST_P(GpioLineContract, GoneIsSaid) {
    bench_->unplug();
    EXPECT_EQ(bench_->input().get().error(), GpioError::kGone);
    EXPECT_EQ(bench_->input().wait_edge(bench_->clock().now_us() + 1).error(), GpioError::kGone);
    EXPECT_EQ(bench_->output().set(true).error(), GpioError::kGone);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, GpioLineContract,
    testing::Values(
        LineBackend{"Memory", []() -> std::unique_ptr<LineBench> { return std::make_unique<MemoryBench>(); }},
        LineBackend{"World", []() -> std::unique_ptr<LineBench> { return std::make_unique<WorldBench>(); }}),
    [](const auto& backend) { return std::string(backend.param.name); });

}  // namespace
}  // namespace rig::test
