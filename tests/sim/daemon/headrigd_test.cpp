// The program itself, started as it ships: exit codes, the end by a signal, files and links left behind, heap
// calls.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "firmware_host/take_log/observation_log.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "tests/contract/hal/fake_world.hpp"
#include "tests/support/temp_folder.hpp"

extern char** environ;

namespace rig::test {
namespace {

class DaemonProgram : public testing::Test {
  protected:
    // Starts it with its output in files of the folder.
    void start(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), RIG_DAEMON_PROGRAM);
        std::vector<char*> argv;
        for (std::string& argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, 1, (folder_ / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                         0644);
        posix_spawn_file_actions_addopen(&actions, 2, (folder_ / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                         0644);
        ASSERT_EQ(posix_spawn(&pid_, RIG_DAEMON_PROGRAM, &actions, nullptr, argv.data(), environ), 0);
        posix_spawn_file_actions_destroy(&actions);
    }
    // Exit code; 128 + n for a signal n; -1 when it does not end within 20 s and has to be ended.
    int wait() {
        MonotonicClock clock;
        const std::int64_t deadline_us = clock.now_us() + 20'000'000;
        int status = 0;
        while (waitpid(pid_, &status, WNOHANG) == 0) {
            if (clock.now_us() > deadline_us) {
                kill(pid_, SIGKILL);
                waitpid(pid_, &status, 0);
                return -1;
            }
            clock.sleep_until_us(clock.now_us() + 5000);
        }
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    int run(std::vector<std::string> arguments) {
        start(std::move(arguments));
        return wait();
    }
    [[nodiscard]] std::string text(const char* name) const {
        std::ifstream file(folder_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    TempFolder folder_;
    std::string line_ = folder_ / "line";
    pid_t pid_ = -1;
};

TEST_F(DaemonProgram, HelpAndVersionAreNoFailure) {
    EXPECT_EQ(run({"--help"}), 0);
    for (const char* word :
         {"--world", "--pack", "--link", "--executor", "--stream", "--digest", "Exit codes", "Examples"}) {
        EXPECT_NE(text("out").find(word), std::string::npos) << word;
    }
    EXPECT_EQ(run({"--version"}), 0);
    EXPECT_EQ(text("out").rfind("headrigd ", 0), 0U);
}

TEST_F(DaemonProgram, MistakesHaveTheirExitCodesAndOneLine) {
    const std::string garbage = folder_ / "garbage";
    std::ofstream(garbage) << "certainly [[ not what is asked for";
    const std::vector<std::pair<int, std::vector<std::string>>> mistakes{
        {2, {"--no-such-option"}},
        {2, {"--executor", "slow"}},
        {2, {"--stream", "weights,colours"}},
        {2, {}},                          // board sim has no link of its own
        {2, {"--link", "pty:" + line_}},  // and needs a world
        {2, {"--link", "smoke:signals"}},
        {2, {"--link", "serial:/dev/null@fast"}},
        {2, {"--link", "udp:localhost:99999"}},
        {3, {"--board", "nosuchboard"}},
        {3, {"--board", garbage + ".toml"}},
        {3, {"--faults", garbage}},
        {3, {"--require-pack"}},
        {3, {"--require-pack", "--pack", garbage}},
        {4, {"--link", "serial:/nowhere/at/all"}},
        {4, {"--link", "pty:" + garbage}},  // a file is in the way
        {5, {"--link", "pty:" + line_, "--world", folder_ / "none.sock", "--world-timeout", "0.1"}},
    };
    std::ofstream(garbage + ".toml") << "name = \"x\"\nrate_hz = 1e9\n";
    for (const auto& [code, arguments] : mistakes) {
        EXPECT_EQ(run(arguments), code) << (arguments.empty() ? "no arguments" : arguments.back()) << "\n"
                                        << text("err");
        EXPECT_FALSE(text("err").empty());
        EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(line_)));
    }
}

// SAFE without a pack; heap guard armed; log and digest written; the end of the world is a clean end.
TEST_F(DaemonProgram, RunsAWorldToItsEnd) {
    setenv("RIG_HEAP_GUARD", "abort", 1);
    std::vector<std::string> digests;
    for (int round = 0; round < 2; ++round) {
        FakeWorld world(sim::WorldPace::kLockstep);
        world.perform(50);
        const std::string log = folder_ / "take.rgo";
        EXPECT_EQ(
            run({"--world", world.path(), "--link", "pty:" + line_, "--digest", "--log-observations", log}),
            0)
            << text("err");
        world.wait_performed();
        digests.push_back(text("out"));
        EXPECT_NE(digests.back().find("over 50 ticks"), std::string::npos) << digests.back();
        EXPECT_NE(text("err").find("50 ticks, 0 solved, 50 held"), std::string::npos) << text("err");
        EXPECT_NE(text("err").find(" 0 heap calls after seal"), std::string::npos) << text("err");
        EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(line_)));
        const std::string bytes = text("take.rgo");
        auto reader = ObservationLogReader::open(std::as_bytes(std::span(bytes)));
        ASSERT_TRUE(reader.has_value());
        int ticks = 0;
        for (; !reader->at_end(); ++ticks) ASSERT_TRUE(reader->next().has_value());
        EXPECT_EQ(ticks, 50);
    }
    unsetenv("RIG_HEAP_GUARD");
    EXPECT_EQ(digests[0], digests[1]);
}

// A take solved again must know how the cameras stood.
TEST_F(DaemonProgram, ALogTellsWhetherTheCamerasWereOnTheHead) {
    for (const bool on_head : {true, false}) {
        FakeWorld world(sim::WorldPace::kLockstep);
        world.perform(5);
        const std::string log = folder_ / "take.rgo";
        std::vector<std::string> arguments{"--world",      world.path(),         "--link",
                                           "pty:" + line_, "--log-observations", log};
        if (!on_head) arguments.emplace_back("--cameras-off-head");
        EXPECT_EQ(run(arguments), 0) << text("err");
        world.wait_performed();
        const std::string bytes = text("take.rgo");
        const auto reader = ObservationLogReader::open(std::as_bytes(std::span(bytes)));
        ASSERT_TRUE(reader.has_value());
        EXPECT_EQ(reader->header().camera_on_head, on_head);
    }
}

TEST_F(DaemonProgram, RunsInRealTimeWithoutHeapCalls) {
    setenv("RIG_HEAP_GUARD", "abort", 1);
    FakeWorld world(sim::WorldPace::kRealTime);
    world.perform(60);
    EXPECT_EQ(run({"--world", world.path(), "--link", "pty:" + line_, "--stream", "weights,status"}), 0)
        << text("err");
    unsetenv("RIG_HEAP_GUARD");
    EXPECT_NE(text("err").find(" 0 heap calls after seal"), std::string::npos) << text("err");
}

TEST_F(DaemonProgram, ASignalEndsItCleanly) {
    for (const auto pace : {sim::WorldPace::kLockstep, sim::WorldPace::kRealTime}) {
        for (const int signal : {SIGTERM, SIGINT}) {
            FakeWorld world(pace);
            world.perform(1'000'000);
            start({"--world", world.path(), "--link", "pty:" + line_});
            MonotonicClock clock;
            const std::int64_t deadline_us = clock.now_us() + 10'000'000;
            while (!std::filesystem::exists(line_) && clock.now_us() < deadline_us)
                clock.sleep_until_us(clock.now_us() + 2000);
            clock.sleep_until_us(clock.now_us() + 200'000);
            kill(pid_, signal);
            EXPECT_EQ(wait(), 0) << text("err");
            EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(line_)));
        }
    }
}

TEST_F(DaemonProgram, AWorldThatHangsUpIsToldByTheExitCode) {
    FakeWorld world(sim::WorldPace::kLockstep);
    std::thread hangs_up([&] {
        world.accept_and_greet();
        world.send(frame_set(0, 0, 10'000));
        sim::WorldMessage message;
        static_cast<void>(world.receive(message));
        world.hang_up();
    });
    EXPECT_EQ(run({"--world", world.path(), "--link", "pty:" + line_}), 5);
    hangs_up.join();
    EXPECT_NE(text("err").find("closed the connection"), std::string::npos) << text("err");
}

TEST_F(DaemonProgram, TheExecutorMustFitTheWorld) {
    FakeWorld world(sim::WorldPace::kLockstep);
    std::thread greeter([&] { world.accept_and_greet(); });
    EXPECT_EQ(run({"--world", world.path(), "--link", "pty:" + line_, "--executor", "threads"}), 2);
    greeter.join();
    EXPECT_NE(text("err").find("--executor lockstep"), std::string::npos) << text("err");
}

}  // namespace
}  // namespace rig::test
