// Pictures of one camera as they come: a device of this machine, or a folder or film that stands in for one.
// Which pictures of several cameras belong together: live_cameras.hpp.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

struct LivePicture {
    GreyImage image;
    // Devices: the driver's time stamp, or the arrival where it gives none, on the machine's monotonic clock.
    // Recordings: number of the picture / rate.
    std::int64_t time_us = 0;
};

enum class StreamEnd : std::uint8_t {
    kNothingYet,  // within the time that was given
    kEnded,       // a recording is over
    kGone,        // the camera was unplugged, or the rest of a recording cannot be read
};

inline constexpr double kFolderRate_hz = 10.0;

// One thread uses a stream. After kEnded or kGone it stays so.
class PictureStream {
  public:
    virtual ~PictureStream() = default;
    // Of a recording the first, of a device the newest picture with a time beyond after_us. Waits for at most
    // patience_us.
    [[nodiscard]] virtual Result<LivePicture, StreamEnd> picture_after(std::int64_t after_us,
                                                                       std::int64_t patience_us) = 0;
    // Why it is gone; empty otherwise.
    [[nodiscard]] virtual std::string fault() const = 0;
    // A recording waits for its reader, a device does not.
    [[nodiscard]] virtual bool is_recording() const = 0;
};

// A device ("/dev/video2", or its number), a folder of .png, .pgm and .jpg (in order of their names; where
// all names end in a number that is the picture's number; kFolderRate_hz) or a film that OpenCV reads. Errors
// say what to do: no such device (with those that there are), no permission, in use or no camera, an empty
// folder.
[[nodiscard]] Result<std::unique_ptr<PictureStream>, FileError> open_picture_stream(
    const std::string& source);

}  // namespace rig::host
