// headrig record: what a rig streams, into files.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/link_session.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/links/head_csv.hpp"
#include "firmware_host/companion/links/recording.hpp"
#include "firmware_host/companion/links/weights_csv.hpp"

namespace rig::host {

namespace {

constexpr double kForever_s = 1.0e9;
constexpr double kPatience_s = 5.0;  // with a rig that has gone silent in the middle

struct RecordOptions {
    std::string link;
    std::string out;
    std::string raw;
    std::string markers;
    double seconds = kForever_s;
    std::uint64_t frames = 0;  // 0: no limit
};

// Everything that is being written, and the first thing that went wrong with it.
struct Taking {
    std::optional<WeightsCsv> csv;
    std::optional<HeadCsv> head;  // of a rig whose cameras are not on it
    std::optional<RecordingWriter> raw;
    std::vector<std::uint32_t> sequences;                        // of the rows of the CSV
    std::unordered_map<std::uint32_t, std::size_t> marker_rows;  // sequence -> place in marker_values
    std::vector<float> marker_values;
    std::size_t marker_count = 0;
    std::vector<std::int64_t> latencies_us;
    std::uint64_t other_shape_counts = 0;
    std::int64_t last_state_us = 0;
    std::optional<FileError> fault;

    void keep(const Result<void, FileError>& result) {
        if (!result && !fault) fault = result.error();
    }
};

void take_state(Taking& taking, const ReceivedState& received) {
    if (!taking.csv) return;
    const auto added = taking.csv->add(received.state);
    if (!added) {
        if (!taking.fault) taking.fault = added.error();
        return;
    }
    taking.last_state_us = received.received_us;
    if (!*added) {
        ++taking.other_shape_counts;
        return;
    }
    taking.sequences.push_back(received.state.sequence);
    if (taking.head) taking.keep(taking.head->add(received.state));
    // A held state's capture is old by design; its age says so.
    if (received.latency_us && !received.state.held) taking.latencies_us.push_back(*received.latency_us);
}

void take_markers(Taking& taking, const MarkerFrame& frame) {
    if (taking.marker_count == 0) taking.marker_count = frame.marker_count;
    if (frame.marker_count != taking.marker_count) return;
    const std::size_t row = taking.marker_rows.size();
    if (!taking.marker_rows.try_emplace(frame.sequence, row).second) return;
    for (std::size_t i = 0; i < taking.marker_count; ++i) {
        const MarkerSample& sample = frame.markers[i];
        for (const float value : sample.position_mm) {
            taking.marker_values.push_back(sample.seen ? value : std::numeric_limits<float>::quiet_NaN());
        }
    }
}

// One row per row of the CSV; all NaN where the markers of a tick did not arrive.
Result<void, FileError> save_markers(const Taking& taking, const std::string& path) {
    const std::size_t width = taking.marker_count * 3;
    NpyArray<float> array;
    array.shape = {taking.sequences.size(), taking.marker_count, 3};
    array.values.assign(taking.sequences.size() * width, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t row = 0; row < taking.sequences.size(); ++row) {
        const auto found = taking.marker_rows.find(taking.sequences[row]);
        if (found == taking.marker_rows.end()) continue;
        const auto from = taking.marker_values.begin() + static_cast<std::ptrdiff_t>(found->second * width);
        std::copy_n(from, width, array.values.begin() + static_cast<std::ptrdiff_t>(row * width));
    }
    return write_npy(path, array);
}

SessionEvents events_into(Taking& taking) {
    SessionEvents events;
    events.state = [&taking](const ReceivedState& received) { take_state(taking, received); };
    events.markers = [&taking](const MarkerFrame& frame, std::int64_t) { take_markers(taking, frame); };
    events.raw = [&taking](ByteSpan frame, std::int64_t received_us) {
        if (taking.raw) taking.keep(taking.raw->add(frame, received_us));
    };
    return events;
}

std::string latency_summary(std::vector<std::int64_t> latencies_us) {
    if (latencies_us.empty()) return "latency unknown";
    std::sort(latencies_us.begin(), latencies_us.end());
    const auto at = [&](double fraction) {
        const auto index = static_cast<std::size_t>(fraction * static_cast<double>(latencies_us.size() - 1));
        return static_cast<double>(latencies_us[index]) * 1e-3;
    };
    return fmt::format("latency exposure to received p50 {:.1f} ms, p99 {:.1f} ms, max {:.1f} ms", at(0.5),
                       at(0.99), at(1.0));
}

void print_summary(const RecordOptions& options, const Taking& taking, const HostSession& session) {
    const SessionCounters& counters = session.counters();
    fmt::print("{}: {} states of {} shapes, missing {}, frames lost {}, damaged {}\n{}\n", options.out,
               taking.csv->row_count(), session.shape_names().size(), counters.states_missing,
               counters.frames_lost, session.frames().bad(), latency_summary(taking.latencies_us));
    if (taking.head) {
        fmt::print("{}: head pose known in {} of {} states\n", head_csv_path(options.out).string(),
                   taking.head->known_count(), taking.head->row_count());
    }
    if (taking.raw) fmt::print("{}: {} frames\n", options.raw, taking.raw->frame_count());
    if (!options.markers.empty()) {
        fmt::print("{}: {} x {} markers\n", options.markers, taking.sequences.size(), taking.marker_count);
    }
    if (taking.other_shape_counts > 0) {
        print_error(fmt::format(
            "{} states had another number of shapes and were left out: the rig's pack was changed; "
            "record again",
            taking.other_shape_counts));
    }
}

// For a recording without a limit: a moving line for people, nothing on a pipe.
class Tally {
  public:
    ~Tally() {
        if (drawn_s_ >= 0) fmt::print(stderr, "\r\x1b[K");
    }
    void update(double elapsed_s, std::uint64_t states) {
        const auto whole_s = static_cast<std::int64_t>(elapsed_s);
        if (!is_interactive() || whole_s <= drawn_s_) return;
        drawn_s_ = whole_s;
        fmt::print(stderr, "\r\x1b[Krecording: {} states in {} s; Ctrl-C ends", states, whole_s);
    }

  private:
    std::int64_t drawn_s_ = -1;
};

// Writes until a limit, Ctrl-C, a write error or the rig's silence.
LinkSession::End take_it(const RecordOptions& options, Taking& taking, LinkSession& link) {
    const bool by_frames = options.frames > 0;
    const std::int64_t started_us = host_now_us();
    taking.last_state_us = started_us;
    const auto total = by_frames ? options.frames : static_cast<std::uint64_t>(options.seconds * 1000.0);
    Progress progress("recording", total);
    const bool limited = by_frames || options.seconds < kForever_s;
    Tally tally;
    bool silent = false;
    const auto end = link.run(
        [&] {
            const std::int64_t now_us = host_now_us();
            const auto elapsed_ms = static_cast<std::uint64_t>((now_us - started_us) / 1000);
            const std::uint64_t rows = taking.csv->row_count();
            if (limited) {
                progress.update(by_frames ? rows : elapsed_ms, fmt::format("{} states", rows));
            } else {
                tally.update(static_cast<double>(elapsed_ms) * 1e-3, rows);
            }
            silent = static_cast<double>(now_us - taking.last_state_us) * 1e-6 > kPatience_s;
            return taking.fault || silent || (by_frames ? rows >= options.frames : elapsed_ms >= total);
        },
        kForever_s);
    return silent ? LinkSession::End::kTimeout : end;
}

int finish(const RecordOptions& options, Taking& taking, LinkSession& link, LinkSession::End end) {
    taking.keep(taking.csv->close());
    if (taking.head) taking.keep(taking.head->close());
    if (taking.raw) taking.keep(taking.raw->close());
    if (!options.markers.empty() && !taking.fault) taking.keep(save_markers(taking, options.markers));
    print_summary(options, taking, link.session());
    if (taking.fault) {
        print_error(taking.fault->message);
        return kExitOutput;
    }
    // Without a limit Ctrl-C is how a recording is meant to end.
    const bool limited = options.frames > 0 || options.seconds < kForever_s;
    if (end == LinkSession::End::kInterrupted && !limited) return kExitOk;
    return report_end(end, link);
}

int run_record(const RecordOptions& options) {
    Taking taking;
    if (!options.raw.empty()) {
        auto raw = RecordingWriter::create(options.raw);
        if (!raw) {
            print_error(raw.error().message);
            return kExitOutput;
        }
        taking.raw = std::move(*raw);
    }
    SessionOptions wanted;
    wanted.streams = kStreamWeights | kStreamStatus | kStreamHead;
    if (!options.markers.empty()) wanted.streams |= kStreamMarkers;
    const auto link = LinkSession::open(options.link, wanted, events_into(taking));
    if (!link) return kExitDevice;
    HostSession& session = link->session();
    const auto named =
        link->run([&] { return session.phase() == SessionPhase::kStarting; }, kAnswerTimeout_s);
    if (named != LinkSession::End::kDone) return report_end(named, *link);
    auto csv = WeightsCsv::create(options.out, session.shape_names());
    if (!csv) {
        print_error(csv.error().message);
        return kExitOutput;
    }
    taking.csv = std::move(*csv);
    if (session.tells_head()) {
        auto head = HeadCsv::create(head_csv_path(options.out));
        if (!head) {
            print_error(head.error().message);
            return kExitOutput;
        }
        taking.head = std::move(*head);
    }
    const auto end = take_it(options, taking, *link);
    session.leave();
    return finish(options, taking, *link, end);
}

}  // namespace

void add_record_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<RecordOptions>();
    CLI::App* verb = app.add_subcommand("record", "Write what a rig streams into files");
    add_link_option(*verb, options->link)->required();
    verb->add_option("-o,--out", options->out, "weights: frame,time_s,<shape names>")
        ->required()
        ->type_name("CSV");
    verb->add_option("--raw", options->raw, "every frame received, with its time; for `headrig info`")
        ->type_name("REC");
    verb->add_option("--markers", options->markers,
                     "measured markers (rows of the CSV, markers, 3), mm, NaN not seen")
        ->type_name("NPY");
    CLI::Option* seconds = verb->add_option("--seconds", options->seconds, "end after this time");
    seconds->check(CLI::Range(0.1, kForever_s))->default_str("")->type_name("S");
    verb->add_option("--frames", options->frames, "end after this many states")
        ->excludes(seconds)
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{100'000'000}))
        ->default_str("")
        ->type_name("N");
    verb->footer(
        "A rig whose cameras are not on the head also tells where that is: OUT.head.csv, beside the "
        "weights.\n"
        "Without a limit Ctrl-C ends it; files are whole at any time. A rig that goes away is waited for 5 "
        "s.\nExamples:\n"
        "  headrig record --link /dev/pts/5 --out take.csv --seconds 20\n"
        "  headrig record --link serial:/dev/ttyACM0@3000000 --out take.csv --raw take.rec --markers "
        "markers.npy\n"
        "Exit codes: 0 recorded, 4 a file could not be written, 5 no rig or the rig went away, 130 Ctrl-C "
        "before the "
        "limit (what was recorded is kept).");
    verb->callback([options, &exit_code] {
        install_interrupt_handler();
        exit_code = run_record(*options);
    });
}

}  // namespace rig::host
