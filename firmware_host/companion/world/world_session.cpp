#include "firmware_host/companion/world/world_session.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

namespace rig::host {

namespace {

using sim::WorldLine;
using sim::WorldMessage;
using sim::WorldMessageKind;
using sim::WorldPace;

constexpr std::int64_t kLockstepStart_us = 1'000'000;
constexpr std::int64_t kPress_us = 100'000;
constexpr std::int64_t kFarewell_us = 5'000'000;  // for the daemon to hang up after kEnd
constexpr std::int64_t kFirstFrameLead_us = 20'000;
constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max();
// Frames rendered beyond the last one sent. A control takes effect on the frame after those: the third.
constexpr std::size_t kAhead = 3;

}  // namespace

std::int64_t monotonic_us() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{1'000'000} * now.tv_sec + now.tv_nsec / 1000;
}

WorldSession::WorldSession(const World& world, const ServerConfig& config, ServerCounters& counters,
                           FramesAhead& frames, int connection, int wake, const std::atomic<bool>& stop)
    : world_(world),
      config_(config),
      counters_(counters),
      frames_(frames),
      connection_(connection),
      wake_(wake),
      stop_(stop) {
    for (const ButtonPress& press : config.presses) {
        edges_.push_back({press.at_us, press.line, true});
        edges_.push_back({press.at_us + kPress_us, press.line, false});
    }
    std::stable_sort(edges_.begin(), edges_.end(),
                     [](const Edge& a, const Edge& b) { return a.at_us < b.at_us; });
}

ServerEnd WorldSession::run(const WorldServer::Progress& progress) {
    frames_.allow(kAhead);
    const bool completed =
        config_.pace == WorldPace::kLockstep ? run_lockstep(progress) : run_real_time(progress);
    return completed && send_end() ? ServerEnd::kCompleted : end_;
}

std::int64_t WorldSession::offset_us(std::size_t frame) const {
    return std::llround(static_cast<double>(frame) * 1e6 / world_.config().rate_hz);
}

std::int64_t WorldSession::exposure_us(std::size_t frame) const {
    float longest = 0.0F;
    for (std::size_t camera = 0; camera < world_.cameras().size(); ++camera) {
        longest = std::max(longest, frames_.control_of(frame, camera).exposure_us);
    }
    return static_cast<std::int64_t>(longest);
}

bool WorldSession::run_lockstep(const WorldServer::Progress& progress) {
    start_us_ = kLockstepStart_us;
    counters_.start_us = start_us_;
    for (std::size_t frame = 0; frame < world_.frame_count(); ++frame) {
        std::uint32_t slot = 0;
        if (!wait_for_frame(frame, kForever, slot)) return false;
        const std::int64_t half = exposure_us(frame) / 2;
        const std::int64_t middle = start_us_ + offset_us(frame);
        if (!send_presses(offset_us(frame) - half) || !send_edge(WorldLine::kTrigger, true, middle - half))
            return false;
        if (!send_frame(frame, slot)) return false;
        if (progress) progress(frame + 1, world_.frame_count());
        while (answered_ <= frame) {
            if (!pump(kForever)) return false;
        }
        if (!send_edge(WorldLine::kTrigger, false, middle + half)) return false;
    }
    return true;
}

bool WorldSession::run_real_time(const WorldServer::Progress& progress) {
    std::uint32_t slot = 0;
    if (!wait_for_frame(0, kForever, slot)) return false;
    start_us_ = monotonic_us() + kFirstFrameLead_us;
    counters_.start_us = start_us_;
    for (std::size_t frame = 0; frame < world_.frame_count(); ++frame) {
        const std::int64_t half = exposure_us(frame) / 2;
        const std::int64_t middle = start_us_ + offset_us(frame);
        const std::int64_t due = middle + half + config_.readout_us;
        while (monotonic_us() < due) {
            if (!pump(due)) return false;
        }
        const std::int64_t patience = due + offset_us(frame + 1) - offset_us(frame);
        constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
        if (frame > 0) {
            slot = kNone;
            if (!wait_for_frame(frame, patience, slot)) return false;
        }
        if (!send_presses(offset_us(frame)) || !send_edge(WorldLine::kTrigger, true, middle - half) ||
            !send_edge(WorldLine::kTrigger, false, middle + half)) {
            return false;
        }
        if (slot == kNone) {
            ++(frames_.give_up(frame) ? counters_.overdue : counters_.no_slot);
            ++counters_.dropped;
            sent_ = frame + 1;
            frames_.allow(sent_ + kAhead);
        } else if (!send_frame(frame, slot)) {
            return false;
        }
        if (progress) progress(frame + 1, world_.frame_count());
    }
    return true;
}

// True with `slot` untouched when the deadline passed first.
bool WorldSession::wait_for_frame(std::size_t frame, std::int64_t deadline_us, std::uint32_t& slot) {
    while (true) {
        if (const auto ready = frames_.lend(frame)) {
            slot = *ready;
            return true;
        }
        if (monotonic_us() >= deadline_us) return true;
        if (!pump(deadline_us)) return false;
    }
}

bool WorldSession::send_frame(std::size_t frame, std::uint32_t slot) {
    WorldMessage message;
    message.kind = WorldMessageKind::kFrameSet;
    message.camera_mask = static_cast<std::uint8_t>((1U << world_.cameras().size()) - 1U);
    message.slot = slot;
    message.sequence = static_cast<std::uint32_t>(frame);
    message.time_us = start_us_ + offset_us(frame);
    message.published_us = monotonic_us();
    // Before the message goes out, so that an answer to it finds the count in place.
    sent_ = frame + 1;
    if (!send(message)) return false;
    ++counters_.sent;
    frames_.allow(sent_ + kAhead);
    return true;
}

bool WorldSession::send_end() {
    if (!send_presses(kForever)) return false;
    WorldMessage message;
    message.kind = WorldMessageKind::kEnd;
    message.sequence = static_cast<std::uint32_t>(world_.frame_count());
    message.time_us = start_us_ + offset_us(world_.frame_count());
    message.published_us = monotonic_us();
    if (!send(message)) return false;
    const std::int64_t deadline = monotonic_us() + kFarewell_us;
    while (monotonic_us() < deadline && pump(deadline)) {
    }
    return !stop_;
}

bool WorldSession::send_presses(std::int64_t until_us) {
    while (next_edge_ < edges_.size() && edges_[next_edge_].at_us <= until_us) {
        const Edge& edge = edges_[next_edge_++];
        if (until_us == kForever && edge.at_us > offset_us(world_.frame_count())) continue;
        if (!send_edge(edge.line, edge.active, start_us_ + edge.at_us)) return false;
    }
    return true;
}

bool WorldSession::send_edge(WorldLine line, bool active, std::int64_t time_us) {
    WorldMessage message;
    message.kind = WorldMessageKind::kLineEdge;
    message.camera_or_line = static_cast<std::uint8_t>(line);
    message.active = active ? 1 : 0;
    message.time_us = time_us;
    message.published_us = monotonic_us();
    return send(message);
}

bool WorldSession::send(const WorldMessage& message) {
    return send_all(connection_, std::as_bytes(std::span(&message, 1)));
}

bool WorldSession::pump(std::int64_t deadline_us) {
    if (stop_) {
        end_ = ServerEnd::kStopped;
        return false;
    }
    std::array<pollfd, 2> ready = {pollfd{connection_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    const std::int64_t left_us =
        deadline_us == kForever ? -1 : std::max<std::int64_t>(0, deadline_us - monotonic_us());
    const timespec timeout{left_us / 1'000'000, 1000 * (left_us % 1'000'000)};
    const int count = ::ppoll(ready.data(), ready.size(), left_us < 0 ? nullptr : &timeout, nullptr);
    if (count < 0 && errno != EINTR) return false;
    if (count <= 0) return true;
    if (ready[1].revents != 0) {
        std::uint64_t drained = 0;
        if (::read(wake_, &drained, sizeof(drained)) < 0 && errno != EAGAIN && errno != EINTR) return false;
    }
    return ready[0].revents == 0 || receive();
}

bool WorldSession::receive() {
    const ssize_t got =
        ::recv(connection_, inbox_.data() + inbox_bytes_, inbox_.size() - inbox_bytes_, MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    inbox_bytes_ += static_cast<std::size_t>(got);
    std::size_t used = 0;
    for (; inbox_bytes_ - used >= sizeof(WorldMessage); used += sizeof(WorldMessage)) {
        WorldMessage message;
        std::memcpy(&message, inbox_.data() + used, sizeof(message));
        obey(message);
    }
    std::memmove(inbox_.data(), inbox_.data() + used, inbox_bytes_ - used);
    inbox_bytes_ -= used;
    return true;
}

void WorldSession::obey(const WorldMessage& message) {
    switch (message.kind) {
        case WorldMessageKind::kSlotFree:
            if (frames_.take_back(message.slot)) return;
            break;
        case WorldMessageKind::kTickDone:
            if (config_.pace == WorldPace::kRealTime) return;
            if (message.sequence + std::size_t{1} == sent_ && answered_ < sent_) {
                answered_ = sent_;
                return;
            }
            break;
        case WorldMessageKind::kSetLine:
            if (message.camera_or_line >= sim::kWorldLineCount) break;
            ++counters_.lines_set;
            return;
        case WorldMessageKind::kExposure:
        case WorldMessageKind::kGain:
            obey_control(message);
            return;
        default:
            break;
    }
    ++counters_.ignored;
}

void WorldSession::obey_control(const WorldMessage& message) {
    const std::size_t camera = message.camera_or_line;
    if (camera >= world_.cameras().size() || !std::isfinite(message.value)) {
        ++counters_.ignored;
        return;
    }
    const std::size_t first = sent_ + kAhead;
    CameraControl control = frames_.control_of(first, camera);
    if (message.kind == WorldMessageKind::kExposure) {
        const auto longest = static_cast<float>(1e6 / world_.config().rate_hz);
        control.exposure_us = std::clamp(message.value, 0.0F, longest);
    } else {
        control.gain_db = std::clamp(message.value, -20.0F, 48.0F);
    }
    frames_.control(first, camera, control);
}

}  // namespace rig::host
