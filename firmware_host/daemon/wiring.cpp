#include "firmware_host/daemon/wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>

#include "firmware_host/daemon/board_file.hpp"
#include "firmware_host/daemon/heap_guard.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "hal/linux/process.hpp"
#include "hal/linux/pty_link.hpp"
#include "hal/linux/systemd_watchdog.hpp"
#include "hal/linux/tty_link.hpp"
#include "hal/linux/udp_link.hpp"
#include "hal/linux/v4l2/usb_bandwidth.hpp"
#include "hal/linux/v4l2/v4l2_frame_source.hpp"
#include "hal/sim/faulty_frame_source.hpp"
#include "hal/sim/faulty_link.hpp"
#include "hal/sim/world_client.hpp"

namespace rig {

namespace {

constexpr int kDefaultBaud = 115'200;

std::unexpected<WiringError> refuse(ExitCode code, std::string message) {
    return failure(WiringError{std::move(message), code});
}

template <class Number>
bool parse_number(std::string_view text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size();
}

// The number of "world:NUMBER"; -1 when it is something else.
int world_number(const std::string& source) {
    int number = -1;
    if (!source.starts_with("world:") || !parse_number(std::string_view(source).substr(6), number)) return -1;
    return number;
}

constexpr std::string_view kKernelCamera = "v4l2:";

std::optional<PixelLayout> layout_called(const std::string& name) {
    for (std::size_t i = 0; i < kPixelLayouts; ++i) {
        const auto layout = static_cast<PixelLayout>(i);
        if (pixel_layout_name(layout) == name) return layout;
    }
    return std::nullopt;
}

V4l2CameraConfig camera_config(const BoardCamera& camera, double rate_hz) {
    V4l2CameraConfig config;
    config.camera = {camera.source.substr(kKernelCamera.size()), camera.video.serial};
    config.width_px = camera.video.width_px;
    config.height_px = camera.video.height_px;
    config.rate_hz = rate_hz;
    config.layout = layout_called(camera.video.pixels);
    config.gain = {camera.video.gain_unit_db, camera.video.gain_unity};
    config.readout_us = camera.video.readout_us;
    for (const auto& [id, value] : camera.video.controls) config.controls.push_back({id, value});
    return config;
}

// Of the cameras that are plugged in now. A camera whose layout is left to it counts as GREY, the narrowest
// of those that are not compressed.
std::optional<std::string> bandwidth_fault(const Board& board) {
    std::array<VideoNode, 16> nodes;
    const std::size_t count = list_video_nodes({}, nodes);
    std::vector<CameraLoad> loads;
    for (const BoardCamera& camera : board.cameras) {
        const V4l2CameraConfig config = camera_config(camera, board.rate_hz);
        std::size_t found = 0;
        if (find_camera(std::span(nodes).first(count), config.camera, found) != CameraMatch::kFound) continue;
        loads.push_back({camera.name, nodes[found].usb_bus, nodes[found].usb_mbps,
                         config.layout.value_or(PixelLayout::kGrey), config.width_px, config.height_px,
                         config.rate_hz});
    }
    return bandwidth_fault(loads);
}

Result<std::unique_ptr<ByteLink>, WiringError> make_serial(const std::string& place) {
    const std::size_t at = place.rfind('@');
    int baud = kDefaultBaud;
    if (at != std::string::npos &&
        (!parse_number(std::string_view(place).substr(at + 1), baud) || baud < 50 || baud > 12'000'000)) {
        return refuse(kExitUsage,
                      fmt::format("--link serial:{}: the rate after @ must be a number of baud", place));
    }
    return std::make_unique<TtyLink>(place.substr(0, at), baud);
}

Result<std::unique_ptr<ByteLink>, WiringError> make_udp(const std::string& place) {
    const std::size_t colon = place.rfind(':');
    const std::string host = colon == std::string::npos ? "" : place.substr(0, colon);
    std::uint16_t port = 0;
    const auto number = std::string_view(place).substr(colon == std::string::npos ? 0 : colon + 1);
    if (!parse_number(number, port) || port == 0) {
        return refuse(
            kExitUsage,
            fmt::format("--link udp:{}: needs HOST:PORT or PORT, with a port of 1 to 65535", place));
    }
    const auto address = resolve_udp(host.empty() ? "0.0.0.0" : host, port);
    if (!address) return refuse(kExitLink, fmt::format("--link udp:{}: there is no host '{}'", place, host));
    const UdpAddress none;
    return std::make_unique<UdpLink>(host.empty() ? *address : none, host.empty() ? none : *address);
}

Result<std::unique_ptr<ByteLink>, WiringError> make_link(const std::string& spec) {
    const std::size_t colon = spec.find(':');
    const std::string kind = spec.substr(0, colon);
    const std::string place = colon == std::string::npos ? "" : spec.substr(colon + 1);
    if (kind == "pty") return std::make_unique<PtyLink>(place);
    if (kind == "serial" && !place.empty()) return make_serial(place);
    if (kind == "udp" && !place.empty()) return make_udp(place);
    return refuse(kExitUsage,
                  fmt::format("--link {}: must be pty:PATH, serial:DEVICE@BAUD or udp:HOST:PORT", spec));
}

Result<sim::FaultPlan, WiringError> load_faults(const std::string& path) {
    if (path.empty()) return sim::FaultPlan{};
    std::ifstream file(path);
    std::ostringstream text;
    if (!(text << file.rdbuf())) return refuse(kExitInput, fmt::format("{}: cannot be read", path));
    auto plan = sim::parse_fault_plan(text.str());
    if (!plan)
        return refuse(kExitInput,
                      fmt::format("{}: line {}: {}", path, plan.error().line, plan.error().reason));
    return std::move(*plan);
}

// A frame has to end before the next one begins; a tenth of the period is for reading it out.
ExposureConfig exposure_config(const CommandLine& command_line, double rate_hz) {
    ExposureConfig config;
    config.blur_limit_us = command_line.most_exposure_us;
    config.longest_us = std::max(0.9e6 / rate_hz, config.shortest_us);
    config.start_exposure_us = std::min({config.start_exposure_us, config.blur_limit_us, config.longest_us});
    config.mains_hz = command_line.mains_hz;
    return config;
}

class WorldPaceOf final : public Pace {
  public:
    explicit WorldPaceOf(sim::WorldClient& world) : world_(world) {}
    void tick_done() override { world_.tick_done(); }
    [[nodiscard]] Status status() const override {
        if (world_.fault() != nullptr) return Status::kGone;
        return world_.ended() ? Status::kEnded : Status::kRunning;
    }

  private:
    sim::WorldClient& world_;
};

std::atomic<bool> stop_requested{false};
std::atomic<Clock*> clock_to_wake{nullptr};

// Called by the signal handler.
void request_stop() {
    stop_requested = true;
    if (Clock* clock = clock_to_wake.load()) clock->interrupt();
}

}  // namespace

struct Wiring::Rig {
    Board board;
    MonotonicClock wall;
    std::unique_ptr<sim::WorldClient> world;
    std::unique_ptr<Pace> pace;
    sim::FaultPlan faults;
    std::vector<std::unique_ptr<V4l2FrameSource>> kernel_cameras;  // as the board's, or none
    std::vector<std::unique_ptr<FrameSource>> faulty_cameras;
    std::unique_ptr<ByteLink> link;
    std::unique_ptr<ByteLink> faulty_link;
    std::unique_ptr<SystemdWatchdog> watchdog;
    std::unique_ptr<OpenedPack> pack;
    std::unique_ptr<Pipeline> pipeline;
    std::unique_ptr<ObservationLogWriter> log;
    std::unique_ptr<App> app;
    PipelineConfig running;  // what the pipeline was configured with
    bool lockstep = true;

    [[nodiscard]] Result<void, WiringError> take_pack(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> open_host_link(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> choose_body(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> take_kernel_cameras(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> join_world(const CommandLine& command_line);
    [[nodiscard]] Result<std::vector<FrameSource*>, WiringError> connect_cameras();
    [[nodiscard]] Result<FrameSource*, WiringError> camera_behind(std::size_t number);
    [[nodiscard]] std::uint8_t camera_count() const;
    void tell_camera_troubles() const;
    [[nodiscard]] GpioLine* connect_line(const std::string& name);
    [[nodiscard]] Result<void, WiringError> configure_pipeline(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> start_log(const CommandLine& command_line);
    [[nodiscard]] Result<void, WiringError> assemble_app(const CommandLine& command_line);
    [[nodiscard]] BoardIdentity identity(const CommandLine& command_line) const;
};

Result<void, WiringError> Wiring::Rig::take_pack(const CommandLine& command_line) {
    std::string fault = "no --pack is given";
    if (!command_line.pack.empty()) {
        auto opened = open_pack_file(command_line.pack);
        if (opened) {
            pack = std::make_unique<OpenedPack>(std::move(*opened));
            return {};
        }
        fault = opened.error().message;
    }
    if (command_line.require_pack) return refuse(kExitInput, fault);
    fmt::print(stderr, "headrigd: {}; running in SAFE\n", fault);
    return {};
}

// Before the world is joined: a host finds the link as soon as the program runs.
Result<void, WiringError> Wiring::Rig::open_host_link(const CommandLine& command_line) {
    const std::string spec = command_line.link.empty() ? board.default_link : command_line.link;
    if (spec.empty()) {
        return refuse(
            kExitUsage,
            fmt::format("board '{}' has no link of its own: say --link pty:/tmp/headrig, for example",
                        board.name));
    }
    auto made = make_link(spec);
    if (!made) return failure(made.error());
    link = std::move(*made);
    if (link->open()) return {};
    return refuse(kExitLink,
                  fmt::format("--link {}: cannot be opened; is the place there, free and allowed?", spec));
}

// Cameras of the kernel, or those of a simulated world.
Result<void, WiringError> Wiring::Rig::choose_body(const CommandLine& command_line) {
    const auto of_kernel = [](const BoardCamera& camera) { return camera.source.starts_with(kKernelCamera); };
    const auto count = std::ranges::count_if(board.cameras, of_kernel);
    if (count == 0) return join_world(command_line);
    if (count == std::ssize(board.cameras)) return take_kernel_cameras(command_line);
    return refuse(kExitInput, fmt::format("board '{}': cameras of the kernel (v4l2:) and of a world (world:) "
                                          "cannot be mixed",
                                          board.name));
}

Result<void, WiringError> Wiring::Rig::take_kernel_cameras(const CommandLine& command_line) {
    if (!command_line.world.empty() || command_line.executor == ExecutorChoice::kLockstep) {
        return refuse(kExitUsage,
                      fmt::format("board '{}' has real cameras: --world and --executor lockstep are for "
                                  "simulated ones",
                                  board.name));
    }
    if (const auto fault = bandwidth_fault(board))
        return refuse(kExitInput, fmt::format("board '{}': {}", board.name, *fault));
    lockstep = false;
    pace = std::make_unique<Pace>();
    for (const BoardCamera& camera : board.cameras)
        kernel_cameras.push_back(
            std::make_unique<V4l2FrameSource>(wall, camera_config(camera, board.rate_hz)));
    return {};
}

std::uint8_t Wiring::Rig::camera_count() const {
    return world ? world->hello().camera_count : static_cast<std::uint8_t>(kernel_cameras.size());
}

void Wiring::Rig::tell_camera_troubles() const {
    for (std::size_t c = 0; c < kernel_cameras.size(); ++c) {
        const std::string_view trouble = kernel_cameras[c]->trouble();
        if (!trouble.empty())
            fmt::print(stderr, "headrigd: camera '{}': {}; tried again\n", board.cameras[c].name, trouble);
    }
}

Result<void, WiringError> Wiring::Rig::join_world(const CommandLine& command_line) {
    if (command_line.world.empty()) {
        return refuse(
            kExitUsage,
            fmt::format("board '{}' needs --world SOCKET: start 'headrig world --serve SOCKET' first",
                        board.name));
    }
    sim::WorldPatience patience;
    patience.connect_us = static_cast<std::int64_t>(command_line.world_timeout_s * 1e6);
    auto joined = sim::WorldClient::connect(command_line.world, patience);
    if (!joined && joined.error() == sim::WorldError::kNoWorld) {
        return refuse(kExitWorld, fmt::format("{}: no world answers; start 'headrig world --serve {}'",
                                              command_line.world, command_line.world));
    }
    if (!joined) {
        return refuse(kExitWorld,
                      fmt::format("{}: what answers is no world of version {}, or said nothing in time",
                                  command_line.world, sim::kWorldVersion));
    }
    world = std::move(*joined);
    pace = std::make_unique<WorldPaceOf>(*world);
    lockstep = world->hello().pace == sim::WorldPace::kLockstep;
    board.rate_hz = world->hello().rate_millihertz / 1000.0;
    const bool fits = command_line.executor == ExecutorChoice::kAuto ||
                      (command_line.executor == ExecutorChoice::kLockstep) == lockstep;
    if (fits) return {};
    return refuse(kExitUsage,
                  fmt::format("the world runs {}: use --executor {}",
                              lockstep ? "in lockstep" : "in real time", lockstep ? "lockstep" : "threads"));
}

// nullptr for a camera that the world does not have.
Result<FrameSource*, WiringError> Wiring::Rig::camera_behind(std::size_t number) {
    if (!kernel_cameras.empty()) return kernel_cameras[number].get();
    const BoardCamera& camera = board.cameras[number];
    const int in_world = world_number(camera.source);
    if (in_world < 0) {
        return refuse(kExitInput,
                      fmt::format("board '{}': camera '{}' has the source '{}'; known are world:NUMBER and "
                                  "v4l2:PATH",
                                  board.name, camera.name, camera.source));
    }
    if (in_world >= world->hello().camera_count) return nullptr;
    return &world->camera(static_cast<std::size_t>(in_world));
}

Result<std::vector<FrameSource*>, WiringError> Wiring::Rig::connect_cameras() {
    std::vector<FrameSource*> cameras;
    for (std::size_t c = 0; c < board.cameras.size(); ++c) {
        const auto behind = camera_behind(c);
        if (!behind) return failure(behind.error());
        FrameSource* source = *behind;
        if (source == nullptr) continue;
        if (!faults.events.empty()) {
            const auto target = static_cast<std::uint8_t>(cameras.size());
            Clock& clock = world ? world->clock() : wall;
            faulty_cameras.push_back(
                std::make_unique<sim::FaultyFrameSource>(*source, clock, faults, target));
            source = faulty_cameras.back().get();
        }
        cameras.push_back(source);
    }
    return cameras;
}

GpioLine* Wiring::Rig::connect_line(const std::string& name) {
    const BoardLine* line = board.line(name);
    const int number = line == nullptr ? -1 : world_number(line->source);
    if (!world || number < 0 || number >= static_cast<int>(sim::kWorldLineCount)) return nullptr;
    return &world->line(static_cast<sim::WorldLine>(number));
}

Result<void, WiringError> Wiring::Rig::configure_pipeline(const CommandLine& command_line) {
    pipeline = std::make_unique<Pipeline>();
    running = command_line.pipeline;
    if (pack == nullptr) return {};
    PipelineConfig config = command_line.pipeline;
    config.rate_hz = board.rate_hz;
    const FilterSettings settings = merged(board.smoothing, command_line.smoothing);
    const auto smoothing =
        filter_choice(settings, std::span(pack->pack().shape_names).first(pack->pack().shape_count));
    if (!smoothing) {
        return refuse(kExitUsage,
                      fmt::format("smoothing of board '{}' and --filter: {}", board.name, smoothing.error()));
    }
    config.smoothing = *smoothing;
    config.filter = config.filter && !smooths_nothing(settings);
    running = config;
    if (pipeline->configure(pack->pack(), config)) return {};
    return refuse(kExitInput,
                  fmt::format("{}: this rig cannot run at {} Hz with it", command_line.pack, board.rate_hz));
}

Result<void, WiringError> Wiring::Rig::start_log(const CommandLine& command_line) {
    if (command_line.log_observations.empty()) return {};
    ObservationLogHeader header;
    header.camera_count = camera_count();
    header.rate_millihertz = static_cast<std::uint32_t>(board.rate_hz * 1000.0 + 0.5);
    header.filter = running.filter;
    header.stabilise = running.stabilise;
    header.camera_on_head = running.camera_on_head;
    header.smoothing = running.smoothing;
    header.loss_policy = static_cast<std::uint8_t>(running.loss_policy);
    if (pack != nullptr) header.pack_hash = pack->manifest().manifest_hash;
    auto made = ObservationLogWriter::create(command_line.log_observations, header);
    if (!made)
        return refuse(kExitOutput, fmt::format("{}: cannot be written", command_line.log_observations));
    log = std::move(*made);
    return {};
}

BoardIdentity Wiring::Rig::identity(const CommandLine& command_line) const {
    BoardIdentity result;
    Hello& hello = result.hello;
    hello.role = Role::kBoard;
    hello.session_id = std::random_device{}();
    hello.capabilities = kCanStreamMarkers | kCanResetTracking | kCanControl;
    if (world) hello.capabilities |= kIsSimulated;
    if (!running.camera_on_head) hello.capabilities |= kCanStreamHead;
    hello.rate_mhz = static_cast<std::uint32_t>(board.rate_hz * 1000.0 + 0.5);
    hello.firmware = FixedText<24>(RIG_VERSION);
    hello.serial = FixedText<32>(command_line.name);
    hello.board = FixedText<24>(board.name);
    result.first_streams = command_line.streams;
    if (pack == nullptr) return result;
    const SolvePack& solve = pack->pack();
    hello.pack_loaded = true;
    hello.pack_unsigned = true;
    hello.shape_count = solve.shape_count;
    hello.marker_count = solve.marker_count;
    for (std::size_t i = 0; i < hello.pack_hash.size(); ++i) {
        hello.pack_hash[i] = std::to_integer<std::uint8_t>(pack->manifest().manifest_hash[i]);
    }
    result.shape_names = std::span(solve.shape_names).first(solve.shape_count);
    result.marker_names = std::span(solve.marker_names).first(solve.marker_count);
    return result;
}

Result<void, WiringError> Wiring::Rig::assemble_app(const CommandLine& command_line) {
    auto cameras = connect_cameras();
    if (!cameras) return failure(cameras.error());
    Clock& clock = lockstep ? world->clock() : wall;
    watchdog = std::make_unique<SystemdWatchdog>(SystemdWatchdog::from_environment());
    ByteLink* host = link.get();
    if (!faults.events.empty()) {
        faulty_link = std::make_unique<sim::FaultyLink>(*link, clock, faults, std::uint8_t{0});
        host = faulty_link.get();
    }
    AppConfig config;
    config.rate_hz = board.rate_hz;
    config.feed.rate_hz = board.rate_hz;
    config.feed.frozen_frames = board.frozen_frames;
    if (command_line.auto_exposure) config.exposure = exposure_config(command_line, board.rate_hz);
    config.identity = identity(command_line);
    config.vitals = {heap_calls_after_seal, os::peak_memory_kb};
    config.wait_for_host_us = static_cast<std::int64_t>(command_line.wait_host_s * 1e6);
    AppParts parts{clock,
                   wall,
                   std::move(*cameras),
                   *host,
                   *watchdog,
                   *pace,
                   connect_line("button_neutral"),
                   connect_line("live_led"),
                   *pipeline,
                   pack == nullptr ? nullptr : &pack->pack(),
                   log.get()};
    app = std::make_unique<App>(parts, config);
    clock_to_wake = &clock;
    return {};
}

Wiring::Wiring() : rig_(std::make_unique<Rig>()) {}

Wiring::~Wiring() {
    clock_to_wake = nullptr;
}

Result<std::unique_ptr<Wiring>, WiringError> Wiring::build(const CommandLine& command_line) {
    os::ignore_broken_pipes();
    os::on_stop_signal(request_stop);
    std::unique_ptr<Wiring> wiring(new Wiring);
    Rig& rig = *wiring->rig_;
    auto board = load_board(command_line.board, command_line.boards_folder);
    if (!board) return refuse(kExitInput, board.error().message);
    rig.board = std::move(*board);
    auto faults = load_faults(command_line.faults);
    if (!faults) return failure(faults.error());
    rig.faults = std::move(*faults);
    Result<void, WiringError> step = rig.take_pack(command_line);
    if (step) step = rig.open_host_link(command_line);
    if (step) step = rig.choose_body(command_line);
    if (step) step = rig.configure_pipeline(command_line);
    if (step) step = rig.start_log(command_line);
    if (step) step = rig.assemble_app(command_line);
    if (!step) return failure(step.error());
    rig.app->open_cameras();
    rig.tell_camera_troubles();
    if (command_line.real_time && !os::become_real_time()) {
        fmt::print(
            stderr,
            "headrigd: --real-time is not permitted here (CAP_SYS_NICE, CAP_IPC_LOCK); going on without\n");
    }
    return wiring;
}

AppEnd Wiring::run() {
    return rig_->lockstep ? rig_->app->run_lockstep(stop_requested, seal_heap, unseal_heap)
                          : rig_->app->run_threads(stop_requested, seal_heap, unseal_heap);
}

App& Wiring::app() {
    return *rig_->app;
}

std::string Wiring::world_fault() const {
    const char* fault = rig_->world ? rig_->world->fault() : nullptr;
    return fault == nullptr ? "" : fault;
}

std::uint64_t Wiring::unrecorded_ticks() const {
    return rig_->log == nullptr ? 0 : rig_->log->dropped();
}

}  // namespace rig
