// headrig info: who is behind a link, or what a recording holds.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/links/recording.hpp"
#include "firmware_host/companion/links/session_text.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kClockSamples = 5;  // 100 ms, for the shortest round trip among them

struct InfoOptions {
    std::string link;
    std::string recording;
    double timeout_s = kAnswerTimeout_s;
};

void print_names(std::string_view what, const std::vector<std::string>& names) {
    if (names.empty()) return;
    fmt::print("{} ({}):", what, names.size());
    for (const std::string& name : names) fmt::print(" {}", name);
    fmt::print("\n");
}

void print_hello(const Hello& hello) {
    for (const std::string& line : hello_lines(hello)) fmt::print("{}\n", line);
}

std::string_view message_word(MessageType type) {
    switch (type) {
        case MessageType::kHello:
            return "hello";
        case MessageType::kNames:
            return "names";
        case MessageType::kTimeReply:
            return "time replies";
        case MessageType::kWeights:
            return "weights";
        case MessageType::kHeadPose:
            return "head poses";
        case MessageType::kMarkers:
            return "markers";
        case MessageType::kStatus:
            return "status";
        case MessageType::kEvent:
            return "events";
        case MessageType::kAck:
            return "answers";
        default:
            return "others";
    }
}

int info_of_recording(const std::string& path) {
    auto reader = RecordingReader::open(path);
    if (!reader) {
        print_error(reader.error().message);
        return kExitInput;
    }
    const RecordingSummary summary = summarise(*reader);
    fmt::print("recording: {}\nlength: {:.3f} s, {} frames\nstates: {} (missing {})\n", path, summary.seconds,
               summary.frames, summary.states, summary.states_missing);
    std::map<std::string_view, std::uint64_t> by_word;
    for (const auto& [type, count] : summary.messages) by_word[message_word(type)] += count;
    fmt::print("frames by message:");
    for (const auto& [word, count] : by_word) fmt::print(" {} {}", word, count);
    fmt::print("\n");
    if (summary.hello) print_hello(*summary.hello);
    print_names("shapes", summary.shape_names);
    print_names("markers", summary.marker_names);
    if (summary.unread_bytes == 0 && summary.bad_frames == 0) return kExitOk;
    print_error(fmt::format(
        "{}: damaged or cut: {} entries hold no frame, {} bytes at the end are not whole; what is "
        "above can still be used",
        path, summary.bad_frames, summary.unread_bytes));
    return kExitInput;
}

int info_of_link(const InfoOptions& options) {
    SessionOptions wanted;
    wanted.streams = 0;
    const auto link = LinkSession::open(options.link, wanted, {});
    if (!link) return kExitDevice;
    HostSession& session = link->session();
    const auto end = link->run(
        [&] {
            return session.phase() == SessionPhase::kReady &&
                   session.time_sync().sample_count() >= kClockSamples;
        },
        options.timeout_s);
    if (session.hello()) {
        print_hello(*session.hello());
        print_names("shapes", session.shape_names());
        print_names("markers", session.marker_names());
    }
    if (session.time_sync().known()) {
        fmt::print("clocks: board ahead by {:.6f} s, round trip {:.3f} ms\n",
                   static_cast<double>(session.time_sync().offset_us()) * 1e-6,
                   static_cast<double>(session.time_sync().round_trip_us()) * 1e-3);
    }
    session.leave();
    return report_end(end, *link);
}

}  // namespace

void add_info_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<InfoOptions>();
    CLI::App* verb = app.add_subcommand("info", "Who is behind a link, or what a recording holds");
    CLI::Option* link = add_link_option(*verb, options->link);
    CLI::Option* file = verb->add_option("file", options->recording, "a recording of `headrig record --raw`");
    file->type_name("FILE.rec")->excludes(link);
    add_timeout_option(*verb, options->timeout_s);
    verb->footer(
        "Prints the rig's name, versions, pack, shapes and markers. Owns nothing: another host may stream "
        "meanwhile.\n"
        "Examples:\n  headrig info --link serial:/dev/ttyACM0@3000000\n  headrig info take.rec\n"
        "Exit codes: 0 told, 3 the file is damaged or not a recording, 5 no rig answers.");
    verb->callback([verb, options, &exit_code] {
        if (options->link.empty() && options->recording.empty()) {
            throw CLI::RequiredError(verb->get_name() + ": a FILE.rec or --link LINK");
        }
        install_interrupt_handler();
        exit_code = options->link.empty() ? info_of_recording(options->recording) : info_of_link(*options);
    });
}

}  // namespace rig::host
