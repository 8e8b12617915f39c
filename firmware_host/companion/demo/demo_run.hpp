// The main job from end to end on one machine: world -> daemon -> serial line -> host, judged against the
// truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "firmware_host/companion/demo/accuracy.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/companion/world/world_server.hpp"

namespace rig::host {

struct DemoOptions {
    std::filesystem::path rig_folder;
    std::filesystem::path take_csv;
    std::string layout = "60";
    std::filesystem::path out_folder;
    std::filesystem::path daemon;  // the headrigd to run
    double seconds = 20.0;         // of performance; 0: to the end of the take
    std::size_t start_frame = 0;
    std::size_t camera_count = 2;
    DotStyle style = DotStyle::kInk;
    SlipKind slip = SlipKind::kGentle;
    SolverKind solver = SolverKind::kBoxQp;
    std::uint64_t seed = 1;
    bool real_time = false;
};

struct LatencyFigures {
    double p50_ms = 0.0;
    double p99_ms = 0.0;
    double max_ms = 0.0;
};

struct DemoFigures {
    std::uint64_t frames = 0;    // of the performance
    std::uint64_t rendered = 0;  // frame sets
    std::uint64_t not_sent = 0;  // real time: frames that the world dropped, machine too slow
    std::uint64_t solved = 0;    // ticks of the daemon with a solve
    std::uint64_t sent = 0;      // wire frames of the daemon
    std::uint64_t received = 0;  // states
    std::uint64_t lost = 0;      // frames of the world for which no state arrived
    std::uint64_t bad_wire = 0;  // wire frames the host refused
    double wall_s = 0.0;
    double solved_per_s = 0.0;
    LatencyFigures latency;
    AccuracyFigures accuracy;
    std::uint64_t heap_calls_after_seal = 0;
    std::int64_t peak_memory_kb = 0;  // of the daemon
    double solve_p50_ms = 0.0;        // images in hand to state, on the daemon
    double solve_p99_ms = 0.0;
    double solve_max_ms = 0.0;
    std::uint64_t digest = 0;           // of the states as received
    std::uint64_t replayed_digest = 0;  // of the observation log solved again here
};

// Accuracy and losses, never times. From the issue that asked for the demo.
struct DemoBounds {
    double weight_rms = 0.06;
    double marker_rms_mm = 0.25;
    double live_share = 0.95;  // of the frames, with a solve behind them
};

// One line for each bound that does not hold; empty when all do. Losses count in lockstep only: in real time
// they measure the machine.
[[nodiscard]] std::vector<std::string> broken_bounds(const DemoFigures& figures, const DemoBounds& bounds,
                                                     bool real_time);

struct DemoEvents {
    std::function<void(const std::string& step)> step;
    std::function<void(std::uint64_t done, std::uint64_t total)> progress;
    std::function<bool()> interrupted;
};

// Writes into out_folder: face.pack, cameras.json, take.rgo, weights.csv, overlay.png, curves.png,
// headrigd.log.
[[nodiscard]] Result<DemoFigures, FileError> run_demo(const DemoOptions& options, const DemoEvents& events);

}  // namespace rig::host
