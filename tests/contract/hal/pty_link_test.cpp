// What a pseudo-terminal does beyond the contract of every link: readers come late, go and come again.
#include "hal/linux/pty_link.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

os::Descriptor open_slave(const std::string& path) {
    return os::Descriptor(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
}

std::string read_some(const os::Descriptor& descriptor) {
    std::array<char, 4096> text{};
    std::string all;
    pollfd watched{descriptor.get(), POLLIN, 0};
    while (poll(&watched, 1, 20) == 1) {
        const ssize_t got = ::read(descriptor.get(), text.data(), text.size());
        if (got <= 0) break;
        all.append(text.data(), static_cast<std::size_t>(got));
    }
    return all;
}

ByteSpan bytes_of(std::string_view text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

class PtyLinkTest : public testing::Test {
  protected:
    TempFolder folder_;
    std::string path_ = folder_ / "rig";
    PtyLink link_{path_};

    std::string read_link() {
        std::array<std::byte, 256> bytes{};
        const auto got = link_.read(bytes);
        EXPECT_TRUE(got.has_value());
        return std::string(reinterpret_cast<const char*>(bytes.data()), got.value_or(0));
    }
};

TEST_F(PtyLinkTest, NobodyThereTakesNothing) {
    ASSERT_TRUE(link_.open());
    for (int i = 0; i < 100; ++i) EXPECT_EQ(link_.write(bytes_of("stale")).value(), 0U);
    EXPECT_EQ(read_link(), "");
    const os::Descriptor slave = open_slave(path_);
    ASSERT_EQ(link_.write(bytes_of("fresh")).value(), 5U);
    EXPECT_EQ(read_some(slave), "fresh");
}

TEST_F(PtyLinkTest, ReadersComeAndGo) {
    ASSERT_TRUE(link_.open());
    for (int i = 0; i < 5; ++i) {
        {
            const os::Descriptor slave = open_slave(path_);
            ASSERT_EQ(link_.write(bytes_of("unread")).value(), 6U);
            ASSERT_EQ(::write(slave.get(), "bye", 3), 3);
        }
        EXPECT_EQ(link_.write(bytes_of("stale")).value(), 0U);
        EXPECT_EQ(read_link(), "bye");  // what the last reader still said is not lost
        EXPECT_EQ(read_link(), "");
        const os::Descriptor next = open_slave(path_);
        ASSERT_EQ(link_.write(bytes_of("fresh")).value(), 5U);
        EXPECT_EQ(read_some(next), "fresh");
    }
}

TEST_F(PtyLinkTest, AFullBufferOfAReaderThatLeftIsDropped) {
    ASSERT_TRUE(link_.open());
    {
        const os::Descriptor slave = open_slave(path_);
        const std::vector<std::byte> block(1000, std::byte{'x'});
        std::size_t taken = 0;
        for (int i = 0; i < 500; ++i) taken += link_.write(block).value();
        EXPECT_GT(taken, 1000U);
        EXPECT_LT(taken, 200'000U);
    }
    EXPECT_EQ(link_.write(bytes_of("stale")).value(), 0U);
    const os::Descriptor next = open_slave(path_);
    ASSERT_EQ(link_.write(bytes_of("fresh")).value(), 5U);
    EXPECT_EQ(read_some(next), "fresh");
}

TEST_F(PtyLinkTest, NothingIsTranslatedAndNothingEchoed) {
    ASSERT_TRUE(link_.open());
    const os::Descriptor slave = open_slave(path_);
    const std::string nasty("\r\n\x03\x04\x11\x13\x7f\0\xff", 9);
    ASSERT_EQ(link_.write(bytes_of(nasty)).value(), nasty.size());
    EXPECT_EQ(read_some(slave), nasty);
    ASSERT_EQ(::write(slave.get(), nasty.data(), nasty.size()), static_cast<ssize_t>(nasty.size()));
    EXPECT_EQ(read_link(), nasty);
    EXPECT_EQ(read_some(slave), "");
}

TEST_F(PtyLinkTest, ClosingLetsAReaderTakeTheLastBytes) {
    ASSERT_TRUE(link_.open());
    const os::Descriptor slave = open_slave(path_);
    const std::string last(3000, 'z');
    ASSERT_EQ(link_.write(bytes_of(last)).value(), last.size());
    std::string got;
    std::thread reader([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        got = read_some(slave);
    });
    link_.close();
    reader.join();
    EXPECT_EQ(got, last);
}

TEST_F(PtyLinkTest, SymlinkIsPublishedReplacedAndRemoved) {
    std::filesystem::create_symlink("/nowhere", path_);  // a crashed daemon's
    ASSERT_TRUE(link_.open());
    EXPECT_EQ(std::filesystem::read_symlink(path_), link_.slave_path());
    link_.close();
    EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(path_)));
}

TEST_F(PtyLinkTest, SomebodyElsesSymlinkStays) {
    ASSERT_TRUE(link_.open());
    std::filesystem::remove(path_);
    std::filesystem::create_symlink("/dev/null", path_);
    link_.close();
    EXPECT_EQ(std::filesystem::read_symlink(path_), "/dev/null");
}

TEST_F(PtyLinkTest, AFileInTheWayRefuses) {
    std::ofstream(path_) << "precious";
    EXPECT_EQ(link_.open().error(), LinkError::kOpen);
    EXPECT_EQ(std::filesystem::file_size(path_), 8U);
    std::array<std::byte, 4> bytes{};
    EXPECT_EQ(link_.read(bytes).error(), LinkError::kClosed);
}

TEST_F(PtyLinkTest, WorksWithoutASymlink) {
    PtyLink link("");
    ASSERT_TRUE(link.open());
    const os::Descriptor slave = open_slave(link.slave_path());
    ASSERT_EQ(link.write(bytes_of("hello")).value(), 5U);
    EXPECT_EQ(read_some(slave), "hello");
}

}  // namespace
}  // namespace rig::test
