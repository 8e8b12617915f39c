// A program started and ended by us: the daemon of a demo.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

struct ChildEnd {
    int exit_code = 0;  // 128 + signal when a signal ended it
    std::int64_t peak_memory_kb = 0;
};

// Ends the child when destroyed: SIGTERM, and after two seconds SIGKILL.
class ChildProcess {
  public:
    // arguments[0] is the program's path. Both its outputs go to `log`.
    [[nodiscard]] static Result<ChildProcess, FileError> start(const std::vector<std::string>& arguments,
                                                               const std::filesystem::path& log);
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&& other) noexcept;
    ~ChildProcess();

    // The end, when it has come; otherwise nothing. Does not block.
    [[nodiscard]] std::optional<ChildEnd> poll();
    // Waits up to `timeout_ms`.
    [[nodiscard]] std::optional<ChildEnd> wait(std::int64_t timeout_ms);
    void terminate() const;

  private:
    explicit ChildProcess(pid_t id) : id_(id) {}

    pid_t id_ = -1;
    std::optional<ChildEnd> end_;
};

}  // namespace rig::host
