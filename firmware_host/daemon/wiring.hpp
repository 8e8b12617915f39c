// Builds the daemon from a board and a command line, in order, and hands each part what it needs. wiring.cpp
// is the only file that names a concrete backend.
#pragma once

#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "firmware_host/daemon/app.hpp"
#include "firmware_host/daemon/command_line.hpp"

namespace rig {

struct WiringError {
    std::string message;  // what, and what to do about it
    ExitCode exit_code = kExitInternal;
};

// Owns everything that the app uses.
class Wiring {
  public:
    [[nodiscard]] static Result<std::unique_ptr<Wiring>, WiringError> build(const CommandLine& command_line);
    ~Wiring();
    Wiring(const Wiring&) = delete;
    Wiring& operator=(const Wiring&) = delete;

    // Runs to the end. Signals stop it.
    [[nodiscard]] AppEnd run();
    [[nodiscard]] App& app();
    // Why the world is gone; "" when it is not.
    [[nodiscard]] std::string world_fault() const;
    [[nodiscard]] std::uint64_t unrecorded_ticks() const;

  private:
    struct Rig;
    Wiring();
    std::unique_ptr<Rig> rig_;
};

}  // namespace rig
