#include "firmware_host/companion/capture/live_cameras.hpp"

#include <algorithm>

namespace rig::host {

Result<LiveMoment, LiveEnd> LiveCameras::next(std::int64_t patience_us) {
    constexpr int kRounds = 64;  // of passing over: recordings may lack pictures in a row
    last_us_.resize(streams_.size(), 0);
    LiveMoment moment;
    moment.pictures.resize(streams_.size());
    std::vector<bool> wanted(streams_.size(), true);
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t c = 0; c < streams_.size(); ++c) {
            if (!wanted[c]) continue;
            const std::int64_t after_us = std::max(last_us_[c], moment.time_us - kMostApart_us - 1);
            auto picture = streams_[c]->picture_after(after_us, patience_us);
            if (!picture) return failure(LiveEnd{picture.error(), c});
            last_us_[c] = picture->time_us;
            moment.time_us = std::max(moment.time_us, picture->time_us);
            moment.pictures[c] = std::move(*picture);
        }
        bool together = true;
        for (std::size_t c = 0; c < streams_.size(); ++c) {
            wanted[c] = moment.pictures[c].time_us < moment.time_us - kMostApart_us;
            together = together && !wanted[c];
        }
        if (together) return moment;
    }
    return failure(LiveEnd{StreamEnd::kNothingYet, 0});
}

}  // namespace rig::host
