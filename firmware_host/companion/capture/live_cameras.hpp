// Several cameras at once: which of their pictures were taken at the same moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "firmware_host/companion/capture/picture_stream.hpp"

namespace rig::host {

// Cameras that run free at 15 Hz and more have pictures as near as this; a board that is held still does not
// move by a tenth of a pixel in that time.
inline constexpr std::int64_t kMostApart_us = 40'000;

struct LiveMoment {
    std::int64_t time_us = 0;           // of its newest picture
    std::vector<LivePicture> pictures;  // one a camera
};

struct LiveEnd {
    StreamEnd kind = StreamEnd::kNothingYet;
    std::size_t camera = 0;  // whose stream it is
};

class LiveCameras {
  public:
    explicit LiveCameras(std::vector<std::unique_ptr<PictureStream>> streams)
        : streams_(std::move(streams)) {}

    // The next pictures that are not more than kMostApart_us apart, each later than those of the moment
    // before; pictures without partners are passed over. Waits about patience_us a camera.
    [[nodiscard]] Result<LiveMoment, LiveEnd> next(std::int64_t patience_us);
    [[nodiscard]] std::size_t count() const { return streams_.size(); }
    [[nodiscard]] const PictureStream& stream(std::size_t camera) const { return *streams_[camera]; }

  private:
    std::vector<std::unique_ptr<PictureStream>> streams_;
    std::vector<std::int64_t> last_us_;
};

}  // namespace rig::host
