// info, status, monitor and record as a person runs them: the program itself, a board behind a
// pseudo-terminal.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <thread>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/links/recording.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "hal/linux/pty_link.hpp"
#include "hal/linux/udp_link.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/text_checks.hpp"
#include "tests/support/wire/simulated_board.hpp"

namespace {

using rig::test::has;

using namespace rig;

double weight_of(std::uint32_t tick, std::size_t shape) {
    return static_cast<double>(test::SimulatedBoard::weight_of(tick, shape));
}

// A board that lives on a thread of its own until it is destroyed.
class LivingBoard {
  public:
    LivingBoard(std::unique_ptr<ByteLink> link, const test::BoardOptions& options)
        : link_(std::move(link)), thread_([this, options] { live(options); }) {}
    ~LivingBoard() {
        ended_ = true;
        thread_.join();
    }
    LivingBoard(const LivingBoard&) = delete;
    LivingBoard& operator=(const LivingBoard&) = delete;

  private:
    void live(const test::BoardOptions& options) {
        MonotonicClock clock;
        test::SimulatedBoard board(*link_, options);
        while (!ended_) {
            board.poll(clock.now_us());
            clock.sleep_until_us(clock.now_us() + 500);
        }
        link_->close();
    }

    std::unique_ptr<ByteLink> link_;
    std::atomic<bool> ended_{false};
    std::thread thread_;
};

struct Ran {
    int exit_code = -1;
    std::string out;
    std::string err;
};

std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

class LinkVerbs : public testing::Test {
  protected:
    std::unique_ptr<LivingBoard> board_on_pty(const test::BoardOptions& options = {}) {
        auto link = std::make_unique<PtyLink>(path("rig"));
        EXPECT_TRUE(link->open().has_value());
        return std::make_unique<LivingBoard>(std::move(link), options);
    }
    std::string path(std::string_view name) const { return (folder_ / name).string(); }

    // Runs `headrig <arguments>` with its output in files; with interrupt_after_s >= 0 it gets a Ctrl-C then.
    Ran run(const std::vector<std::string>& arguments, double interrupt_after_s = -1.0) {
        const pid_t child = fork();
        if (child == 0) become_companion(arguments);
        if (interrupt_after_s >= 0.0) {
            usleep(static_cast<useconds_t>(interrupt_after_s * 1.0e6));
            kill(child, SIGINT);
        }
        int status = 0;
        waitpid(child, &status, 0);
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text_of(path("out")),
                text_of(path("err"))};
    }

    test::TempFolder folder_;

  private:
    [[noreturn]] void become_companion(std::vector<std::string> arguments) {
        if (std::freopen(path("out").c_str(), "w", stdout) == nullptr) _exit(126);
        if (std::freopen(path("err").c_str(), "w", stderr) == nullptr) _exit(126);
        std::vector<char*> words{const_cast<char*>(RIG_COMPANION_PROGRAM)};
        for (std::string& argument : arguments) words.push_back(argument.data());
        words.push_back(nullptr);
        execv(RIG_COMPANION_PROGRAM, words.data());
        _exit(127);
    }
};

TEST_F(LinkVerbs, InfoTellsWhoIsThere) {
    const auto board = board_on_pty({.clock_ahead_us = 5'000'000});
    const Ran ran = run({"info", "--link", path("rig")});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_TRUE(has(ran.out, "rig: test-rig\n")) << ran.out;
    EXPECT_TRUE(has(ran.out, "firmware: 9.9.9\n"));
    EXPECT_TRUE(has(ran.out, "shapes (5): shape_0 shape_1 shape_2 shape_3 shape_4\n"));
    EXPECT_TRUE(has(ran.out, "markers (4): marker_0"));
    EXPECT_TRUE(has(ran.out, "clocks: board ahead by 5.0") || has(ran.out, "clocks: board ahead by 4.9"))
        << ran.out;
    EXPECT_EQ(ran.out.find('\x1b'), std::string::npos);
}

TEST_F(LinkVerbs, StatusTellsFaultsInWordsAndChecks) {
    const auto board = board_on_pty({.faults = fault_bit(Fault::kCameraGone)});
    const Ran ran = run({"status", "--link", path("rig")});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_TRUE(has(ran.out, "state: LIVE\n")) << ran.out;
    EXPECT_TRUE(has(ran.out, "F01 now (1 time): A camera is unplugged")) << ran.out;
    EXPECT_EQ(run({"status", "--link", path("rig"), "--check"}).exit_code, 1);
}

TEST_F(LinkVerbs, StatusListsEveryFaultWithoutARig) {
    const Ran ran = run({"status", "--list-faults"});
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 55);
    EXPECT_TRUE(ran.out.starts_with("F01 "));
}

TEST_F(LinkVerbs, ControlSetsAndRefuses) {
    const auto board = board_on_pty();
    Ran ran = run({"control", "--link", path("rig"), "--set", "shape_1.sparsity=2", "--set",
                   "all.range=0,0.8", "--set", "shape_2,shape_3.cancel=1"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(ran.out, "3 controls set\n");
    ran = run({"control", "--link", path("rig"), "--set", "ears.sparsity=2"});
    EXPECT_EQ(ran.exit_code, 2);
    EXPECT_TRUE(has(ran.err, "'ears' is neither a shape of this rig nor a region")) << ran.err;
    EXPECT_EQ(run({"control", "--link", path("rig"), "--controls", path("nosuch.toml")}).exit_code, 3);
    ran = run({"control", "--link", path("rig"), "--list-shapes"});
    EXPECT_EQ(ran.out, "shape_0\nshape_1\nshape_2\nshape_3\nshape_4\n");
}

TEST_F(LinkVerbs, ControlTellsWhenTheBoardSaysNo) {
    const auto board = board_on_pty({.busy = true});
    const Ran ran = run({"control", "--link", path("rig"), "--neutral"});
    EXPECT_EQ(ran.exit_code, 5);
    EXPECT_TRUE(has(ran.err, "does not allow")) << ran.err;
}

TEST_F(LinkVerbs, MonitorIsPlainOnAPipe) {
    const auto board = board_on_pty();
    const Ran ran = run({"monitor", "--link", path("rig"), "--seconds", "2.5"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 3) << ran.out;
    EXPECT_TRUE(has(ran.out, "LIVE rate")) << ran.out;
    EXPECT_EQ(ran.out.find('\x1b'), std::string::npos);
}

TEST_F(LinkVerbs, MonitorEndsOnCtrlC) {
    const auto board = board_on_pty();
    const Ran ran = run({"monitor", "--link", path("rig")}, 1.5);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
}

TEST_F(LinkVerbs, RecordWritesWhatWasSent) {
    const auto board = board_on_pty({.shape_count = 200, .marker_count = 100});
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("w.csv"), "--raw", path("w.rec"),
                         "--markers", path("m.npy"), "--frames", "120"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    const auto table = host::read_numeric_csv(path("w.csv"));
    ASSERT_TRUE(table.has_value()) << table.error().message;
    EXPECT_GE(table->row_count, 120U);
    ASSERT_EQ(table->columns.size(), 202U);
    EXPECT_EQ(table->columns[201], "shape_199");
    const auto value = [&](std::size_t row, std::size_t column) { return table->values[row * 202 + column]; };
    // The board's weights are a function of its tick; the first row tells which tick the recording began
    // with.
    std::uint32_t first_tick = 0;
    while (first_tick < 1024 && std::abs(value(0, 2) - weight_of(first_tick, 0)) > 1e-4) ++first_tick;
    ASSERT_LT(first_tick, 1024U);
    for (std::size_t row = 0; row < table->row_count; ++row) {
        const auto tick = first_tick + static_cast<std::uint32_t>(value(row, 0));
        EXPECT_NEAR(value(row, 1), value(row, 0) * 0.016667, 1e-5);
        for (std::size_t s = 0; s < 200; ++s) {
            ASSERT_NEAR(value(row, 2 + s), weight_of(tick, s), 6e-5) << row << ' ' << s;
        }
    }
    const auto markers = host::read_npy<float>(path("m.npy"));
    ASSERT_TRUE(markers.has_value()) << markers.error().message;
    EXPECT_EQ(markers->shape, (std::vector<std::size_t>{table->row_count, 100, 3}));
    EXPECT_FLOAT_EQ(markers->values[98 * 3], 98.0F);
    EXPECT_TRUE(std::isnan(markers->values[99 * 3]));
    auto reader = host::RecordingReader::open(path("w.rec"));
    ASSERT_TRUE(reader.has_value());
    const auto summary = host::summarise(*reader);
    EXPECT_EQ(summary.unread_bytes, 0U);
    EXPECT_GE(summary.states, table->row_count);
    EXPECT_EQ(summary.shape_names.size(), 200U);
    const Ran info = run({"info", path("w.rec")});
    EXPECT_EQ(info.exit_code, 0) << info.err;
    EXPECT_TRUE(has(info.out, "rig: test-rig"));
}

TEST_F(LinkVerbs, RecordAndMonitorTellTheHeadOfARigWhoseCamerasAreNotOnIt) {
    const auto board = board_on_pty({.tells_head = true});
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("w.csv"), "--frames", "40"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_TRUE(has(ran.out, "w.head.csv: head pose known in 30 of 40 states")) << ran.out;
    const std::string head = text_of(path("w.head.csv"));
    EXPECT_TRUE(has(head, "frame,time_s,status,turn_x_rad")) << head;
    EXPECT_TRUE(has(head, ",too few markers,")) << head;
    EXPECT_EQ(std::count(head.begin(), head.end(), '\n'), 41);
    const Ran watched = run({"monitor", "--link", path("rig"), "--seconds", "1.5"});
    EXPECT_TRUE(has(watched.out, "head pose: ")) << watched.out;
}

TEST_F(LinkVerbs, ARigOnTheHeadHasNoTableOfHeadPoses) {
    const auto board = board_on_pty();
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("w.csv"), "--frames", "20"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_FALSE(std::filesystem::exists(path("w.head.csv")));
}

TEST_F(LinkVerbs, RecordWithoutALimitEndsWellOnCtrlC) {
    const auto board = board_on_pty();
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("w.csv")}, 1.5);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_TRUE(has(ran.out, "states of 5 shapes")) << ran.out;
    const auto table = host::read_numeric_csv(path("w.csv"));
    ASSERT_TRUE(table.has_value()) << table.error().message;
    EXPECT_GT(table->row_count, 20U);
}

TEST_F(LinkVerbs, RecordBeforeItsLimitSaysInterruptedAndKeepsTheFile) {
    const auto board = board_on_pty();
    EXPECT_EQ(
        run({"record", "--link", path("rig"), "--out", path("w.csv"), "--seconds", "60"}, 1.5).exit_code,
        130);
    EXPECT_TRUE(host::read_numeric_csv(path("w.csv")).has_value());
}

TEST_F(LinkVerbs, ARigThatGoesAwayIsNamedAndTheFileKept) {
    auto board = board_on_pty();
    std::thread unplug([&] {
        usleep(1'500'000);
        board.reset();
    });
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("w.csv"), "--seconds", "60"});
    unplug.join();
    EXPECT_EQ(ran.exit_code, 5);
    EXPECT_TRUE(has(ran.err, "closed by the other side")) << ran.err;
    const auto table = host::read_numeric_csv(path("w.csv"));
    ASSERT_TRUE(table.has_value());
    EXPECT_GT(table->row_count, 20U);
}

TEST_F(LinkVerbs, WorksOverUdp) {
    const auto local = resolve_udp("127.0.0.1", 0);
    ASSERT_TRUE(local.has_value());
    auto link = std::make_unique<UdpLink>(*local, UdpAddress{});
    ASSERT_TRUE(link->open().has_value());
    const std::string spec = "udp:127.0.0.1:" + std::to_string(link->local_port());
    const LivingBoard board(std::move(link), {.shape_count = 256});
    const Ran ran = run({"record", "--link", spec, "--out", path("w.csv"), "--frames", "30"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_TRUE(has(ran.out, "states of 256 shapes")) << ran.out;
}

TEST_F(LinkVerbs, ErrorsSayWhatToDo) {
    EXPECT_EQ(run({"status", "--link", "nonsense"}).exit_code, 2);
    EXPECT_EQ(run({"info"}).exit_code, 2);
    EXPECT_EQ(run({"record", "--link", path("rig")}).exit_code, 2) << "--out is missing";
    const Ran missing = run({"status", "--link", path("none")});
    EXPECT_EQ(missing.exit_code, 5);
    EXPECT_TRUE(has(missing.err, "there is no")) << missing.err;
    const Ran silent = run({"info", "--link", "udp:127.0.0.1:9", "--timeout", "0.5"});
    EXPECT_EQ(silent.exit_code, 5);
    EXPECT_TRUE(has(silent.err, "no rig answers")) << silent.err;
    std::ofstream(path("bad.rec")) << "hello";
    const Ran bad = run({"info", path("bad.rec")});
    EXPECT_EQ(bad.exit_code, 3);
    EXPECT_TRUE(has(bad.err, "bad.rec")) << bad.err;
    const auto busy = board_on_pty({.busy = true});
    const Ran refused = run({"record", "--link", path("rig"), "--out", path("w.csv"), "--seconds", "1"});
    EXPECT_EQ(refused.exit_code, 5);
    EXPECT_TRUE(has(refused.err, "another host owns the session")) << refused.err;
}

TEST_F(LinkVerbs, AFileThatCannotBeWrittenIsNamed) {
    const auto board = board_on_pty();
    const Ran ran = run({"record", "--link", path("rig"), "--out", path("no/w.csv"), "--seconds", "1"});
    EXPECT_EQ(ran.exit_code, 4);
    EXPECT_TRUE(has(ran.err, "no/w.csv")) << ran.err;
}

}  // namespace
