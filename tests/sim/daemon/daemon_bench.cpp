#include "tests/sim/daemon/daemon_bench.hpp"

#include <algorithm>

#include "tests/sim/daemon/painted_take.hpp"

namespace rig::test {

void TestHost::read(std::size_t limit) {
    std::array<std::byte, 4096> bytes{};
    while (limit > 0) {
        const auto got = link_.read(MutableByteSpan(bytes).first(std::min(limit, bytes.size())));
        if (!got) static_cast<void>(link_.open());  // the cable was out
        if (!got || *got == 0) return;
        limit -= *got;
        ByteSpan chunk = ByteSpan(bytes).first(*got);
        FrameView frame;
        while (decoder_.next(chunk, frame)) {
            frames.emplace_back(frame.head,
                                std::vector<std::byte>(frame.payload.begin(), frame.payload.end()));
            if (frame.head.type != MessageType::kWeights) continue;
            const auto part = decode_weights(frame.payload);
            if (part && assembler_.push(*part)) states.push_back(assembler_.state());
        }
    }
}

void TestHost::send_bytes(ByteSpan bytes) {
    static_cast<void>(link_.write(bytes));
}

void TestHost::send(MessageType type, ByteSpan payload) {
    std::array<std::byte, kMaxWireFrameBytes> frame{};
    FrameHead head;
    head.type = type;
    head.sequence = sequence_++;
    send_bytes(ByteSpan(frame).first(encode_frame(head, payload, frame).value()));
}

std::size_t TestHost::count(MessageType type) const {
    return static_cast<std::size_t>(std::count_if(
        frames.begin(), frames.end(), [&](const auto& frame) { return frame.first.type == type; }));
}

const std::vector<std::byte>* TestHost::last(MessageType type) const {
    for (auto frame = frames.rbegin(); frame != frames.rend(); ++frame) {
        if (frame->first.type == type) return &frame->second;
    }
    return nullptr;
}

Health TestHost::last_status() const {
    const auto* payload = last(MessageType::kStatus);
    return payload == nullptr ? Health{} : decode_status(*payload).value_or(Health{});
}

void DaemonBench::BenchPace::tick_done() {
    ++ticks;
    bench_.wall.pass(1'000'000 / 60);
    bench_.host_acts(bench_);
    if (bench_.before_tick) bench_.before_tick(bench_, ticks);
}

DaemonBench::DaemonBench(BenchOptions options)
    : pair(options.link_capacity, sim::LoopbackKind::kStream),
      host(pair.far_end()),
      button(clock, sim::LineDirection::kInput),
      led(clock, sim::LineDirection::kOutput),
      watchdog(clock, 1'000'000),
      options_(std::move(options)),
      link_(pair.near_end(), clock, options_.faults, 0),
      pipeline_(std::make_unique<Pipeline>()),
      pace_(*this) {
    const PaintedTake& take = *options_.take;
    wall.on_wait = [this] { host_acts(*this); };
    AppParts parts{clock, wall, {}, link_, watchdog, pace_, &button, &led, *pipeline_, nullptr, nullptr};
    for (std::size_t c = 0; c < 2; ++c) {
        sim::FramePacing pacing;
        pacing.rate_hz = kTakeRate_hz;
        pacing.frame_total = options_.frames;
        cameras_.push_back(std::make_unique<sim::SyntheticFrameSource>(
            clock, take.width_px(), take.height_px(), take.painter(c), pacing));
        FrameSource* camera = cameras_[c].get();
        if (options_.lamp) {
            lit_.push_back(std::make_unique<LampSource>(*camera, options_.lamp));
            camera = lit_.back().get();
        }
        faulty_.push_back(std::make_unique<sim::FaultyFrameSource>(*camera, clock, options_.faults,
                                                                   static_cast<std::uint8_t>(c)));
        parts.cameras.push_back(faulty_[c].get());
    }
    AppConfig config;
    config.rate_hz = kTakeRate_hz;
    config.feed.frozen_frames = options_.frozen_frames;
    config.exposure = options_.exposure;
    if (options_.streams_by_itself) config.identity.first_streams.mask = kAllStreams;
    config.identity.hello.role = Role::kBoard;
    config.identity.hello.session_id = 77;
    if (options_.with_pack) {
        PipelineConfig pipeline;
        pipeline.rate_hz = kTakeRate_hz;
        pipeline.smoothing = options_.smoothing;
        RIG_CHECK(pipeline_->configure(take.pack(), pipeline).has_value());
        parts.pack = &take.pack();
        config.identity.hello.shape_count = take.pack().shape_count;
        config.identity.hello.marker_count = take.pack().marker_count;
        config.identity.shape_names = std::span(take.pack().shape_names).first(take.pack().shape_count);
        config.identity.marker_names = std::span(take.pack().marker_names).first(take.pack().marker_count);
    }
    if (!options_.log_path.empty()) {
        ObservationLogHeader header;
        header.camera_count = 2;
        header.rate_millihertz = 60'000;
        header.smoothing = options_.smoothing;
        log_ = std::move(*ObservationLogWriter::create(options_.log_path, header));
        parts.log = log_.get();
    }
    RIG_CHECK(link_.open().has_value());
    app_ = std::make_unique<App>(parts, config);
    app_->open_cameras();
}

AppEnd DaemonBench::run() {
    if (before_tick) before_tick(*this, 0);
    const AppEnd end = app_->run_lockstep(stop, [] {}, [] {});
    host.read();
    return end;
}

}  // namespace rig::test
