// A daemon's side of the world boundary in the plainest form, for tests that must say exactly what goes over
// the wire.
#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "hal/sim/world_protocol.hpp"

namespace rig::test {

class WorldVisitor {
  public:
    // Connects and takes the hello; ok() tells whether that worked.
    explicit WorldVisitor(const std::filesystem::path& socket);
    ~WorldVisitor();
    WorldVisitor(const WorldVisitor&) = delete;
    WorldVisitor& operator=(const WorldVisitor&) = delete;

    [[nodiscard]] bool ok() const { return images_ != nullptr; }
    [[nodiscard]] const sim::WorldHello& hello() const { return hello_; }
    // The next message; nothing after timeout_ms or when the world is gone.
    [[nodiscard]] std::optional<sim::WorldMessage> next(int timeout_ms = 20000);
    void say(const sim::WorldMessage& message);
    void say(sim::WorldMessageKind kind, std::uint32_t slot, std::uint32_t sequence = 0);
    [[nodiscard]] std::span<const std::uint8_t> image(std::uint32_t slot, std::size_t camera) const;
    void hang_up();

  private:
    int socket_ = -1;
    sim::WorldHello hello_;
    const std::uint8_t* images_ = nullptr;
};

}  // namespace rig::test
