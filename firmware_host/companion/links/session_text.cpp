#include "firmware_host/companion/links/session_text.hpp"

#include <fmt/format.h>

#include <array>

#include "firmware_host/companion/links/fault_text.hpp"

namespace rig::host {

namespace {

constexpr double kMicrosecondsPerMs = 1000.0;
constexpr double kMicrosecondsPerS = 1.0e6;

std::string spread_text(const TimeSpread& spread) {
    return fmt::format("p50 {:.1f} ms, p99 {:.1f} ms, max {:.1f} ms", spread.p50_us / kMicrosecondsPerMs,
                       spread.p99_us / kMicrosecondsPerMs, spread.max_us / kMicrosecondsPerMs);
}

std::string pack_text(const Hello& hello) {
    if (!hello.pack_loaded) return "none loaded: train one and give it to headrigd";
    std::string hash;
    for (const std::uint8_t byte : hello.pack_hash) hash += fmt::format("{:02x}", byte);
    return fmt::format("{}{}, {} shapes, {} markers", hash, hello.pack_unsigned ? " (unsigned)" : "",
                       hello.shape_count, hello.marker_count);
}

}  // namespace

std::string_view state_word(TrackingState state) {
    constexpr std::array<std::string_view, 5> kWords = {"SAFE", "LOST", "HOLD", "PARTIAL", "LIVE"};
    const auto index = static_cast<std::size_t>(state);
    return index < kWords.size() ? kWords[index] : "?";
}

std::string_view camera_word(CameraStatus status) {
    constexpr std::array<std::string_view, 6> kWords = {"unused", "good",   "missing",
                                                        "gone",   "frozen", "exposure"};
    const auto index = static_cast<std::size_t>(status);
    return index < kWords.size() ? kWords[index] : "?";
}

std::string_view head_word(HeadStatus status) {
    constexpr std::array<std::string_view, 7> kWords = {"no face",
                                                        "known",
                                                        "too few markers",
                                                        "markers in a plane",
                                                        "behind the cameras",
                                                        "uncertain",
                                                        "the markers disagree"};
    const auto index = static_cast<std::size_t>(status);
    return index < kWords.size() ? kWords[index] : "?";
}

std::vector<std::string> hello_lines(const Hello& hello) {
    std::vector<std::string> lines;
    lines.push_back(fmt::format("rig: {}", hello.serial.view().empty() ? "(no name)" : hello.serial.view()));
    lines.push_back(fmt::format("board: {}{}", hello.board.view(),
                                (hello.capabilities & kIsSimulated) != 0 ? " (simulated)" : ""));
    lines.push_back(fmt::format("firmware: {}", hello.firmware.view()));
    lines.push_back(fmt::format("protocol: {} to {} (this program: {})", hello.protocol_min,
                                hello.protocol_max, kWireProtocol));
    lines.push_back(fmt::format("session: {:08x}", hello.session_id));
    lines.push_back(fmt::format("rate: {:.3f} Hz", hello.rate_mhz / 1000.0));
    lines.push_back("pack: " + pack_text(hello));
    return lines;
}

std::vector<std::string> health_lines(const Health& health) {
    std::vector<std::string> lines;
    lines.push_back(fmt::format("state: {}", state_word(health.state)));
    lines.push_back(fmt::format("up: {:.1f} s", static_cast<double>(health.uptime_us) / kMicrosecondsPerS));
    lines.push_back(fmt::format("ticks: {} (solved {}, held {}, overrun {})", health.ticks, health.solved,
                                health.held, health.overruns));
    lines.push_back(fmt::format("link: sent {}, replaced by newer {}, received {}, refused {}",
                                health.frames_sent, health.frames_dropped, health.rx_good, health.rx_bad));
    lines.push_back("solve: " + spread_text(health.solve));
    lines.push_back("exposure to link: " + spread_text(health.latency));
    lines.push_back(fmt::format("memory: peak {:.1f} MB, heap calls after start-up {}",
                                health.peak_memory_kb / 1024.0, health.heap_calls_after_seal));
    if (health.temperature_dc != kTemperatureUnknown) {
        lines.push_back(fmt::format("temperature: {:.1f} C", health.temperature_dc / 10.0));
    }
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        if (health.camera_good[c] == 0 && health.camera_missing[c] == 0) continue;
        lines.push_back(fmt::format("camera {}: good {}, missing {}, spots in the last frame {}", c,
                                    health.camera_good[c], health.camera_missing[c], health.observations[c]));
    }
    lines.push_back(fmt::format("markers: {} seen in the last frame, {} swaps repaired, found anew {} times",
                                health.markers_seen, health.swaps_repaired, health.bootstraps));
    return lines;
}

std::vector<std::string> fault_lines(const Health& health) {
    std::vector<std::string> lines;
    for (int number = 1; number <= 64; ++number) {
        const bool now = ((health.faults >> (number - 1)) & 1U) != 0;
        const std::uint16_t count = health.fault_counts[static_cast<std::size_t>(number - 1)];
        if (!now && count == 0) continue;
        lines.push_back(fmt::format("{} {} ({} time{}): {}", fault_code(number), now ? "now" : "past", count,
                                    count == 1 ? "" : "s", fault_text(number)));
    }
    return lines;
}

std::string event_line(const EventMessage& event) {
    if (event.kind == EventKind::kLog) return std::string(event.text.view());
    const std::string camera = event.camera == kNoCamera ? "" : fmt::format(", camera {}", event.camera);
    const std::string_view text = event.text.view().empty() ? fault_text(event.fault) : event.text.view();
    return fmt::format("fault {} {}{}, {} times: {}",
                       event.kind == EventKind::kFaultRaised ? "raised" : "cleared", fault_code(event.fault),
                       camera, event.count, text);
}

}  // namespace rig::host
