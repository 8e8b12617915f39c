// What the verbs that talk to a rig share: the --link option, a session driven in real time until something
// happens, and the words for a rig that does not answer.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "firmware_host/companion/links/host_session.hpp"
#include "hal/byte_link.hpp"

namespace rig::host {

inline constexpr double kAnswerTimeout_s = 5.0;

CLI::Option* add_link_option(CLI::App& verb, std::string& link);
// --timeout, s; what it is for stands in the help of every verb in the same words.
CLI::Option* add_timeout_option(CLI::App& verb, double& timeout_s);

// A link and the session over it. Moves neither.
class LinkSession {
  public:
    // Null, after an error on standard error, when the link does not open.
    [[nodiscard]] static std::unique_ptr<LinkSession> open(const std::string& link, SessionOptions options,
                                                           SessionEvents events);

    enum class End : std::uint8_t { kDone, kTimeout, kInterrupted, kRefused };
    enum class Refusal : std::uint8_t { kEnds, kIsWaitedFor };
    // Polls until `done`, Ctrl-C, for timeout_s seconds, or until the board refuses the session. Sleeps at
    // most a millisecond at a time, so that the time of reception is good to that.
    End run(const std::function<bool()>& done, double timeout_s, Refusal refusal = Refusal::kEnds);
    // Until the board has answered.
    End run_until_ready(double timeout_s);

    [[nodiscard]] HostSession& session() { return session_; }
    [[nodiscard]] const std::string& link_text() const { return link_text_; }

  private:
    LinkSession(std::string link_text, std::unique_ptr<ByteLink> link, SessionOptions options,
                SessionEvents events)
        : link_text_(std::move(link_text)),
          link_(std::move(link)),
          session_(*link_, std::move(options), std::move(events)) {}

    std::string link_text_;
    std::unique_ptr<ByteLink> link_;
    HostSession session_;
};

// The host's monotonic clock, the one that sessions are polled with.
[[nodiscard]] std::int64_t host_now_us();

// Says on standard error why a run ended other than kDone, and returns the exit code for it.
int report_end(LinkSession::End end, LinkSession& link);

}  // namespace rig::host
