#include "firmware_host/companion/commands/link_session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <limits>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/links/link_spec.hpp"

namespace rig::host {

namespace {

constexpr std::int64_t kPollEvery_us = 1000;

// Differs between runs of one host, which is all that a board needs it for.
std::uint32_t own_session_id() {
    return static_cast<std::uint32_t>(host_now_us()) ^ (static_cast<std::uint32_t>(getpid()) << 16);
}

std::string silence_text(LinkSession& link) {
    const FrameCounters& frames = link.session().frames();
    if (link.session().phase() == SessionPhase::kClosed) {
        return fmt::format(
            "{}: the link was closed by the other side: is the cable in, and headrigd running?",
            link.link_text());
    }
    if (frames.good > 0) return fmt::format("{}: the rig stopped answering", link.link_text());
    if (frames.bad() > 0) {
        return fmt::format(
            "{}: bytes arrive but no whole frame ({} damaged): is the rate right, is this a rig?",
            link.link_text(), frames.bad());
    }
    return fmt::format("{}: no rig answers: is headrigd running, and is this its port?", link.link_text());
}

}  // namespace

CLI::Option* add_link_option(CLI::App& verb, std::string& link) {
    const auto well_formed = [](const std::string& text) {
        const auto spec = parse_link_spec(text);
        return spec ? std::string() : spec.error().message;
    };
    return verb.add_option("-l,--link", link, "where the rig is: " + std::string(kLinkSpecHelp))
        ->check(CLI::Validator(well_formed, ""))
        ->type_name("LINK");
}

CLI::Option* add_timeout_option(CLI::App& verb, double& timeout_s) {
    return verb.add_option("--timeout", timeout_s, "how long to wait for an answer, s")
        ->capture_default_str()
        ->check(CLI::Range(0.1, 3600.0))
        ->type_name("S");
}

std::int64_t host_now_us() {
    static const std::unique_ptr<Clock> clock = host_clock();
    return clock->now_us();
}

std::unique_ptr<LinkSession> LinkSession::open(const std::string& link, SessionOptions options,
                                               SessionEvents events) {
    auto opened = open_link(link);
    if (!opened) {
        print_error(opened.error().message);
        return nullptr;
    }
    options.session_id = own_session_id();
    options.version = RIG_VERSION;
    return std::unique_ptr<LinkSession>(
        new LinkSession(link, std::move(*opened), std::move(options), std::move(events)));
}

LinkSession::End LinkSession::run_until_ready(double timeout_s) {
    return run([this] { return session_.phase() == SessionPhase::kReady; }, timeout_s);
}

LinkSession::End LinkSession::run(const std::function<bool()>& done, double timeout_s, Refusal refusal) {
    const std::unique_ptr<Clock> clock = host_clock();
    constexpr double kForever_s = 1.0e9;
    const std::int64_t end_us =
        clock->now_us() +
        static_cast<std::int64_t>((timeout_s < kForever_s ? timeout_s : kForever_s) * 1.0e6);
    while (true) {
        const std::int64_t now_us = clock->now_us();
        session_.poll(now_us);
        if (done()) return End::kDone;
        if (interrupted()) return End::kInterrupted;
        if (refusal == Refusal::kEnds && session_.phase() == SessionPhase::kRefused) return End::kRefused;
        if (now_us >= end_us) return End::kTimeout;
        clock->sleep_until_us(now_us + kPollEvery_us);
    }
}

int report_end(LinkSession::End end, LinkSession& link) {
    switch (end) {
        case LinkSession::End::kDone:
            return kExitOk;
        case LinkSession::End::kInterrupted:
            return kExitInterrupted;
        case LinkSession::End::kRefused:
            print_error(fmt::format("{}: {}", link.link_text(), link.session().refusal()));
            return kExitDevice;
        case LinkSession::End::kTimeout:
            break;
    }
    print_error(silence_text(link));
    return kExitDevice;
}

}  // namespace rig::host
