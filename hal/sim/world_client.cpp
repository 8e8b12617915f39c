#include "hal/sim/world_client.hpp"

#include <algorithm>
#include <utility>

#include "core/base/check.hpp"
#include "hal/sim/world_connection.hpp"

namespace rig::sim {

namespace {

constexpr std::int32_t kShortestExposure_us = 10;
constexpr float kLargestGain_db = 48.0F;
constexpr std::int64_t kMicrosMillisPerSecond = 1'000'000'000;  // microseconds of a period at one millihertz

bool is_output(WorldLine line) {
    return line == WorldLine::kLed || line == WorldLine::kStrobe;
}

}  // namespace

class WorldClient::WorldClock final : public Clock {
  public:
    explicit WorldClock(Connection& connection) : connection_(connection) {}
    [[nodiscard]] std::int64_t now_us() const override { return connection_.now_us(); }
    void sleep_until_us(std::int64_t deadline_us) override { connection_.sleep_until_us(deadline_us); }
    void interrupt() override { connection_.interrupt(); }

  private:
    Connection& connection_;
};

class WorldClient::WorldCamera final : public FrameSource {
  public:
    WorldCamera(Connection& connection, std::size_t index) : connection_(connection), index_(index) {}

    [[nodiscard]] Result<FrameFormat, FrameError> start() override {
        const Connection::Lock held = connection_.lock();
        if (connection_.is_down()) return failure(FrameError::kGone);
        reset(held);
        connection_.ledger().listen(index_, true);
        started_ = true;
        const WorldHello& hello = connection_.hello();
        return FrameFormat{hello.width_px, hello.height_px, hello.rate_millihertz / 1000.0};
    }

    void stop() override { reset(connection_.lock()); }

    [[nodiscard]] Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) override {
        Connection::Lock held = connection_.lock();
        if (!started_) return failure(FrameError::kNotStarted);
        WorldLedger& ledger = connection_.ledger();
        while (!ledger.has_frame(index_)) {
            if (connection_.is_down()) return failure(FrameError::kGone);
            if (ledger.ended()) return failure(FrameError::kEnded);
            const Connection::Wake wake = connection_.wait_message(held, deadline_us);
            connection_.send_freed_slots(held);
            const bool arrived = ledger.has_frame(index_) || connection_.is_down() || ledger.ended();
            if (wake != Connection::Wake::kMessage && !arrived) return failure(FrameError::kTimeout);
        }
        const QueuedFrame queued = ledger.take_frame(index_);
        const WorldHello& hello = connection_.hello();
        CameraFrame frame;
        frame.image = {connection_.image(queued.slot, index_), hello.width_px, hello.height_px,
                       hello.width_px};
        frame.capture_us = queued.capture_us;
        frame.sequence = queued.sequence;
        frame.token = queued.slot;
        return frame;
    }

    void release(std::uint32_t token) override {
        const Connection::Lock held = connection_.lock();
        if (!started_) return;  // stop() has given everything back
        const bool was_held = connection_.ledger().release(index_, token);
        RIG_CHECK(was_held);
        connection_.send_freed_slots(held);
    }

    [[nodiscard]] int borrow_limit() const override {
        return std::max(1, static_cast<int>(connection_.hello().slot_count) - 1);
    }

    [[nodiscard]] Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) override {
        const std::int64_t period_us = kMicrosMillisPerSecond / connection_.hello().rate_millihertz;
        const bool possible = exposure_us >= kShortestExposure_us && exposure_us <= period_us;
        return possible ? control(WorldMessageKind::kExposure, static_cast<float>(exposure_us))
                        : failure(FrameError::kRefused);
    }

    [[nodiscard]] Result<void, FrameError> set_gain_db(float gain_db) override {
        const bool possible = gain_db >= 0.0F && gain_db <= kLargestGain_db;
        return possible ? control(WorldMessageKind::kGain, gain_db) : failure(FrameError::kRefused);
    }

  private:
    void reset(const Connection::Lock& held) {
        started_ = false;
        connection_.ledger().listen(index_, false);
        connection_.send_freed_slots(held);
    }

    Result<void, FrameError> control(WorldMessageKind kind, float value) {
        const Connection::Lock held = connection_.lock();
        WorldMessage message;
        message.kind = kind;
        message.camera_or_line = static_cast<std::uint8_t>(index_);
        message.value = value;
        connection_.send(message, held);
        if (connection_.is_down()) return failure(FrameError::kGone);
        return {};
    }

    Connection& connection_;
    std::size_t index_;
    bool started_ = false;
};

class WorldClient::WorldGpio final : public GpioLine {
  public:
    WorldGpio(Connection& connection, WorldLine line) : connection_(connection), line_(line) {}

    [[nodiscard]] Result<bool, GpioError> get() override {
        const Connection::Lock held = connection_.lock();
        if (connection_.is_down()) return failure(GpioError::kGone);
        return is_output(line_) ? output_active_ : connection_.ledger().line_active(number());
    }

    [[nodiscard]] Result<void, GpioError> set(bool active) override {
        if (!is_output(line_)) return failure(GpioError::kWrongDirection);
        const Connection::Lock held = connection_.lock();
        WorldMessage message;
        message.kind = WorldMessageKind::kSetLine;
        message.camera_or_line = static_cast<std::uint8_t>(line_);
        message.active = active ? 1 : 0;
        connection_.send(message, held);
        if (connection_.is_down()) return failure(GpioError::kGone);
        output_active_ = active;
        return {};
    }

    [[nodiscard]] Result<EdgeEvent, GpioError> wait_edge(std::int64_t deadline_us) override {
        if (is_output(line_)) return failure(GpioError::kWrongDirection);
        Connection::Lock held = connection_.lock();
        WorldLedger& ledger = connection_.ledger();
        while (!ledger.has_edge(number())) {
            if (connection_.is_down() || ledger.ended()) return failure(GpioError::kGone);
            const Connection::Wake wake = connection_.wait_message(held, deadline_us);
            connection_.send_freed_slots(held);
            if (wake != Connection::Wake::kMessage && !ledger.has_edge(number()))
                return failure(GpioError::kTimeout);
        }
        return ledger.take_edge(number());
    }

  private:
    [[nodiscard]] std::size_t number() const { return static_cast<std::size_t>(line_); }

    Connection& connection_;
    WorldLine line_;
    bool output_active_ = false;
};

WorldClient::WorldClient() = default;
WorldClient::~WorldClient() = default;

Result<std::unique_ptr<WorldClient>, WorldError> WorldClient::connect(const std::string& socket_path,
                                                                      WorldPatience patience) {
    auto connection = Connection::connect(socket_path, patience);
    if (!connection) return failure(connection.error());
    std::unique_ptr<WorldClient> client(new WorldClient);
    client->connection_ = std::move(*connection);
    client->clock_ = std::make_unique<WorldClock>(*client->connection_);
    for (std::size_t c = 0; c < client->hello().camera_count; ++c) {
        client->cameras_[c] = std::make_unique<WorldCamera>(*client->connection_, c);
    }
    for (std::size_t l = 0; l < kWorldLineCount; ++l) {
        client->lines_[l] = std::make_unique<WorldGpio>(*client->connection_, static_cast<WorldLine>(l));
    }
    return client;
}

const WorldHello& WorldClient::hello() const {
    return connection_->hello();
}

Clock& WorldClient::clock() {
    return *clock_;
}

FrameSource& WorldClient::camera(std::size_t camera) {
    RIG_CHECK(camera < hello().camera_count);
    return *cameras_[camera];
}

GpioLine& WorldClient::line(WorldLine line) {
    return *lines_[static_cast<std::size_t>(line)];
}

void WorldClient::tick_done() {
    const Connection::Lock held = connection_->lock();
    WorldLedger& ledger = connection_->ledger();
    if (!ledger.tick_outstanding()) return;
    WorldMessage message;
    message.kind = WorldMessageKind::kTickDone;
    message.sequence = ledger.tick_sequence();
    ledger.finish_tick();
    connection_->send_freed_slots(held);
    connection_->send(message, held);
}

bool WorldClient::ended() const {
    const Connection::Lock held = connection_->lock();
    return connection_->ledger().ended();
}

const char* WorldClient::fault() const {
    return connection_->fault();
}

std::uint64_t WorldClient::dropped_frames() const {
    const Connection::Lock held = connection_->lock();
    return connection_->ledger().dropped_frames();
}

}  // namespace rig::sim
