// headrig monitor: live weights and health in the terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <memory>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/links/session_text.hpp"
#include "firmware_host/companion/monitor/screen.hpp"
#include "firmware_host/companion/monitor/terminal.hpp"

namespace rig::host {

namespace {

constexpr double kForever_s = 1.0e9;
constexpr double kDrawEvery_s = 0.05;
constexpr double kLineEvery_s = 1.0;
constexpr std::int64_t kRateWindow_us = 1'000'000;

struct MonitorOptions {
    std::string link;
    double seconds = kForever_s;
    std::uint16_t divider = 1;
};

// What the callbacks gather between two pictures.
struct Gathered {
    MonitorModel model;
    std::deque<std::int64_t> arrivals_us;  // of the last second
    std::uint64_t states = 0;
};

SessionEvents gather_into(Gathered& gathered) {
    SessionEvents events;
    events.state = [&gathered](const ReceivedState& received) {
        gathered.model.state = received.state;
        gathered.model.latency_us = received.latency_us;
        gathered.arrivals_us.push_back(received.received_us);
        ++gathered.states;
    };
    events.status = [&gathered](const Health& health) { gathered.model.health = health; };
    events.event = [&gathered](const EventMessage& event) { gathered.model.last_event = event_line(event); };
    return events;
}

const MonitorModel& refreshed(Gathered& gathered, const LinkSession& link, const HostSession& session) {
    const std::int64_t now_us = host_now_us();
    auto& arrivals = gathered.arrivals_us;
    while (!arrivals.empty() && now_us - arrivals.front() > kRateWindow_us) arrivals.pop_front();
    MonitorModel& model = gathered.model;
    model.link = link.link_text();
    model.phase = session.phase();
    model.refusal = session.refusal();
    model.hello = session.hello();
    model.shape_names = session.shape_names();
    model.rate_hz = static_cast<double>(arrivals.size()) * 1.0e6 / static_cast<double>(kRateWindow_us);
    model.counters = session.counters();
    model.bad_frames = session.frames().bad();
    return model;
}

// Shows until Ctrl-C or the end of the time; `show` is called every `period_s`.
void watch(LinkSession& link, double seconds, double period_s, const std::function<void(double)>& show) {
    const std::int64_t started_us = host_now_us();
    double elapsed_s = 0.0;
    while (elapsed_s < seconds && !interrupted()) {
        const double next_s = std::min(seconds, elapsed_s + period_s);
        // A refusal is shown, not an end: the owner may leave.
        while (elapsed_s < next_s && !interrupted()) {
            (void)link.run([] { return false; }, next_s - elapsed_s, LinkSession::Refusal::kIsWaitedFor);
            elapsed_s = static_cast<double>(host_now_us() - started_us) * 1.0e-6;
        }
        show(elapsed_s);
    }
}

int run_monitor(const MonitorOptions& options) {
    Gathered gathered;
    SessionOptions wanted;
    wanted.streams = kStreamWeights | kStreamStatus | kStreamHead;
    wanted.weights_divider = options.divider;
    const auto link = LinkSession::open(options.link, wanted, gather_into(gathered));
    if (!link) return kExitDevice;
    HostSession& session = link->session();
    if (can_draw()) {
        AlternateScreen screen;
        watch(*link, options.seconds, kDrawEvery_s, [&](double) {
            screen.draw(monitor_screen(refreshed(gathered, *link, session), screen.size(), true));
        });
    } else {
        watch(*link, options.seconds, kLineEvery_s, [&](double elapsed_s) {
            fmt::print("{}\n", monitor_line(refreshed(gathered, *link, session), elapsed_s));
            std::fflush(stdout);
        });
    }
    session.leave();
    if (gathered.states > 0) return kExitOk;
    if (interrupted()) return kExitInterrupted;
    const bool refused = session.phase() == SessionPhase::kRefused;
    return report_end(refused ? LinkSession::End::kRefused : LinkSession::End::kTimeout, *link);
}

}  // namespace

void add_monitor_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<MonitorOptions>();
    CLI::App* verb = app.add_subcommand("monitor", "Live bars of weights and health in the terminal");
    add_link_option(*verb, options->link)->required();
    verb->add_option("--seconds", options->seconds, "end after this time; default: Ctrl-C")
        ->check(CLI::Range(0.1, kForever_s))
        ->default_str("")
        ->type_name("S");
    verb->add_option("--divider", options->divider, "show every n-th tick only, for slow lines")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000))
        ->type_name("N");
    verb->footer(
        "Weights whose confidence is under one half are dim; '<' and '>' mark weights beyond 0..1. Waits for "
        "a rig that "
        "goes away. On a pipe it prints one plain line a second.\nExamples:\n"
        "  headrig monitor --link serial:/dev/ttyACM0@3000000\n"
        "  headrig monitor --link /dev/pts/5 --seconds 60 > health.log\n"
        "Exit codes: 0 ended by you or by --seconds, 5 no rig answered, 130 Ctrl-C before anything was "
        "received.");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_monitor(*options);
    });
}

}  // namespace rig::host
