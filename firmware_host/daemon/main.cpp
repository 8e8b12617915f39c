#include <fmt/format.h>

#include <cstdio>
#include <system_error>

#include "firmware_host/daemon/command_line.hpp"
#include "firmware_host/daemon/heap_guard.hpp"
#include "firmware_host/daemon/wiring.hpp"

namespace {

void print_error(const std::string& message) {
    fmt::print(stderr, "headrigd: {}\n", message);
}

void print_summary(const rig::Wiring& wiring, const rig::Health& health) {
    fmt::print(
        stderr,
        "headrigd: {} ticks, {} solved, {} held, {} sent, {} replaced; solve p50 {:.1f} ms, p99 {:.1f} ms, "
        "max {:.1f} ms; {} heap calls after seal{}\n",
        health.ticks, health.solved, health.held, health.frames_sent, health.frames_dropped,
        health.solve.p50_us * 1e-3, health.solve.p99_us * 1e-3, health.solve.max_us * 1e-3,
        health.heap_calls_after_seal, rig::heap_guard_is_active() ? "" : " (not watched in this build)");
    if (wiring.unrecorded_ticks() > 0) {
        print_error(
            fmt::format("{} ticks are missing in the observation log: the disk was too slow or is full",
                        wiring.unrecorded_ticks()));
    }
}

int run(int argc, char** argv) {
    rig::CommandLine command_line;
    int exit_code = rig::kExitOk;
    if (!rig::parse_command_line(argc, argv, command_line, exit_code)) return exit_code;
    auto wiring = rig::Wiring::build(command_line);
    if (!wiring) {
        print_error(wiring.error().message);
        return wiring.error().exit_code;
    }
    const rig::AppEnd end = (*wiring)->run();
    const rig::Health health = (*wiring)->app().health();
    print_summary(**wiring, health);
    if (command_line.digest) {
        const rig::StreamDigest& digest = (*wiring)->app().digest();
        fmt::print("digest {:016x} over {} ticks\n", digest.value(), digest.ticks());
    }
    if (end != rig::AppEnd::kWorldGone) return rig::kExitOk;
    print_error((*wiring)->world_fault() + "; start it again, then the daemon");
    return rig::kExitWorld;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::system_error& error) {  // what fmt throws when it cannot print
        print_error(fmt::format("standard output: {}", error.what()));
        return rig::kExitOutput;
    }
}
