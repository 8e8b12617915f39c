// methods.md 3.7: the pull towards the previous solution lowers the noise of the weights and makes them lag.
// One setting serves every stream; this is what the others would give.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/quadratic_solvers.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

namespace {

struct Recording {
    const char* column;
    const char* file;  // under markers/
    bool is_speech;
    std::size_t first_frame;  // of the take, as markers/<take>/manifest.json has it
};
constexpr std::size_t kMotionFirst = 2400;
constexpr std::size_t kSpeechFirst = 600;
constexpr std::array kRecordings{
    Recording{"truth", "alex_rom_3/60/truth.npy", false, kMotionFirst},
    Recording{"noise 0.1 mm", "alex_rom_3/60/noise01.npy", false, kMotionFirst},
    Recording{"noise 0.3 mm", "alex_rom_3/60/noise03.npy", false, kMotionFirst},
    Recording{"slip", "alex_rom_3/60/slip.npy", false, kMotionFirst},
    Recording{"combined", "alex_rom_3/60/combined.npy", false, kMotionFirst},
    Recording{"speech, truth", "facegood_3_15/60/truth.npy", true, kSpeechFirst},
    Recording{"speech, noise 0.3 mm", "facegood_3_15/60/noise03.npy", true, kSpeechFirst},
};
enum : std::size_t { kTruth, kNoise01, kNoise03, kSlip, kCombined };

struct Setting {
    const char* name;
    TemporalPull pull;
};
constexpr std::size_t kDefaultSetting = 4;
const std::array<Setting, 7>& settings() {
    using Mode = TemporalPull::Mode;
    static const std::array<Setting, 7> all{
        Setting{"none", {Mode::kOff, {}}},
        Setting{"0.2", {Mode::kOn, 0.2}},
        Setting{"0.1", {Mode::kOn, 0.1}},
        Setting{"0.05", {Mode::kOn, 0.05}},
        Setting{"as trained", {Mode::kSolversOwn, {}}},
        Setting{"0.02", {Mode::kOn, 0.02}},
        Setting{"0.01", {Mode::kOn, 0.01}},
    };
    return all;
}

using Scores = std::array<double, kRecordings.size()>;

double weight_rms(const RecordedHead& head, const Recording& recording, const NpyArray<float>& stream,
                  BoxQpPipeline& box) {
    const Take& take = recording.is_speech ? head.speech : head.range_of_motion;
    const std::size_t row = stream.shape[1] * stream.shape[2];
    WeightError error(head.model);
    for (std::size_t f = 0; f < stream.shape[0]; ++f) {
        const std::span<const float> w = box.solve(std::span(stream.values).subspan(f * row, row));
        error.add(w, frame_weights(take, recording.first_frame + f));
    }
    return error.rms();
}

std::optional<FileError> fault_of(const RecordedHead& head, const Recording& recording,
                                  const NpyArray<float>& stream) {
    const Take& take = recording.is_speech ? head.speech : head.range_of_motion;
    if (stream.shape.size() != 3 || stream.shape[1] != head.layout.markers.size() || stream.shape[2] != 3) {
        return FileError{
            fmt::format("{}: not a stream of {} markers", recording.file, head.layout.markers.size())};
    }
    if (recording.first_frame + stream.shape[0] > take.frame_count) {
        return FileError{fmt::format("{}: longer than its take", recording.file)};
    }
    return {};
}

Result<Scores, FileError> scores_of(const RecordedHead& head, const Setting& setting,
                                    std::span<const NpyArray<float>> streams) {
    Scores scores{};
    for (std::size_t r = 0; r < kRecordings.size(); ++r) {
        TrainOptions options;
        options.temporal = setting.pull;
        auto box = BoxQpPipeline::learn(head, true, options);
        if (!box) return failure(box.error());
        scores[r] = weight_rms(head, kRecordings[r], streams[r], *box);
    }
    return scores;
}

}  // namespace

Result<ExperimentTable, FileError> temporal_prior(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    std::vector<NpyArray<float>> streams;
    for (const Recording& recording : kRecordings) {
        auto stream = read_npy<float>(data / "markers" / recording.file);
        if (!stream) return failure(stream.error());
        if (const auto fault = fault_of(*head, recording, *stream)) return failure(*fault);
        streams.push_back(std::move(*stream));
    }
    ExperimentTable out;
    out.columns = {"expected step"};
    for (const Recording& recording : kRecordings) out.columns.emplace_back(recording.column);
    Scores own{};
    for (std::size_t s = 0; s < settings().size(); ++s) {
        const auto scores = scores_of(*head, settings()[s], streams);
        if (!scores) return failure(scores.error());
        if (s == kDefaultSetting) own = *scores;
        out.rows.push_back({settings()[s].name});
        for (const double score : *scores) out.rows.back().push_back(fmt::format("{:.4f}", score));
    }
    out.bounds = {{"as trained, noise 0.1 mm", own[kNoise01], 0.025},
                  {"as trained, noise 0.3 mm", own[kNoise03], 0.042},
                  {"as trained, truth (the lag)", own[kTruth], 0.02},
                  {"as trained, slip above noise 0.1 mm", own[kSlip] - own[kNoise01], 0.005},
                  {"as trained, combined above noise 0.1 mm", own[kCombined] - own[kNoise01], 0.02}};
    out.remarks = {
        "Weight rms over shapes > 1 mm: 1200 recorded frames, 60 markers, box QP, no smoothing behind it.",
        "The pull is noise^2 / step^2; step: expected change of a weight from frame to frame, at 60 Hz. As "
        "trained without a take: a step of its own for each shape.",
        "The truth is exactly linear in the shapes, which flatters every row."};
    return out;
}

}  // namespace rig::host
