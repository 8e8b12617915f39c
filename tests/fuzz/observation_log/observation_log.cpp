// A recorded take of observations, from anywhere.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "firmware_host/take_log/observation_log.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    auto log = rig::ObservationLogReader::open(std::as_bytes(std::span(data, size)));
    if (!log) return 0;
    while (!log->at_end()) {
        const auto tick = log->next();
        if (!tick) return 0;
        for (std::size_t c = 0; c < log->header().camera_count; ++c) {
            RIG_CHECK(tick->cameras[c].size() <= rig::kMaxObservations);
            for (const rig::Observation& dot : tick->cameras[c])
                RIG_CHECK(std::isfinite(dot.x_px) && std::isfinite(dot.score));
        }
    }
    return 0;
}
