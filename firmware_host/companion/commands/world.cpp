// headrig world: the simulated world: pictures of a performance with their truth, or a live one for the
// daemon.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <thread>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/world/image_writer.hpp"
#include "firmware_host/companion/world/truth_recorder.hpp"
#include "firmware_host/companion/world/world.hpp"
#include "firmware_host/companion/world/world_server.hpp"

namespace rig::host {

namespace {

struct WorldOptions {
    std::string rig, take, layout = "60", rig_cameras;
    std::size_t cameras = 2;
    WorldConfig world;
    CameraControl control;
    std::string serve, images, truth, calibration;
    sim::WorldPace pace = sim::WorldPace::kLockstep;
    std::vector<std::string> presses;
    std::size_t slots = 8, threads = 2, step = 1;
    double connect_timeout_s = 0.0, readout_ms = 0.0;
    bool png = false, benchmark = false;
};

int refuse(const std::string& message, int code) {
    print_error(message);
    return code;
}

// "neutral@2.0s": a button and a time after the first frame.
std::string parse_press(const std::string& text, ButtonPress& press) {
    const std::map<std::string, sim::WorldLine> lines = {{"neutral", sim::WorldLine::kButtonNeutral},
                                                         {"record", sim::WorldLine::kButtonRecord},
                                                         {"presence", sim::WorldLine::kButtonPresence}};
    const std::size_t at = text.find('@');
    const std::string wrong =
        fmt::format("--press {}: say neutral, record or presence, @ and seconds: neutral@2.0s", text);
    const auto line = lines.find(text.substr(0, at));
    if (at == std::string::npos || line == lines.end()) return wrong;
    try {
        std::size_t used = 0;
        const std::string number = text.substr(at + 1);
        const double seconds = std::stod(number, &used);
        const std::string unit = number.substr(used);
        if ((!unit.empty() && unit != "s") || !(seconds >= 0.0 && seconds < 1e6)) return wrong;
        press = {line->second, std::llround(seconds * 1e6)};
    } catch (const std::exception&) {
        return wrong;
    }
    return {};
}

Result<std::unique_ptr<World>, FileError> make_world(WorldOptions& options) {
    if (options.rig.empty() || options.take.empty())
        return failure(FileError{"say --rig DIR and --take FILE"});
    const auto rig = load_rig(options.rig);
    if (!rig) return failure(rig.error());
    const auto layout = load_layout(options.rig, options.layout, *rig);
    if (!layout) return failure(layout.error());
    const auto take = load_take(options.take, *rig);
    if (!take) return failure(take.error());
    return World::create(*rig, *layout, *take, options.world);
}

int save_truth(const TruthRecorder* truth, const WorldOptions& options) {
    if (truth == nullptr) return kExitOk;
    const auto saved = truth->save(options.truth);
    return saved ? kExitOk : refuse(saved.error().message, kExitOutput);
}

int write_images(const World& world, const WorldOptions& options, TruthRecorder* truth) {
    const ImageOptions image_options{options.png, options.step, options.threads, options.layout,
                                     options.control};
    Progress progress("rendering", (world.frame_count() + options.step - 1) / options.step);
    const auto written =
        write_world_images(world, options.images, image_options, truth, [&](std::uint64_t done) {
            progress.update(done);
            return !interrupted();
        });
    if (!written) return refuse(written.error().message, kExitOutput);
    if (interrupted()) return kExitInterrupted;
    fmt::print("{} images, cameras.json and truth.csv in {}\n", *written, options.images);
    return save_truth(truth, options);
}

int serve(const World& world, const WorldOptions& options, TruthRecorder* truth) {
    ServerConfig config;
    config.socket = options.serve;
    config.pace = options.pace;
    config.slot_count = static_cast<std::uint32_t>(options.slots);
    config.render_threads = options.threads;
    config.readout_us = std::llround(1e3 * options.readout_ms);
    config.connect_timeout_us = std::llround(1e6 * options.connect_timeout_s);
    for (const std::string& text : options.presses) {
        if (const std::string fault = parse_press(text, config.presses.emplace_back()); !fault.empty()) {
            return refuse(fault, kExitUsage);
        }
    }
    WorldServer server(world, config, truth);
    if (const auto bound = server.listen(); !bound) return refuse(bound.error().message, kExitDevice);
    fmt::print(stderr, "waiting for a daemon at {}\n", options.serve);
    std::atomic<bool> ended{false};
    std::jthread keeper([&] {
        while (!ended) {
            if (interrupted()) server.stop();
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    });
    Progress progress("serving", world.frame_count());
    const ServerEnd end = server.run([&](std::uint64_t sent, std::uint64_t) { progress.update(sent); });
    ended = true;
    const ServerCounters& counters = server.counters();
    fmt::print("rendered {} sent {} dropped {} (no slot {}, overdue {}) ignored messages {}\n",
               counters.rendered.load(), counters.sent.load(), counters.dropped.load(),
               counters.no_slot.load(), counters.overdue.load(), counters.ignored.load());
    if (const int code = save_truth(truth, options); code != kExitOk) return code;
    switch (end) {
        case ServerEnd::kCompleted:
            return kExitOk;
        case ServerEnd::kDisconnected:
            return refuse(fmt::format("the daemon hung up after {} of {} frames", counters.sent.load(),
                                      world.frame_count()),
                          kExitDevice);
        case ServerEnd::kNoDaemon:
            return refuse(
                fmt::format("no daemon came to {} within {} s", options.serve, options.connect_timeout_s),
                kExitDevice);
        case ServerEnd::kStopped:
            return kExitInterrupted;
        case ServerEnd::kFailed:
            break;
    }
    return refuse(server.fault(), kExitDevice);
}

// One thread, all cameras, posing included: what real time has to pay. Processor time, for on a machine that
// has other work the wall clock measures the others as well.
int benchmark(const World& world, const CameraControl& control) {
    WorldRenderer renderer(world);
    std::vector<std::uint8_t> image(world.image_bytes());
    std::vector<MarkerSight> sights(world.marker_count());
    const std::size_t frames = std::min<std::size_t>(world.frame_count(), 240);
    const auto cpu_ms = [] {
        timespec now{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
        return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
    };
    const auto start = std::chrono::steady_clock::now();
    std::vector<double> ms;
    for (std::size_t frame = 0; frame < frames && !interrupted(); ++frame) {
        const double before = cpu_ms();
        for (std::size_t camera = 0; camera < world.cameras().size(); ++camera) {
            renderer.render(frame, camera, control, image, sights);
        }
        ms.push_back((cpu_ms() - before) / static_cast<double>(world.cameras().size()));
    }
    if (ms.empty()) return kExitInterrupted;
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    const double images = static_cast<double>(ms.size() * world.cameras().size());
    double sum = 0.0;
    for (const double one : ms) sum += one;
    std::sort(ms.begin(), ms.end());
    fmt::print(
        "{:.0f} images/s of {}x{} on one thread by processor time, {:.0f} by the wall clock\n"
        "ms per image: least {:.2f}, median {:.2f}, mean {:.2f} ({} frames x {} cameras, {} triangles)\n",
        1e3 * static_cast<double>(ms.size()) / sum, world.cameras()[0].width_px, world.cameras()[0].height_px,
        images / wall.count(), ms.front(), ms[ms.size() / 2], sum / static_cast<double>(ms.size()), ms.size(),
        world.cameras().size(), world.face().triangles().size());
    return kExitOk;
}

int run_world(WorldOptions& options) {
    if (options.rig_cameras.empty()) {
        options.world.cameras = default_helmet(options.cameras);
    } else {
        const auto helmet = load_helmet(options.rig_cameras);
        if (!helmet) return refuse(helmet.error().message, kExitInput);
        options.world.cameras = *helmet;
    }
    if (options.serve.empty() && options.images.empty() && options.calibration.empty() &&
        !options.benchmark) {
        return refuse("say what to do: --serve SOCKET, --images DIR, --calibration FILE or --benchmark",
                      kExitUsage);
    }
    if (!options.calibration.empty()) {
        const auto saved = save_helmet(options.calibration, options.world.cameras,
                                       options.world.dot_radius_mm, options.layout);
        if (!saved) return refuse(saved.error().message, kExitOutput);
        if (options.serve.empty() && options.images.empty() && !options.benchmark) return kExitOk;
    }
    const auto world = make_world(options);
    if (!world) return refuse(world.error().message, kExitInput);
    if (options.benchmark) return benchmark(**world, options.control);
    std::unique_ptr<TruthRecorder> truth;
    if (!options.truth.empty()) truth = std::make_unique<TruthRecorder>(**world);
    if (!options.images.empty()) return write_images(**world, options, truth.get());
    return serve(**world, options, truth.get());
}

void add_scene_options(CLI::App& verb, WorldOptions& options) {
    verb.add_option("--rig", options.rig, "rig folder: the head")->type_name("DIR");
    verb.add_option("--take", options.take, "performance: a weights CSV")->type_name("FILE");
    verb.add_option("--layout", options.layout, "marker layout of the rig, or a layout file")
        ->capture_default_str()
        ->type_name("N|FILE");
    verb.add_option("--cameras", options.cameras, "cameras of the built-in helmet")
        ->check(CLI::Range(1, 4))
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--rig-cameras", options.rig_cameras, "a helmet of your own: its cameras.json")
        ->type_name("FILE");
    const std::map<std::string, DotStyle> styles = {{"ink", DotStyle::kInk}, {"retro", DotStyle::kRetro}};
    verb.add_option("--style", options.world.style, "dark ink dots, or retro-reflective ones: ink or retro")
        ->transform(CLI::CheckedTransformer(styles, CLI::ignore_case).description(""))
        ->default_str("ink")
        ->type_name("STYLE");
    const std::map<std::string, SlipKind> slips = {
        {"none", SlipKind::kNone}, {"gentle", SlipKind::kGentle}, {"hard", SlipKind::kHard}};
    verb.add_option("--slip", options.world.slip,
                    "how the helmet moves on the head: none, gentle (to 1.5 deg, 4 mm) or hard (3 deg, 8 mm)")
        ->transform(CLI::CheckedTransformer(slips, CLI::ignore_case).description(""))
        ->default_str("gentle")
        ->type_name("KIND");
    verb.add_option("--seed", options.world.seed, "of slip, skin and noise")
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--start", options.world.start_frame, "first frame of the take")
        ->capture_default_str()
        ->type_name("F");
    verb.add_option("--frames", options.world.frame_count, "frames to make; 0: to the end of the take")
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--rate", options.world.rate_hz, "frames per second of the cameras")
        ->capture_default_str()
        ->type_name("HZ");
    verb.add_option("--dot-radius", options.world.dot_radius_mm, "of the painted dots, mm")
        ->capture_default_str()
        ->type_name("MM");
    verb.add_option("--defocus", options.world.defocus_px, "blur of the lens, standard deviation, px")
        ->capture_default_str()
        ->type_name("PX");
    verb.add_option("--noise", options.world.noise, "factor on shot and read noise")
        ->capture_default_str()
        ->type_name("X");
}

void add_output_options(CLI::App& verb, WorldOptions& options) {
    auto* served =
        verb.add_option("--serve", options.serve, "serve a daemon at this Unix socket")->type_name("SOCKET");
    const std::map<std::string, sim::WorldPace> paces = {{"lockstep", sim::WorldPace::kLockstep},
                                                         {"realtime", sim::WorldPace::kRealTime}};
    verb.add_option("--pace", options.pace, "lockstep (simulated clock, as fast as both can) or realtime")
        ->transform(CLI::CheckedTransformer(paces, CLI::ignore_case).description(""))
        ->default_str("lockstep")
        ->type_name("PACE");
    verb.add_option("--press", options.presses, "press a button: neutral, record or presence, @ and time")
        ->type_name("LINE@TIME");
    verb.add_option("--slots", options.slots, "image sets in the shared ring")
        ->check(CLI::Range(4, 64))
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--threads", options.threads, "rendering threads")
        ->check(CLI::Range(1, 4))
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--readout-ms", options.readout_ms, "real time: from end of exposure to delivery")
        ->check(CLI::Range(0.0, 1000.0))
        ->capture_default_str()
        ->type_name("MS");
    verb.add_option("--connect-timeout", options.connect_timeout_s, "give up when no daemon comes; 0: wait")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str()
        ->type_name("S");
    verb.add_option("--images", options.images, "write image files, cameras.json and truth.csv there")
        ->excludes(served)
        ->type_name("DIR");
    verb.add_flag("--png", options.png, "PNG instead of PGM");
    verb.add_option("--step", options.step, "every N-th frame only, with --images")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str()
        ->type_name("N");
    verb.add_option("--exposure-us", options.control.exposure_us, "with --images")
        ->check(CLI::Range(0.0F, 100000.0F))
        ->capture_default_str()
        ->type_name("US");
    verb.add_option("--gain-db", options.control.gain_db, "with --images")
        ->check(CLI::Range(-20.0F, 48.0F))
        ->capture_default_str()
        ->type_name("DB");
    verb.add_option("--truth", options.truth, "write the truth of the run there, to compare with")
        ->type_name("DIR");
    verb.add_option("--calibration", options.calibration, "write the helmet's cameras.json")
        ->type_name("FILE");
    verb.add_flag("--benchmark", options.benchmark, "render without output and print images per second");
}

}  // namespace

void add_world_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<WorldOptions>();
    CLI::App* verb =
        app.add_subcommand("world", "Render what the helmet's cameras see: files, or live for the daemon");
    add_scene_options(*verb, *options);
    add_output_options(*verb, *options);
    verb->footer(
        "Exit codes: 5 when the daemon hung up or never came, 3 for bad input, 4 when a file cannot be "
        "written.\nExamples:\n"
        "  headrig world --rig sample --take sample/take.csv --frames 3 --images out/pictures --png\n"
        "  headrig world --calibration cameras.json --cameras 2\n"
        "  headrig world --rig sample --take sample/take.csv --serve /tmp/world.sock --pace realtime --truth "
        "out/truth");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_world(*options);
    });
}

}  // namespace rig::host
