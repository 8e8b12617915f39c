#include "firmware_host/companion/world/frames_ahead.hpp"

#include <algorithm>

namespace rig::host {

FramesAhead::FramesAhead(const World& world, std::span<std::uint8_t> images, std::size_t stride,
                         std::size_t slot_count, std::size_t threads, TruthRecorder* truth,
                         std::function<void()> rendered)
    : world_(world),
      images_(images),
      stride_(stride),
      truth_(truth),
      rendered_(std::move(rendered)),
      slots_(slot_count) {
    for (std::size_t t = 0; t < std::max<std::size_t>(threads, 1); ++t)
        threads_.emplace_back([this] { work(); });
}

FramesAhead::~FramesAhead() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
    }
    changed_.notify_all();
}

void FramesAhead::allow(std::size_t end) {
    {
        const std::lock_guard lock(mutex_);
        allowed_ = std::max(allowed_, std::min(end, world_.frame_count()));
    }
    changed_.notify_all();
}

void FramesAhead::control(std::size_t first, std::size_t camera, const CameraControl& control) {
    const std::lock_guard lock(mutex_);
    changes_.push_back({first, camera, control});
}

CameraControl FramesAhead::control_locked(std::size_t frame, std::size_t camera) const {
    for (auto change = changes_.rbegin(); change != changes_.rend(); ++change) {
        if (change->camera == camera && change->first <= frame) return change->control;
    }
    return {};
}

CameraControl FramesAhead::control_of(std::size_t frame, std::size_t camera) const {
    const std::lock_guard lock(mutex_);
    return control_locked(frame, camera);
}

std::optional<std::uint32_t> FramesAhead::lend(std::size_t frame) {
    const std::lock_guard lock(mutex_);
    for (std::size_t s = 0; s < slots_.size(); ++s) {
        if (slots_[s].use != Use::kReady || slots_[s].frame != frame) continue;
        slots_[s].use = Use::kLent;
        return static_cast<std::uint32_t>(s);
    }
    return std::nullopt;
}

bool FramesAhead::take_back(std::uint32_t slot) {
    {
        const std::lock_guard lock(mutex_);
        if (slot >= slots_.size() || slots_[slot].use != Use::kLent) return false;
        slots_[slot].use = Use::kFree;
    }
    changed_.notify_all();
    return true;
}

bool FramesAhead::give_up(std::size_t frame) {
    bool begun = false;
    {
        const std::lock_guard lock(mutex_);
        for (Slot& slot : slots_) {
            if (slot.frame != frame || (slot.use != Use::kReady && slot.use != Use::kRendering)) continue;
            begun = true;
            slot.unwanted = slot.use == Use::kRendering;
            if (slot.use == Use::kReady) slot.use = Use::kFree;
        }
        next_ = std::max(next_, frame + 1);
    }
    changed_.notify_all();
    return begun;
}

FramesAhead::Slot* FramesAhead::claim() {
    if (next_ >= allowed_) return nullptr;
    const auto free =
        std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.use == Use::kFree; });
    if (free == slots_.end()) return nullptr;
    *free = {Use::kRendering, next_++, false};
    return &*free;
}

void FramesAhead::work() {
    WorldRenderer renderer(world_);
    std::vector<CameraControl> controls(world_.cameras().size());
    std::unique_lock lock(mutex_);
    while (!ending_) {
        Slot* slot = claim();
        if (slot == nullptr) {
            changed_.wait(lock);
            continue;
        }
        const std::size_t frame = slot->frame;
        for (std::size_t camera = 0; camera < controls.size(); ++camera)
            controls[camera] = control_locked(frame, camera);
        lock.unlock();
        draw(renderer, static_cast<std::size_t>(slot - slots_.data()), frame, controls);
        lock.lock();
        slot->use = slot->unwanted ? Use::kFree : Use::kReady;
        lock.unlock();
        rendered_();
        lock.lock();
    }
}

void FramesAhead::draw(WorldRenderer& renderer, std::size_t slot, std::size_t frame,
                       std::span<const CameraControl> controls) {
    const std::size_t markers = world_.marker_count();
    std::vector<MarkerSight> sights(controls.size() * markers);
    for (std::size_t camera = 0; camera < controls.size(); ++camera) {
        renderer.render(frame, camera, controls[camera],
                        images_.subspan((slot * controls.size() + camera) * stride_, world_.image_bytes()),
                        std::span(sights).subspan(camera * markers, markers));
    }
    if (truth_ != nullptr) truth_->add(frame, sights);
}

}  // namespace rig::host
