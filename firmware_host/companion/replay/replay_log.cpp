#include "firmware_host/companion/replay/replay_log.hpp"

#include <memory>

#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/replay/offline_pipeline.hpp"
#include "firmware_host/take_log/observation_log.hpp"
#include "firmware_host/take_log/stream_digest.hpp"

namespace rig::host {

namespace {

const char* fault_of(ObservationLogError error) {
    switch (error) {
        case ObservationLogError::kOpen:
            return "cannot be read";
        case ObservationLogError::kFormat:
            return "is no observation log; `headrigd --log-observations FILE` writes one";
        case ObservationLogError::kCut:
            return "ends inside a record: the recording was cut; all ticks before it were solved";
        case ObservationLogError::kDamaged:
            return "holds a damaged record; all ticks before it were solved";
    }
    return "cannot be used";
}

PipelineConfig config_of(const ObservationLogHeader& header) {
    PipelineConfig config;
    config.filter = header.filter;
    config.stabilise = header.stabilise;
    config.camera_on_head = header.camera_on_head;
    config.smoothing = header.smoothing;
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

Result<void, FileError> check_fit(const ReplayRequest& request, const OpenedPack& pack,
                                  const ObservationLogHeader& header) {
    const std::string log = request.log.string();
    if (header.pack_hash != pack.manifest().manifest_hash && !request.another_pack) {
        return failure(FileError{log + ": was recorded with another pack than " + request.pack_name +
                                 "; --another-pack solves it all the same"});
    }
    if (pack.pack().camera_count != header.camera_count) {
        return failure(FileError{request.pack_name + ": " + std::to_string(pack.pack().camera_count) +
                                 " cameras, but " + log + " was recorded with " +
                                 std::to_string(header.camera_count)});
    }
    return {};
}

}  // namespace

Result<ReplayResult, FileError> replay_log(const ReplayRequest& request, const OpenedPack& pack,
                                           const ReplayVisitor& visit) {
    const auto bytes = read_whole_file(request.log);
    if (!bytes) return failure(bytes.error());
    auto reader = ObservationLogReader::open(*bytes);
    if (!reader) return failure(FileError{request.log.string() + ": " + fault_of(reader.error())});
    if (const auto fits = check_fit(request, pack, reader->header()); !fits) return failure(fits.error());
    PipelineConfig config = config_of(reader->header());
    config.filter = config.filter && !request.as_solved;
    const auto configured = offline_pipeline(pack.pack(), config, request.pack_name);
    if (!configured) return failure(configured.error());
    Pipeline* const pipeline = configured->get();
    const auto state = std::make_unique<FaceState>();
    const auto report = std::make_unique<FrameReport>();
    StreamDigest digest;
    ReplayResult result;
    result.rate_hz = config.rate_hz;
    result.camera_on_head = config.camera_on_head;
    std::int64_t first_us = 0;
    while (!reader->at_end()) {
        const auto next = reader->next();
        if (!next) {
            result.cut = request.log.string() + ": " + fault_of(next.error());
            break;
        }
        if (next->reset_before) pipeline->reset_tracking();
        if (next->neutral_forgotten_before) pipeline->forget_neutral();
        if (next->neutral_before) pipeline->begin_neutral();
        result.controls = result.controls || next->new_controls != nullptr;
        const bool control = next->new_controls != nullptr && !request.as_solved;
        if (control && !pipeline->set_controls(*next->new_controls)) {
            return failure(FileError{request.log.string() + ": sets controls of shapes that " +
                                     request.pack_name + " does not have"});
        }
        pipeline->step(frame_of(*next, reader->header().camera_count), *state, *report);
        digest.add(*state);
        if (digest.ticks() == 1) first_us = next->capture_us;
        const double time_s = static_cast<double>(next->capture_us - first_us) * 1e-6;
        if (!visit({*state, *report, *pipeline, next->reset_before, time_s, reader->share_read()})) break;
    }
    result.digest = digest.value();
    result.ticks = digest.ticks();
    return result;
}

}  // namespace rig::host
