#include "firmware_host/daemon/command_line.hpp"

#include <CLI/CLI.hpp>

#include <cstdlib>
#include <map>
#include <sstream>

namespace rig {

namespace {

constexpr const char* kFooter = R"(
Links:
  pty:PATH            a pseudo-terminal; PATH becomes a symlink to it (pty: alone: no symlink)
  serial:DEVICE@BAUD  a serial port, any rate the device can divide; @BAUD may be left out (115200)
  udp:HOST:PORT       datagrams to HOST, and only from there
  udp:PORT            datagrams on that port of this machine, with whoever spoke last

Examples:
  headrig world --rig rig --take take.csv --serve /tmp/world.sock &
  headrigd --world /tmp/world.sock --pack face.pack --link pty:/tmp/headrig
  headrigd --world /tmp/world.sock --pack face.pack --link udp:192.168.1.20:9700 --stream weights,status
  headrigd --world /tmp/world.sock --pack face.pack --digest --log-observations take.rgo

Without a pack, or with one that is refused, the daemon runs in SAFE: rest pose, confidence 0, control alive.
It ends by SIGTERM or SIGINT, or when the world ends; either way the host gets a last status and a goodbye.

Exit codes:
  0  stopped by a signal, or the world came to its end
  1  a bug of headrigd
  2  the command line is wrong
  3  the board file, the fault plan, or with --require-pack the pack cannot be used
  4  the link to the host cannot be opened
  5  no world answers, or it went away before its end
  6  a file cannot be written

Environment:
  RIG_BOARDS            folder of the boards, unless --boards is given
  RIG_HEAP_GUARD=abort  end at the first heap call after start-up (for tests)
)";

template <class Value>
using Choices = std::map<std::string, Value>;

template <class Value>
void add_choice(CLI::App& app, const std::string& name, const Choices<Value>& choices, Value& into,
                const std::string& help) {
    std::string words;
    for (const auto& [word, value] : choices) words += (words.empty() ? "" : "|") + word;
    app.add_option_function<std::string>(
           name, [&choices, &into](const std::string& word) { into = choices.at(word); }, help)
        ->check(CLI::IsMember(choices).description(""))
        ->type_name(words);
}

std::string default_boards() {
    const char* given = std::getenv("RIG_BOARDS");
    return given != nullptr ? given : RIG_BOARDS_FOLDER;
}

// "" when the list is good.
std::string read_streams(const std::string& list, StartStreams& streams) {
    const std::map<std::string, std::uint8_t> bits{{"weights", kStreamWeights},
                                                   {"markers", kStreamMarkers},
                                                   {"status", kStreamStatus},
                                                   {"head", kStreamHead}};
    std::istringstream words(list);
    std::string word;
    while (std::getline(words, word, ',')) {
        const auto found = bits.find(word);
        if (found == bits.end())
            return "'" + word + "' is no stream; there are weights, markers, status and head";
        streams.mask |= found->second;
    }
    return streams.mask == 0 ? "names no stream" : "";
}

void add_filter_options(CLI::App& app, FilterSettings& smoothing) {
    app.add_option_function<std::string>(
           "--filter", [&smoothing](const std::string& word) { smoothing.kind = filter_kind(word); },
           "Smoothing: none (as --no-filter), one-euro or savitzky-golay; the board's by default")
        ->check(CLI::IsMember({"none", "one-euro", "savitzky-golay"}).description(""))
        ->type_name("KIND")
        ->excludes("--no-filter");
    app.add_option("--window", smoothing.window_frames, "savitzky-golay: frames of a fit, 3 to 61 (15)")
        ->check(CLI::Range(3, static_cast<int>(kMaxWindowFrames)).description(""))
        ->type_name("FRAMES");
    app.add_option("--delay", smoothing.delay_frames,
                   "savitzky-golay: how far back the weights lie, below the window (half of it)")
        ->check(CLI::Range(0, static_cast<int>(kMaxWindowFrames) - 1).description(""))
        ->type_name("FRAMES");
}

void add_camera_options(CLI::App& app, CommandLine& into) {
    const Choices<MarkerPolarity> polarities{{"auto", MarkerPolarity::kAuto},
                                             {"dark", MarkerPolarity::kDark},
                                             {"bright", MarkerPolarity::kBright}};
    add_choice(app, "--polarity", polarities, into.pipeline.polarity,
               "What the markers are: auto, dark or bright");
    app.add_flag("!--cameras-off-head", into.pipeline.camera_on_head,
                 "The cameras stand beside the performer: stream where the head is, no slip of a helmet");
    app.add_flag("--auto-exposure", into.auto_exposure,
                 "Set exposure and gain of the cameras by the light at the markers");
    app.add_option("--max-exposure-us", into.most_exposure_us,
                   "Longest exposure that motion blur allows, microseconds; gain beyond")
        ->check(CLI::Range(100.0, 33000.0).description(""))
        ->capture_default_str()
        ->type_name("US");
    app.add_option("--mains", into.mains_hz, "Lamps flicker with the mains: 50 or 60 Hz; 0: they do not")
        ->check(CLI::IsMember({0, 50, 60}).description(""))
        ->capture_default_str()
        ->type_name("HZ");
}

}  // namespace

bool parse_command_line(int argc, char** argv, CommandLine& into, int& exit_code) {
    CLI::App app{"headrigd: sees markers, solves blendshape weights, streams them to a host"};
    app.footer(kFooter);
    app.get_formatter()->column_width(38);
    app.set_version_flag("--version", "headrigd " RIG_VERSION);
    into.boards_folder = default_boards();
    const Choices<ExecutorChoice> executors{{"auto", ExecutorChoice::kAuto},
                                            {"threads", ExecutorChoice::kThreads},
                                            {"lockstep", ExecutorChoice::kLockstep}};
    const Choices<LossPolicy> policies{{"hold", LossPolicy::kHold}, {"decay", LossPolicy::kDecay}};
    bool no_filter = false;
    bool no_stabilise = false;
    std::string streams;
    app.add_option("--board", into.board, "Board to run on: a name, or the path of a board.toml")
        ->capture_default_str();
    app.add_option("--boards", into.boards_folder, "Folder of the boards")->type_name("DIR");
    app.add_option("--world", into.world, "Socket of the simulated world that is behind this board")
        ->type_name("SOCKET");
    app.add_option("--world-timeout", into.world_timeout_s, "Seconds to wait for the world to answer")
        ->check(CLI::Range(0.0, 3600.0).description(""))
        ->capture_default_str()
        ->type_name("S");
    app.add_option("--pack", into.pack, "Solve pack of this performer and rig")->type_name("FILE");
    app.add_flag("--require-pack", into.require_pack,
                 "End with code 3 instead of running in SAFE without a good pack");
    app.add_option("--link", into.link, "Link to the host, see below; the board's own by default")
        ->type_name("LINK");
    app.add_option("--name", into.name, "Name or serial number, as the host sees it; up to 32 bytes")
        ->capture_default_str();
    add_choice(app, "--executor", executors, into.executor, "auto (as the world runs), threads or lockstep");
    app.add_option("--stream", streams,
                   "Streams to run without a host asking: weights,markers,status,head (with the weights)")
        ->type_name("LIST");
    app.add_option("--wait-host", into.wait_host_s,
                   "Seconds to wait, before the first tick, for a host to start a stream")
        ->check(CLI::Range(0.0, 3600.0).description(""))
        ->type_name("S");
    app.add_flag("--no-filter", no_filter, "No smoothing and no recovery blends");
    add_filter_options(app, into.smoothing);
    app.add_flag("--no-stabilise", no_stabilise, "Take the markers as already aligned with the face");
    add_choice(app, "--loss-policy", policies, into.pipeline.loss_policy,
               "When the face is lost: hold, or decay to rest");
    add_camera_options(app, into);
    app.add_option("--log-observations", into.log_observations,
                   "Record what detection sees, for headrig replay")
        ->type_name("FILE");
    app.add_option("--faults", into.faults,
                   "Fault plan to carry out on cameras and link, see hal/sim/fault_plan.hpp")
        ->type_name("FILE");
    app.add_flag("--digest", into.digest, "Print a digest of the weight stream at the end");
    app.add_flag("--real-time", into.real_time,
                 "Lock memory and take a real-time priority (needs permission)");
    try {
        app.parse(argc, argv);
        if (!streams.empty()) {
            if (const auto fault = read_streams(streams, into.streams); !fault.empty()) {
                throw CLI::ValidationError("--stream", fault);
            }
        }
    } catch (const CLI::ParseError& error) {
        exit_code = app.exit(error) == 0 ? kExitOk : kExitUsage;
        return false;
    }
    into.pipeline.filter = !no_filter;
    into.pipeline.stabilise = !no_stabilise;
    return true;
}

}  // namespace rig
