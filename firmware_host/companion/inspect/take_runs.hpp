// Takes of every kind, run through the pipeline that ships, into a TakeRecord.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/detect/observation.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/inspect/take_record.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

enum class TakeKind : std::uint8_t {
    kLog,        // observations of `headrigd --log-observations`
    kRecording,  // `headrig record --raw`
    kStream,     // marker positions, .npy
    kPictures,   // folder of images
};

// By the content, never by the name. Errors: missing, nothing of these; each names the remedy.
[[nodiscard]] Result<TakeKind, FileError> kind_of_take(const std::filesystem::path& take);

struct InspectRequest {
    std::filesystem::path take;
    std::string pack_name;      // for messages
    bool another_pack = false;  // logs: accept a pack other than the recorded one
    bool unlabelled = false;    // streams: rows come in any order, ghosts among them
    bool stabilise = true;      // streams and pictures: false, the take is in the face frame already
    double rate_hz = 0.0;       // streams and pictures; 0: the pack's
    MarkerPolarity polarity = MarkerPolarity::kAuto;  // pictures
};

// Ticks done, and their total, which of a log is an estimate. False ends the run there.
using InspectProgress = std::function<bool(std::uint64_t done, std::uint64_t total)>;

// Errors: as replay_log().
[[nodiscard]] Result<TakeRecord, FileError> inspect_log(const InspectRequest& request, const OpenedPack& pack,
                                                        const InspectProgress& progress);
// Errors: no (frames, markers, 3) float array, another number of markers than the pack's.
[[nodiscard]] Result<TakeRecord, FileError> inspect_stream(const InspectRequest& request,
                                                           const SolvePack& pack,
                                                           const InspectProgress& progress);
// Errors: pictures not named MOMENT_CAMERA, of other cameras or of another size than the pack's, unreadable.
[[nodiscard]] Result<TakeRecord, FileError> inspect_pictures(const InspectRequest& request,
                                                             const SolvePack& pack,
                                                             const InspectProgress& progress);
// What the board told; nothing is solved again. `pack` may be null: it only names and places markers.
// Errors: no recording, or one without a single state.
[[nodiscard]] Result<TakeRecord, FileError> inspect_recording(const InspectRequest& request,
                                                              const SolvePack* pack,
                                                              const InspectProgress& progress);

}  // namespace rig::host
