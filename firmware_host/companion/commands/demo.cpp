// headrig demo: the main job from end to end, with a summary and an exit code.
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/demo/demo_run.hpp"

namespace rig::host {

namespace {

// The daemon that was built with this program, beside it; otherwise the one on the path.
std::filesystem::path default_daemon() {
    std::error_code fault;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", fault);
    if (!fault) {
        const auto beside = self.parent_path() / "headrigd";
        if (std::filesystem::exists(beside, fault)) return beside;
    }
    return "/usr/sbin/headrigd";
}

void print_summary(const DemoOptions& options, const DemoFigures& f) {
    const AccuracyFigures& a = f.accuracy;
    const auto row = [](const char* name, const std::string& value) {
        fmt::print("  {:<34} {}\n", name, value);
    };
    fmt::print("summary ({}, {} cameras, {})\n", options.take_csv.filename().string(), options.camera_count,
               options.real_time ? "real time" : "lockstep, as fast as it can");
    row("frames rendered", fmt::format("{} of {} by {} cameras", f.rendered, f.frames, options.camera_count));
    row("frames solved", fmt::format("{}", f.solved));
    row("wire frames sent", fmt::format("{}", f.sent));
    row("states received", fmt::format("{}", f.received));
    row("frames lost",
        fmt::format("{}{}", f.lost,
                    f.not_sent > 0 ? fmt::format(" (and {} never sent: machine too slow)", f.not_sent) : ""));
    row("solved frames per second", fmt::format("{:.1f} (performance at 60.0)", f.solved_per_s));
    row(options.real_time ? "latency, exposure to received" : "latency, frame in hand to received",
        fmt::format("p50 {:.2f} ms, p99 {:.2f} ms, max {:.2f} ms", f.latency.p50_ms, f.latency.p99_ms,
                    f.latency.max_ms));
    row("solve time on the daemon", fmt::format("p50 {:.2f} ms, p99 {:.2f} ms, max {:.2f} ms", f.solve_p50_ms,
                                                f.solve_p99_ms, f.solve_max_ms));
    row("3D marker error", fmt::format("{:.3f} mm rms over {} sightings", a.marker_rms_mm, a.markers_judged));
    row("identity errors", fmt::format("{}", a.identity_errors));
    row("weight error", fmt::format("{:.4f} rms over {} observable shapes (worst frame {:.3f})", a.weight_rms,
                                    a.observable_shapes, a.worst_frame_weight_rms));
    row("frames held", fmt::format("{} (no solve behind them)", a.frames_held));
    // In real time a machine that is too slow loses frames, so that the two digests are of different streams.
    if (!options.real_time)
        row("digest of the weight stream",
            fmt::format("{:016x}, replayed from the observations {:016x}", f.digest, f.replayed_digest));
    row("heap calls after seal", fmt::format("{}", f.heap_calls_after_seal));
    row("peak memory of the daemon",
        fmt::format("{:.1f} MB", static_cast<double>(f.peak_memory_kb) / 1024.0));
    row("written",
        fmt::format("{}/{{weights.csv, overlay.png, curves.png, face.pack, take.rgo, headrigd.log}}",
                    options.out_folder.string()));
}

int run(const DemoOptions& options) {
    install_interrupt_handler();
    std::unique_ptr<Progress> progress;
    DemoEvents events;
    events.step = [&](const std::string& step) {
        progress.reset();
        fmt::print(stderr, "demo: {}\n", step);
    };
    events.progress = [&](std::uint64_t done, std::uint64_t total) {
        if (!progress) progress = std::make_unique<Progress>("frames received", total);
        progress->update(done);
    };
    events.interrupted = [] { return interrupted(); };
    const auto figures = run_demo(options, events);
    progress.reset();
    if (!figures) {
        if (interrupted()) return kExitInterrupted;
        print_error(figures.error().message);
        return kExitInput;
    }
    print_summary(options, *figures);
    const auto broken = broken_bounds(*figures, DemoBounds{}, options.real_time);
    for (const std::string& line : broken) fmt::print("  NOT HELD: {}\n", line);
    if (broken.empty()) fmt::print("  all bounds hold\n");
    return broken.empty() ? kExitOk : kExitFailed;
}

}  // namespace

void add_demo_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<DemoOptions>();
    options->daemon = default_daemon();
    CLI::App* verb = app.add_subcommand(
        "demo", "Run the main job: simulated cameras, the daemon, a serial line, and the truth");
    verb->add_option("--rig", options->rig_folder, "Rig folder (`headrig sample DIR` writes one)")
        ->required()
        ->type_name("DIR");
    verb->add_option("--take", options->take_csv, "Performance: frame,time_s,<shapes>")
        ->required()
        ->type_name("CSV");
    options->out_folder = "out/demo";
    verb->add_option("--out", options->out_folder, "Folder for the results")
        ->capture_default_str()
        ->type_name("DIR");
    verb->add_option("--layout", options->layout, "Marker layout: 60 for markers_60.csv, or a file")
        ->capture_default_str();
    verb->add_option("--seconds", options->seconds, "Length of the performance, s; 0 = all of it")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 86400.0));
    verb->add_option("--start", options->start_frame, "First frame of the take")->capture_default_str();
    verb->add_option("--cameras", options->camera_count, "Cameras on the helmet")
        ->capture_default_str()
        ->check(CLI::Range(1, 4));
    verb->add_option("--style", options->style, "Dots: ink or retro")
        ->transform(CLI::CheckedTransformer(
                        std::map<std::string, DotStyle>{{"ink", DotStyle::kInk}, {"retro", DotStyle::kRetro}})
                        .description(""))
        ->default_str("ink");
    verb->add_option("--slip", options->slip, "How the helmet moves: none, gentle or hard")
        ->transform(CLI::CheckedTransformer(std::map<std::string, SlipKind>{{"none", SlipKind::kNone},
                                                                            {"gentle", SlipKind::kGentle},
                                                                            {"hard", SlipKind::kHard}})
                        .description(""))
        ->default_str("gentle");
    verb->add_option("--solver", options->solver, "boxqp, nnls, lsq or rbf")
        ->transform(
            CLI::CheckedTransformer(std::map<std::string, SolverKind>{{"boxqp", SolverKind::kBoxQp},
                                                                      {"nnls", SolverKind::kNonNegative},
                                                                      {"lsq", SolverKind::kLeastSquares},
                                                                      {"rbf", SolverKind::kRbf}})
                .description(""))
        ->default_str("boxqp");
    verb->add_option("--seed", options->seed, "Of noise and slip")->capture_default_str();
    verb->add_flag("--real-time", options->real_time, "At 60 frames per second instead of as fast as it can");
    verb->add_option("--daemon", options->daemon, "The headrigd to run")->type_name("FILE");
    verb->footer(
        "Examples:\n"
        "  headrig sample out/head && headrig demo --rig out/head --take out/head/take.csv\n"
        "  headrig demo --rig head/ --take take.csv --cameras 3 --style retro --slip hard --seconds 5\n"
        "Writes weights.csv, overlay.png, curves.png, face.pack, take.rgo and headrigd.log into the output "
        "folder.\n"
        "Exit codes: 0 every bound on accuracy and losses holds, 1 one does not, 2 wrong command line, 3 an "
        "input\n"
        "or the daemon failed, 130 interrupted.");
    verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace rig::host
