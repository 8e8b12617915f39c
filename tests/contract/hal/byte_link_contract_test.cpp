// The contract of hal/byte_link.hpp, on every backend that needs no hardware.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "hal/linux/descriptor.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "hal/linux/pty_link.hpp"
#include "hal/linux/tty_link.hpp"
#include "hal/linux/udp_link.hpp"
#include "hal/sim/faulty_link.hpp"
#include "hal/sim/loopback_link.hpp"
#include "hal/sim/manual_clock.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

using Bytes = std::vector<std::byte>;

Bytes pattern(std::size_t count, unsigned first = 0) {
    Bytes bytes(count);
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>((first + i * 7) & 0xFF);
    return bytes;
}

// The link under test and somebody at its other end.
class LinkBench {
  public:
    virtual ~LinkBench() = default;
    [[nodiscard]] virtual ByteLink& link() = 0;
    virtual void join_other() {}  // the other end comes
    virtual void send_other(ByteSpan bytes) = 0;
    // Everything that arrives within a moment, at most `limit` bytes.
    [[nodiscard]] virtual Bytes receive_other(std::size_t limit) = 0;
};

class LoopbackBench : public LinkBench {
  public:
    explicit LoopbackBench(sim::LoopbackKind kind) : pair_(4096, kind) {
        EXPECT_TRUE(pair_.far_end().open());
    }
    ByteLink& link() override { return pair_.near_end(); }
    void send_other(ByteSpan bytes) override {
        EXPECT_EQ(pair_.far_end().write(bytes).value(), bytes.size());
    }
    Bytes receive_other(std::size_t limit) override {
        Bytes all;
        Bytes part(limit);
        while (all.size() < limit) {
            const std::size_t got = pair_.far_end().read(part).value();
            if (got == 0) break;
            all.insert(all.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got));
        }
        return all;
    }

  private:
    sim::LoopbackPair pair_;
};

class FaultlessBench final : public LinkBench {
  public:
    ByteLink& link() override { return link_; }
    void send_other(ByteSpan bytes) override { inner_.send_other(bytes); }
    Bytes receive_other(std::size_t limit) override { return inner_.receive_other(limit); }

  private:
    LoopbackBench inner_{sim::LoopbackKind::kStream};
    sim::ManualClock clock_;
    sim::FaultPlan plan_;
    sim::FaultyLink link_{inner_.link(), clock_, plan_, 0};
};

Bytes drain(int descriptor, std::size_t limit) {
    Bytes all;
    while (all.size() < limit) {
        pollfd watched{descriptor, POLLIN, 0};
        if (poll(&watched, 1, 50) != 1) break;
        Bytes part(limit - all.size());
        const ssize_t got = ::read(descriptor, part.data(), part.size());
        if (got <= 0) break;
        all.insert(all.end(), part.begin(), part.begin() + got);
    }
    return all;
}

class PtyBench final : public LinkBench {
  public:
    ByteLink& link() override { return link_; }
    void join_other() override {
        slave_ = os::Descriptor(::open((folder_ / "rig").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
        ASSERT_TRUE(slave_.is_open());
    }
    void send_other(ByteSpan bytes) override {
        EXPECT_EQ(::write(slave_.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    }
    Bytes receive_other(std::size_t limit) override { return drain(slave_.get(), limit); }

  private:
    TempFolder folder_;
    PtyLink link_{folder_ / "rig"};
    os::Descriptor slave_;
};

// A serial port whose other end is the master of a pseudo-terminal.
class TtyBench final : public LinkBench {
  public:
    TtyBench() {
        master_ = os::Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK));
        EXPECT_EQ(grantpt(master_.get()), 0);
        EXPECT_EQ(unlockpt(master_.get()), 0);
        link_ = std::make_unique<TtyLink>(ptsname(master_.get()), 3'000'000);
    }
    ByteLink& link() override { return *link_; }
    void send_other(ByteSpan bytes) override {
        EXPECT_EQ(::write(master_.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    }
    Bytes receive_other(std::size_t limit) override { return drain(master_.get(), limit); }

  private:
    os::Descriptor master_;
    std::unique_ptr<TtyLink> link_;
};

class UdpBench final : public LinkBench {
  public:
    UdpBench() {
        const UdpAddress any = resolve_udp("127.0.0.1", 0).value();
        other_ = std::make_unique<UdpLink>(any, UdpAddress{});
        EXPECT_TRUE(other_->open());
        link_ = std::make_unique<UdpLink>(any, resolve_udp("127.0.0.1", other_->local_port()).value());
    }
    ByteLink& link() override { return *link_; }
    void join_other() override {
        // The other end learns our address from a first datagram.
        const Bytes hello = pattern(1);
        ASSERT_EQ(link_->write(hello).value(), 1U);
        ASSERT_EQ(receive_other(1).size(), 1U);
    }
    void send_other(ByteSpan bytes) override { EXPECT_EQ(other_->write(bytes).value(), bytes.size()); }
    Bytes receive_other(std::size_t limit) override {
        Bytes all;
        Bytes part(2048);
        while (all.size() < limit) {
            const std::size_t got = other_->read(part).value();
            if (got == 0) break;
            all.insert(all.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got));
        }
        return all;
    }

  private:
    std::unique_ptr<UdpLink> other_;
    std::unique_ptr<UdpLink> link_;
};

struct LinkBackend {
    const char* name;
    std::unique_ptr<LinkBench> (*make)();
};

class ByteLinkContract : public testing::TestWithParam<LinkBackend> {
  protected:
    std::unique_ptr<LinkBench> bench_ = GetParam().make();
    ByteLink& link_ = bench_->link();

    // What arrives at the link under test within a moment.
    Bytes receive(std::size_t limit) {
        Bytes all;
        MonotonicClock clock;
        const std::int64_t deadline_us = clock.now_us() + 200'000;
        while (all.size() < limit && clock.now_us() < deadline_us) {
            Bytes part(2048);
            const auto got = link_.read(part);
            EXPECT_TRUE(got.has_value());
            all.insert(all.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(*got));
            if (*got == 0) clock.sleep_until_us(clock.now_us() + 1000);
        }
        return all;
    }
};

TEST_P(ByteLinkContract, ClosedUntilOpened) {
    Bytes bytes = pattern(4);
    EXPECT_EQ(link_.write(bytes).error(), LinkError::kClosed);
    EXPECT_EQ(link_.read(bytes).error(), LinkError::kClosed);
    link_.close();
    EXPECT_EQ(link_.read(bytes).error(), LinkError::kClosed);
}

TEST_P(ByteLinkContract, EveryByteValueArrivesBothWays) {
    ASSERT_TRUE(link_.open());
    bench_->join_other();
    Bytes all(256);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::byte>(i);
    ASSERT_EQ(link_.write(all).value(), all.size());
    EXPECT_EQ(bench_->receive_other(all.size()), all);
    bench_->send_other(all);
    EXPECT_EQ(receive(all.size()), all);
}

TEST_P(ByteLinkContract, NothingThereIsZeroAndDoesNotBlock) {
    ASSERT_TRUE(link_.open());
    bench_->join_other();
    Bytes into(64);
    EXPECT_EQ(link_.read(into).value(), 0U);
    EXPECT_EQ(link_.read(MutableByteSpan{}).value(), 0U);
    EXPECT_EQ(link_.write(ByteSpan{}).value(), 0U);
}

// A reader that never reads costs bytes, never time; what was taken arrives as a prefix of what was sent.
TEST_P(ByteLinkContract, AReaderThatDoesNotReadNeverBlocks) {
    ASSERT_TRUE(link_.open());
    bench_->join_other();
    MonotonicClock clock;
    const std::int64_t started_us = clock.now_us();
    Bytes taken;
    int refused = 0;
    for (unsigned i = 0; i < 400; ++i) {
        const Bytes chunk = pattern(655, i);
        const auto count = link_.write(chunk);
        ASSERT_TRUE(count.has_value());
        ASSERT_LE(*count, chunk.size());
        ASSERT_TRUE(!link_.is_datagram() || *count == 0 || *count == chunk.size());
        taken.insert(taken.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(*count));
        refused += *count < chunk.size() ? 1 : 0;
    }
    EXPECT_LT(clock.now_us() - started_us, 2'000'000);
    const Bytes arrived = bench_->receive_other(taken.size());
    if (!link_.is_datagram()) {
        EXPECT_GT(refused, 0);
        EXPECT_EQ(arrived, taken);
    }
    EXPECT_GT(link_.write(pattern(10)).value(), 0U);  // and the link is in order again
}

TEST_P(ByteLinkContract, ReopeningWorks) {
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(link_.open());
        ASSERT_TRUE(link_.open());  // closes first
        bench_->join_other();
        const Bytes bytes = pattern(100, static_cast<unsigned>(i));
        ASSERT_EQ(link_.write(bytes).value(), bytes.size());
        EXPECT_EQ(bench_->receive_other(bytes.size()), bytes);
        link_.close();
        EXPECT_EQ(link_.write(bytes).error(), LinkError::kClosed);
    }
}

TEST_P(ByteLinkContract, DatagramsKeepTheirLimits) {
    if (!link_.is_datagram()) GTEST_SKIP() << "a stream";
    ASSERT_TRUE(link_.open());
    bench_->join_other();
    bench_->send_other(pattern(30));
    bench_->send_other(pattern(20, 9));
    Bytes into(64);
    EXPECT_EQ(link_.read(into).value(), 30U);
    EXPECT_EQ(link_.read(into).value(), 20U);
    EXPECT_EQ(link_.read(into).value(), 0U);
    bench_->send_other(pattern(200));  // longer than the span: lost whole
    EXPECT_EQ(link_.read(into).value(), 0U);
    bench_->send_other(pattern(5));
    EXPECT_EQ(link_.read(into).value(), 5U);
}

template <class Bench, auto... kArguments>
std::unique_ptr<LinkBench> make_bench() {
    return std::make_unique<Bench>(kArguments...);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, ByteLinkContract,
    testing::Values(LinkBackend{"LoopbackStream", make_bench<LoopbackBench, sim::LoopbackKind::kStream>},
                    LinkBackend{"LoopbackDatagram", make_bench<LoopbackBench, sim::LoopbackKind::kDatagram>},
                    LinkBackend{"FaultlessFaulty", make_bench<FaultlessBench>},
                    LinkBackend{"Pty", make_bench<PtyBench>}, LinkBackend{"Tty", make_bench<TtyBench>},
                    LinkBackend{"Udp", make_bench<UdpBench>}),
    [](const auto& backend) { return std::string(backend.param.name); });

}  // namespace
}  // namespace rig::test
