#include "firmware_host/companion/demo/demo_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <system_error>
#include <thread>

#include "firmware_host/companion/demo/child_process.hpp"
#include "firmware_host/companion/demo/pictures.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/links/host_session.hpp"
#include "firmware_host/companion/links/link_spec.hpp"
#include "firmware_host/companion/replay/replay_log.hpp"
#include "firmware_host/companion/train/camera_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "firmware_host/take_log/stream_digest.hpp"

namespace rig::host {

namespace {

constexpr std::int64_t kLinkTimeoutUs = 10'000'000;  // for the daemon to make its serial line
constexpr std::int64_t kDrainUs = 2'000'000;         // for the last frames after the daemon has ended
constexpr std::int64_t kStallUs = 30'000'000;        // without any frame: something hangs
constexpr std::size_t kCurves = 12;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::int64_t monotonic_us() {
    using namespace std::chrono;
    return duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

// When each frame set was handed to the daemon; filled by the world's thread.
class HandOver {
  public:
    explicit HandOver(std::size_t frames) : at_us_(frames, 0) {}
    void mark(std::uint64_t frame) {
        const std::lock_guard lock(mutex_);
        if (frame < at_us_.size()) at_us_[frame] = monotonic_us();
        handed_ = std::max(handed_, frame + 1);
    }
    [[nodiscard]] std::int64_t at(std::size_t frame) const {
        const std::lock_guard lock(mutex_);
        return at_us_[frame];
    }
    [[nodiscard]] std::uint64_t handed() const {
        const std::lock_guard lock(mutex_);
        return handed_;
    }

  private:
    mutable std::mutex mutex_;
    std::vector<std::int64_t> at_us_;
    std::uint64_t handed_ = 0;
};

// Everything that a run is made of, loaded and trained.
struct Stage {
    Rig rig;
    MarkerLayout layout;
    Take take;
    MarkerModel model;
    std::unique_ptr<World> world;
};

Result<Stage, FileError> load_stage(const DemoOptions& options) {
    Stage stage;
    auto rig = load_rig(options.rig_folder);
    if (!rig) return failure(rig.error());
    stage.rig = std::move(*rig);
    auto layout = load_layout(options.rig_folder, options.layout, stage.rig);
    if (!layout) return failure(layout.error());
    stage.layout = std::move(*layout);
    auto take = load_take(options.take_csv, stage.rig);
    if (!take) return failure(take.error());
    stage.take = std::move(*take);
    stage.model = marker_model(stage.rig, stage.layout);
    WorldConfig config;
    config.cameras = default_helmet(options.camera_count);
    config.style = options.style;
    config.slip = options.slip;
    config.seed = options.seed;
    config.start_frame = options.start_frame;
    config.frame_count = static_cast<std::size_t>(std::llround(options.seconds * config.rate_hz));
    const double left =
        static_cast<double>(stage.take.frame_count) - static_cast<double>(options.start_frame);
    const double left_at_rate = left * config.rate_hz / stage.take.rate_hz;
    if (static_cast<double>(config.frame_count) > left_at_rate)
        config.frame_count = 0;  // to the end of the take
    auto world = World::create(stage.rig, stage.layout, stage.take, config);
    if (!world) return failure(world.error());
    stage.world = std::move(*world);
    return stage;
}

// The daemon gets the pack as a person would make it: through the files.
Result<OpenedPack, FileError> make_pack(const DemoOptions& options, const Stage& stage) {
    const auto cameras_json = options.out_folder / "cameras.json";
    const auto saved = save_helmet(cameras_json, stage.world->cameras(), stage.world->config().dot_radius_mm,
                                   options.layout);
    if (!saved) return failure(saved.error());
    TrainOptions training;
    training.solver = options.solver;
    if (options.solver == SolverKind::kRbf) training.takes.push_back(stage.take);
    auto cameras = load_cameras(cameras_json);
    if (!cameras) return failure(cameras.error());
    training.cameras = std::move(*cameras);
    const auto trained = train(stage.rig, stage.layout, training);
    if (!trained) return failure(trained.error());
    PackIdentity identity;
    identity.name = "demo";
    const auto path = options.out_folder / "face.pack";
    if (const auto written = save_pack(path, trained->view(), identity); !written)
        return failure(written.error());
    auto opened = open_pack_file(path);
    if (!opened) return failure(FileError{opened.error().message});
    return std::move(*opened);
}

// What arrives at the host, frame by frame of the world.
class Reception {
  public:
    Reception(const Stage& stage, const HandOver& hand_over, const ServerCounters& served, bool real_time)
        : accuracy(*stage.world, stage.model),
          world_(*stage.world),
          hand_over_(hand_over),
          served_(served),
          real_time_(real_time),
          states_(stage.world->frame_count()),
          have_(stage.world->frame_count(), false) {}

    void take_state(const ReceivedState& received) {
        const auto frame = frame_of(received.state.sequence, received.state.capture_us);
        if (!frame || have_[*frame]) return;
        have_[*frame] = true;
        ++received_;
        last_received_us_ = received.received_us;
        states_[*frame] = received.state;
        accuracy.add_state(*frame, received.state);
        const std::int64_t exposed_us = real_time_ ? received.state.capture_us : hand_over_.at(*frame);
        if (exposed_us > 0 && !received.state.held) {
            latencies_ms_.push_back(static_cast<double>(received.received_us - exposed_us) * 1e-3);
        }
    }
    void take_markers(const MarkerFrame& markers) {
        const auto frame = frame_of(markers.sequence, markers.capture_us);
        if (frame) accuracy.add_markers(*frame, markers);
    }

    [[nodiscard]] std::uint64_t received() const { return received_; }
    [[nodiscard]] std::int64_t last_received_us() const { return last_received_us_; }
    [[nodiscard]] const std::vector<FaceState>& states() const { return states_; }
    [[nodiscard]] bool has(std::size_t frame) const { return have_[frame]; }
    [[nodiscard]] std::uint64_t digest() const {
        StreamDigest digest;
        for (std::size_t f = 0; f < states_.size(); ++f) {
            if (have_[f]) digest.add(states_[f]);
        }
        return digest.value();
    }
    [[nodiscard]] LatencyFigures latency() {
        LatencyFigures figures;
        if (latencies_ms_.empty()) return figures;
        std::sort(latencies_ms_.begin(), latencies_ms_.end());
        const auto at = [&](double share) {
            const auto last = static_cast<double>(latencies_ms_.size() - 1);
            return latencies_ms_[static_cast<std::size_t>(share * last)];
        };
        figures.p50_ms = at(0.5);
        figures.p99_ms = at(0.99);
        figures.max_ms = latencies_ms_.back();
        return figures;
    }

    Accuracy accuracy;

  private:
    // In lockstep a tick is a frame set. In real time a held tick has no frame of its own; the capture time
    // tells.
    std::optional<std::size_t> frame_of(std::uint32_t sequence, std::int64_t capture_us) const {
        std::size_t frame = sequence;
        if (real_time_) {
            const double since_s = static_cast<double>(capture_us - served_.start_us) * 1e-6;
            frame = static_cast<std::size_t>(std::llround(std::max(0.0, since_s) * world_.config().rate_hz));
        }
        if (frame >= world_.frame_count()) return std::nullopt;
        return frame;
    }

    const World& world_;
    const HandOver& hand_over_;
    const ServerCounters& served_;
    bool real_time_;
    std::vector<FaceState> states_;
    std::vector<bool> have_;
    std::vector<double> latencies_ms_;
    std::uint64_t received_ = 0;
    std::int64_t last_received_us_ = 0;
};

Result<ChildProcess, FileError> start_daemon(const DemoOptions& options, const std::filesystem::path& socket,
                                             const std::filesystem::path& line) {
    const std::vector<std::string> arguments{options.daemon.string(),
                                             "--board",
                                             "sim",
                                             "--world",
                                             socket.string(),
                                             "--pack",
                                             (options.out_folder / "face.pack").string(),
                                             "--link",
                                             "pty:" + line.string(),
                                             "--stream",
                                             "weights,markers,status",
                                             "--log-observations",
                                             (options.out_folder / "take.rgo").string(),
                                             "--digest",
                                             "--executor",
                                             options.real_time ? "threads" : "lockstep"};
    return ChildProcess::start(arguments, options.out_folder / "headrigd.log");
}

FileError daemon_fault(const DemoOptions& options, const std::string& what) {
    return FileError{fmt::format("{}: {}; see {}", options.daemon.string(), what,
                                 (options.out_folder / "headrigd.log").string())};
}

Result<std::unique_ptr<ByteLink>, FileError> open_line(const DemoOptions& options,
                                                       const std::filesystem::path& line,
                                                       ChildProcess& daemon) {
    const std::int64_t until = monotonic_us() + kLinkTimeoutUs;
    while (monotonic_us() < until) {
        if (const auto end = daemon.poll()) {
            return failure(
                daemon_fault(options, fmt::format("ended with code {} before it started", end->exit_code)));
        }
        std::error_code ignored;
        if (std::filesystem::exists(line, ignored)) {
            auto link = open_link(line.string());
            if (link) return std::move(*link);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return failure(daemon_fault(options, "made no serial line within 10 s"));
}

// Receives until the daemon has ended and its last bytes are read. False: interrupted.
Result<bool, FileError> receive_all(const DemoOptions& options, const DemoEvents& events, const Stage& stage,
                                    HostSession& session, ChildProcess& daemon, const Reception& reception,
                                    const HandOver& hand_over) {
    const std::uint64_t total = stage.world->frame_count();
    std::int64_t ended_us = 0;
    std::int64_t alive_us = monotonic_us();
    std::uint64_t seen = 0;
    while (true) {
        const std::int64_t now = monotonic_us();
        session.poll(now);
        if (events.interrupted && events.interrupted()) return false;
        if (reception.received() != seen) {
            seen = reception.received();
            alive_us = now;
            if (events.progress) events.progress(seen, total);
        }
        if (ended_us == 0) {
            if (daemon.poll()) ended_us = now;
            if (now - alive_us > kStallUs) {
                return failure(
                    daemon_fault(options, fmt::format("nothing received for 30 s after {} of {} frames", seen,
                                                      hand_over.handed())));
            }
        } else if (seen >= total || now - ended_us > kDrainUs || session.phase() == SessionPhase::kClosed) {
            return true;
        }
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
}

Result<void, FileError> save_weights(const std::filesystem::path& path, const Stage& stage,
                                     const Reception& reception) {
    std::vector<std::string> columns{"frame", "time_s"};
    for (const SparseShape& shape : stage.rig.shapes) columns.push_back(shape.name);
    CsvWriter csv(columns);
    for (std::size_t f = 0; f < stage.world->frame_count(); ++f) {
        if (!reception.has(f)) continue;
        csv.integer(static_cast<std::int64_t>(f))
            .number(static_cast<double>(f) / stage.world->config().rate_hz, 6);
        for (std::size_t i = 0; i < stage.rig.shapes.size(); ++i) {
            csv.number(static_cast<double>(reception.states()[f].weights[i]), 6);
        }
        csv.end_row();
    }
    return csv.save(path);
}

// The observable shapes that move most in the truth.
std::vector<Curve> pick_curves(const Stage& stage, const Reception& reception,
                               const AccuracyFigures& accuracy) {
    const std::size_t shapes = stage.rig.shapes.size();
    const std::size_t frames = stage.world->frame_count();
    std::vector<std::vector<double>> truth(shapes, std::vector<double>(frames));
    std::vector<double> spread(shapes, 0.0);
    for (std::size_t f = 0; f < frames; ++f) {
        const std::vector<float> weights = stage.world->weights(f);
        for (std::size_t i = 0; i < shapes; ++i) truth[i][f] = static_cast<double>(weights[i]);
    }
    for (std::size_t i = 0; i < shapes; ++i) {
        const double mean =
            std::accumulate(truth[i].begin(), truth[i].end(), 0.0) / static_cast<double>(frames);
        for (const double w : truth[i]) spread[i] += (w - mean) * (w - mean);
        if (!reception.accuracy.observable(i)) spread[i] = -1.0;
    }
    std::vector<std::size_t> order(shapes);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return spread[a] > spread[b]; });
    order.resize(std::min(order.size(), kCurves));
    std::vector<Curve> curves;
    for (const std::size_t i : order) {
        Curve curve{stage.rig.shapes[i].name, truth[i], std::vector<double>(frames, kNothing),
                    accuracy.shape_rms[i]};
        for (std::size_t f = 0; f < frames; ++f) {
            if (reception.has(f) && !reception.states()[f].held) {
                curve.solved[f] = static_cast<double>(reception.states()[f].weights[i]);
            }
        }
        curves.push_back(std::move(curve));
    }
    return curves;
}

Result<void, FileError> write_outputs(const DemoOptions& options, const Stage& stage, const SolvePack& pack,
                                      const Reception& reception, const DemoFigures& figures) {
    const auto& out = options.out_folder;
    if (const auto saved = save_weights(out / "weights.csv", stage, reception); !saved) return saved;
    const auto curves = pick_curves(stage, reception, figures.accuracy);
    const std::string title =
        fmt::format("{} of {}: weight rms {:.4f} over {} observable shapes",
                    options.take_csv.filename().string(), options.rig_folder.filename().string(),
                    figures.accuracy.weight_rms, figures.accuracy.observable_shapes);
    if (const auto drawn = draw_curves(out / "curves.png", curves, stage.world->config().rate_hz, title);
        !drawn)
        return drawn;
    return draw_overlay(out / "overlay.png", *stage.world, pack, stage.world->frame_count() / 2);
}

std::filesystem::path scratch_folder() {
    return std::filesystem::temp_directory_path() / fmt::format("rig_demo_{}", getpid());
}

// Removes the socket's folder whatever happens.
struct ScratchFolder {
    std::filesystem::path path = scratch_folder();
    ScratchFolder() { std::filesystem::create_directories(path); }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

void fill_figures(const Stage& stage, const WorldServer& server, const HostSession& session,
                  const Health& health, const std::optional<ChildEnd>& end, Reception& reception,
                  DemoFigures& figures) {
    figures.frames = stage.world->frame_count();
    figures.rendered = server.counters().rendered;
    figures.not_sent = server.counters().dropped;
    figures.solved = health.solved;
    figures.sent = health.frames_sent;
    figures.received = reception.received();
    figures.lost =
        figures.frames - figures.not_sent - std::min(figures.received, figures.frames - figures.not_sent);
    const FrameCounters& wire = session.frames();
    figures.bad_wire = wire.bad_crc + wire.bad_cobs + wire.too_long + wire.bad_length + wire.bad_version;
    figures.latency = reception.latency();
    figures.accuracy = reception.accuracy.figures();
    figures.heap_calls_after_seal = health.heap_calls_after_seal;
    figures.peak_memory_kb = end ? end->peak_memory_kb : health.peak_memory_kb;
    figures.solve_p50_ms = health.solve.p50_us * 1e-3;
    figures.solve_p99_ms = health.solve.p99_us * 1e-3;
    figures.solve_max_ms = health.solve.max_us * 1e-3;
}

// Of the observations that the daemon recorded, solved again here.
Result<std::uint64_t, FileError> replay_digest(const DemoOptions& options, const OpenedPack& pack) {
    const ReplayRequest request{options.out_folder / "take.rgo", (options.out_folder / "face.pack").string(),
                                false};
    const auto replayed = replay_log(request, pack, [](const ReplayedTick&) { return true; });
    if (!replayed) return failure(replayed.error());
    return replayed->digest;
}

}  // namespace

std::vector<std::string> broken_bounds(const DemoFigures& figures, const DemoBounds& bounds, bool real_time) {
    std::vector<std::string> broken;
    const auto check = [&broken](bool holds, std::string line) {
        if (!holds) broken.push_back(std::move(line));
    };
    const AccuracyFigures& a = figures.accuracy;
    check(a.weight_rms <= bounds.weight_rms,
          fmt::format("weight rms {:.4f} > {:.4f}", a.weight_rms, bounds.weight_rms));
    check(a.marker_rms_mm <= bounds.marker_rms_mm,
          fmt::format("marker rms {:.3f} mm > {:.3f} mm", a.marker_rms_mm, bounds.marker_rms_mm));
    check(a.markers_judged > 0, "no marker was received");
    check(a.identity_errors == 0, fmt::format("{} identity errors", a.identity_errors));
    check(figures.heap_calls_after_seal == 0,
          fmt::format("{} heap calls after seal", figures.heap_calls_after_seal));
    const auto live = static_cast<double>(a.frames_judged);
    check(
        live >= bounds.live_share * static_cast<double>(figures.received),
        fmt::format("{} of {} received frames have a solve behind them", a.frames_judged, figures.received));
    if (real_time) return broken;
    check(figures.lost == 0, fmt::format("{} frames lost", figures.lost));
    check(figures.digest == figures.replayed_digest,
          "the observation log solves to other weights than were received");
    check(figures.bad_wire == 0, fmt::format("{} wire frames refused", figures.bad_wire));
    return broken;
}

Result<DemoFigures, FileError> run_demo(const DemoOptions& options, const DemoEvents& events) {
    std::error_code fault;
    std::filesystem::create_directories(options.out_folder, fault);
    if (fault)
        return failure(FileError{options.out_folder.string() + ": cannot be made: " + fault.message()});
    events.step("loading the rig and the take");
    auto stage = load_stage(options);
    if (!stage) return failure(stage.error());
    events.step("training the pack");
    const auto pack = make_pack(options, *stage);
    if (!pack) return failure(pack.error());

    const ScratchFolder scratch;
    HandOver hand_over(stage->world->frame_count());
    ServerConfig serving;
    serving.socket = scratch.path / "world.sock";
    serving.pace = options.real_time ? sim::WorldPace::kRealTime : sim::WorldPace::kLockstep;
    serving.render_threads = 2;
    serving.connect_timeout_us = kLinkTimeoutUs;
    WorldServer server(*stage->world, serving);
    if (const auto listening = server.listen(); !listening) return failure(listening.error());
    events.step("starting the daemon");
    const auto line = scratch.path / "serial";
    auto daemon = start_daemon(options, serving.socket, line);
    if (!daemon) return failure(daemon.error());
    auto link = open_line(options, line, *daemon);
    if (!link) return failure(link.error());

    Reception reception(*stage, hand_over, server.counters(), options.real_time);
    Health health;
    SessionOptions wanted;
    wanted.streams = kStreamWeights | kStreamMarkers | kStreamStatus;
    SessionEvents heard;
    heard.state = [&](const ReceivedState& state) { reception.take_state(state); };
    heard.markers = [&](const MarkerFrame& markers, std::int64_t) { reception.take_markers(markers); };
    heard.status = [&](const Health& status) { health = status; };
    HostSession session(**link, wanted, heard);
    events.step("running");
    const std::int64_t began_us = monotonic_us();
    server.start([&](std::uint64_t sent, std::uint64_t) { hand_over.mark(sent - 1); });
    const auto finished = receive_all(options, events, *stage, session, *daemon, reception, hand_over);
    server.stop();
    const ServerEnd served = server.join();
    if (!finished) return failure(finished.error());
    if (!*finished) return failure(FileError{"interrupted"});

    DemoFigures figures;
    const auto end = daemon->wait(5000);
    fill_figures(*stage, server, session, health, end, reception, figures);
    figures.wall_s =
        static_cast<double>(std::max(reception.last_received_us(), began_us + 1) - began_us) * 1e-6;
    figures.solved_per_s = static_cast<double>(figures.solved) / figures.wall_s;
    if (!end || end->exit_code != 0) {
        return failure(
            daemon_fault(options, end ? fmt::format("ended with code {}", end->exit_code) : "does not end"));
    }
    if (served != ServerEnd::kCompleted)
        return failure(daemon_fault(options, "left the world before its end"));
    events.step("solving the recorded observations again");
    const auto replayed = replay_digest(options, *pack);
    if (!replayed) return failure(replayed.error());
    figures.digest = reception.digest();
    figures.replayed_digest = *replayed;
    events.step("drawing the pictures");
    if (const auto written = write_outputs(options, *stage, pack->pack(), reception, figures); !written) {
        return failure(written.error());
    }
    return figures;
}

}  // namespace rig::host
