// headrig replay: a take as detection saw it on the rig, solved again on the desk to the same bytes.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/daemon/observation_log.hpp"
#include "firmware_host/daemon/stream_digest.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

struct ReplayOptions {
    std::string log;
    std::string pack;
    std::string weights_csv;
    bool another_pack = false;
};

const char* fault_of(ObservationLogError error) {
    switch (error) {
        case ObservationLogError::kOpen: return "cannot be read";
        case ObservationLogError::kFormat: return "is no observation log; `headrigd --log-observations FILE` writes one";
        case ObservationLogError::kCut: return "ends inside a record: the recording was cut; all frames before it were solved";
        case ObservationLogError::kDamaged: return "holds a damaged record; all frames before it were solved";
    }
    return "cannot be used";
}

PipelineConfig config_of(const ObservationLogHeader& header) {
    PipelineConfig config;
    config.filter = header.filter;
    config.stabilise = header.stabilise;
    config.rate_hz = static_cast<double>(header.rate_millihertz) * 1e-3;
    config.loss_policy = header.loss_policy == 1 ? LossPolicy::kDecay : LossPolicy::kHold;
    return config;
}

ObservationFrame frame_of(const ObservationTick& tick, std::uint8_t camera_count) {
    ObservationFrame frame;
    frame.capture_us = tick.capture_us;
    frame.cameras = tick.cameras;
    frame.status = tick.status;
    frame.camera_count = camera_count;
    return frame;
}

// Solves every whole record; the error that ended the log early, if any, is returned after all before it is done.
Result<void, ObservationLogError> solve_log(ObservationLogReader& reader, std::size_t bytes, const SolvePack& pack,
                                            Pipeline& pipeline, CsvWriter& csv, StreamDigest& digest) {
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    Progress progress("replay", bytes);
    std::int64_t first_us = 0;
    while (!reader.at_end() && !interrupted()) {
        const auto tick = reader.next();
        if (!tick) return failure(tick.error());
        if (tick->reset_before) pipeline.reset_tracking();
        pipeline.step(frame_of(*tick, reader.header().camera_count), *state, *report);
        digest.add(*state);
        if (digest.ticks() == 1) first_us = tick->capture_us;
        csv.integer(static_cast<std::int64_t>(digest.ticks()) - 1);
        csv.number(static_cast<double>(tick->capture_us - first_us) * 1e-6, 6);
        for (std::size_t i = 0; i < pack.shape_count; ++i) csv.number(static_cast<double>(state->weights[i]), 6);
        csv.end_row();
    }
    return {};
}

int run_replay(const ReplayOptions& options) {
    const auto opened = open_pack_file(options.pack);
    const auto bytes = read_whole_file(options.log);
    if (!opened || !bytes) {
        print_error(opened ? bytes.error().message : opened.error().message);
        return kExitInput;
    }
    auto reader = ObservationLogReader::open(*bytes);
    if (!reader) {
        print_error(fmt::format("{}: {}", options.log, fault_of(reader.error())));
        return kExitInput;
    }
    if (reader->header().pack_hash != opened->manifest().manifest_hash && !options.another_pack) {
        print_error(fmt::format("{}: was recorded with another pack than {}; --another-pack solves it all the same",
                                options.log, options.pack));
        return kExitInput;
    }
    const SolvePack& pack = opened->pack();
    const auto pipeline = std::make_unique<Pipeline>();
    if (pack.camera_count != reader->header().camera_count || !pipeline->configure(pack, config_of(reader->header()))) {
        print_error(fmt::format("{}: {} cameras, but {} was recorded with {}", options.pack, pack.camera_count, options.log,
                                reader->header().camera_count));
        return kExitInput;
    }
    std::vector<std::string> columns{"frame", "time_s"};
    for (std::size_t i = 0; i < pack.shape_count; ++i) columns.emplace_back(pack.shape_names[i]);
    CsvWriter csv(columns);
    StreamDigest digest;
    install_interrupt_handler();
    const auto solved = solve_log(*reader, bytes->size(), pack, *pipeline, csv, digest);
    if (interrupted()) return kExitInterrupted;
    if (!options.weights_csv.empty()) {
        if (const auto saved = csv.save(options.weights_csv); !saved) {
            print_error(saved.error().message);
            return kExitOutput;
        }
    }
    fmt::print("digest {:016x} over {} ticks\n", digest.value(), digest.ticks());
    if (!solved) {
        print_error(fmt::format("{}: {}", options.log, fault_of(solved.error())));
        return kExitInput;
    }
    return kExitOk;
}

}  // namespace

void add_replay_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<ReplayOptions>();
    CLI::App* verb = app.add_subcommand("replay", "solve a take again from the observations recorded on the rig");
    verb->add_option("log", options->log, "observation log of `headrigd --log-observations`")->required()->type_name("FILE.rgo");
    verb->add_option("--pack", options->pack, "the pack it was recorded with")->required()->type_name("FILE");
    verb->add_option("--out", options->weights_csv, "weights: frame,time_s,<shapes>")->type_name("W.csv");
    verb->add_flag("--another-pack", options->another_pack, "solve with a pack other than the recorded one");
    verb->footer(
        "The digest is the one that `headrigd --digest` printed for the take: the same pack and the same observations\n"
        "give the same bytes on every machine and with every build.\n"
        "Examples:\n"
        "  headrig replay take.rgo --pack face.pack --out weights.csv\n"
        "  headrig replay take.rgo --pack retrained.pack --another-pack --out weights.csv\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing, malformed or cut, 4 an output could not be\n"
        "written, 130 interrupted.");
    verb->callback([options, &exit_code] { exit_code = run_replay(*options); });
}

}  // namespace rig::host
