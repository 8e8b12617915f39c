// simulated_board --pty /tmp/rig | --udp 7777    a board that speaks the protocol and solves nothing, for
// trying the companion without a rig. Runs until it is ended.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "hal/linux/monotonic_clock.hpp"
#include "hal/linux/pty_link.hpp"
#include "hal/linux/udp_link.hpp"
#include "tests/support/wire/simulated_board.hpp"

int main(int argc, char** argv) {
    CLI::App app{"a board that speaks the protocol and solves nothing"};
    std::string pty;
    std::uint16_t udp = 0;
    double seconds = 1.0e9;
    rig::test::BoardOptions options;
    options.shape_count = 52;
    options.marker_count = 60;
    auto* pty_option = app.add_option("--pty", pty, "symlink to the pseudo-terminal");
    app.add_option("--udp", udp, "port on 127.0.0.1")->excludes(pty_option);
    app.add_option("--seconds", seconds, "end after this time");
    app.add_option("--shapes", options.shape_count)->check(CLI::Range(0, 256));
    app.add_option("--lose-every", options.lose_every, "lose every n-th frame");
    app.add_option("--faults", options.faults, "fault map");
    app.add_option("--ahead-us", options.clock_ahead_us, "clock of the board minus the host's");
    app.add_flag("--busy", options.busy, "refuse every owner");
    CLI11_PARSE(app, argc, argv);

    std::unique_ptr<rig::ByteLink> link;
    if (udp != 0) {
        const auto local = rig::resolve_udp("127.0.0.1", udp);
        if (local) link = std::make_unique<rig::UdpLink>(*local, rig::UdpAddress{});
    } else {
        link = std::make_unique<rig::PtyLink>(pty);
    }
    if (!link || !link->open()) {
        std::fprintf(stderr, "simulated_board: the link does not open\n");
        return 1;
    }
    rig::MonotonicClock clock;
    rig::test::SimulatedBoard board(*link, options);
    const std::int64_t end_us = clock.now_us() + static_cast<std::int64_t>(seconds * 1.0e6);
    while (clock.now_us() < end_us) {
        board.poll(clock.now_us());
        clock.sleep_until_us(clock.now_us() + 500);
    }
    return 0;
}
