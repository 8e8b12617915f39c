#include "firmware_host/companion/demo/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

extern char** environ;

namespace rig::host {

namespace {

constexpr std::int64_t kPoliteMs = 2000;

}  // namespace

Result<ChildProcess, FileError> ChildProcess::start(const std::vector<std::string>& arguments,
                                                    const std::filesystem::path& log) {
    std::vector<char*> raw;
    for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
    raw.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0644);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    pid_t id = -1;
    const int fault = posix_spawn(&id, raw[0], &actions, nullptr, raw.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (fault != 0) {
        return failure(FileError{arguments[0] + ": cannot be started: " + std::strerror(fault) +
                                 "; build it with `cmake --build --preset release`"});
    }
    return ChildProcess(id);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : id_(std::exchange(other.id_, -1)), end_(std::move(other.end_)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(end_, other.end_);
    return *this;
}

ChildProcess::~ChildProcess() {
    if (id_ < 0 || end_) return;
    terminate();
    if (wait(kPoliteMs)) return;
    kill(id_, SIGKILL);
    (void)wait(kPoliteMs);
}

void ChildProcess::terminate() const {
    if (id_ > 0 && !end_) kill(id_, SIGTERM);
}

std::optional<ChildEnd> ChildProcess::poll() {
    if (end_ || id_ < 0) return end_;
    int status = 0;
    struct rusage usage{};
    if (wait4(id_, &status, WNOHANG, &usage) != id_) return std::nullopt;
    ChildEnd end;
    end.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    end.peak_memory_kb = usage.ru_maxrss;
    end_ = end;
    return end_;
}

std::optional<ChildEnd> ChildProcess::wait(std::int64_t timeout_ms) {
    using std::chrono::milliseconds;
    using std::chrono::steady_clock;
    const auto until = steady_clock::now() + milliseconds(timeout_ms);
    while (!poll()) {
        if (steady_clock::now() >= until) return std::nullopt;
        std::this_thread::sleep_for(milliseconds(5));
    }
    return end_;
}

}  // namespace rig::host
