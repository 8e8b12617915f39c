// Every system call of a link or store fails once, with every errno that matters, at every place: the answer
// is a value of the contract, no descriptor leaks, and when the kernel is well again so is the backend.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <vector>

#include "hal/linux/posix_store.hpp"
#include "hal/linux/pty_link.hpp"
#include "hal/linux/tty_link.hpp"
#include "tests/contract/hal/fake_kernel.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

constexpr std::array kErrors{EIO,    ENODEV, ENXIO,  ENOENT, EACCES, EMFILE,
                             ENOMEM, ENOSPC, EAGAIN, EINTR,  EBADF,  EINVAL};

class LinkFixture {
  public:
    virtual ~LinkFixture() = default;
    [[nodiscard]] virtual ByteLink& link() = 0;
    virtual void join_other() = 0;
    [[nodiscard]] virtual std::size_t read_other(MutableByteSpan into) = 0;
};

class PtyFixture final : public LinkFixture {
  public:
    ByteLink& link() override { return link_; }
    void join_other() override {
        slave_ = os::Descriptor(::open((folder_ / "rig").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
    }
    std::size_t read_other(MutableByteSpan into) override {
        const ssize_t got = ::read(slave_.get(), into.data(), into.size());
        return got < 0 ? 0 : static_cast<std::size_t>(got);
    }

  private:
    TempFolder folder_;
    PtyLink link_{folder_ / "rig"};
    os::Descriptor slave_;
};

class TtyFixture final : public LinkFixture {
  public:
    TtyFixture() {
        master_ = os::Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK));
        static_cast<void>(grantpt(master_.get()));
        static_cast<void>(unlockpt(master_.get()));
        std::array<char, 64> name{};
        static_cast<void>(ptsname_r(master_.get(), name.data(), name.size()));
        link_ = std::make_unique<TtyLink>(name.data(), 115'200);
    }
    ByteLink& link() override { return *link_; }
    void join_other() override {}
    std::size_t read_other(MutableByteSpan into) override {
        const ssize_t got = ::read(master_.get(), into.data(), into.size());
        return got < 0 ? 0 : static_cast<std::size_t>(got);
    }

    void unplug() { master_.reset(); }

  private:
    os::Descriptor master_;
    std::unique_ptr<TtyLink> link_;
};

template <class Fixture>
class FailingKernelLink : public testing::Test {
  protected:
    void TearDown() override { heal(); }

    Fixture fixture_;
    ByteLink& link_ = fixture_.link();
    std::vector<std::byte> bytes_{20, std::byte{0x5A}};

    void expect_in_order() {
        ASSERT_TRUE(link_.open());
        fixture_.join_other();
        std::vector<std::byte> arrived(100);
        while (fixture_.read_other(arrived) > 0) {  // what an earlier round has left
        }
        ASSERT_EQ(link_.write(bytes_).value(), bytes_.size());
        arrived.resize(fixture_.read_other(arrived));
        EXPECT_EQ(arrived, bytes_);
    }
};

using LinkFixtures = testing::Types<PtyFixture, TtyFixture>;
TYPED_TEST_SUITE(FailingKernelLink, LinkFixtures);

TYPED_TEST(FailingKernelLink, OpenFailsWholeOrNotAtAll) {
    for (const int error_number : kErrors) {
        int failures = 0;
        bool hit = true;
        for (std::uint64_t nth = 0; hit; ++nth) {
            SCOPED_TRACE(testing::Message() << "errno " << error_number << " at call " << nth);
            this->link_.close();
            const int before = open_descriptors();
            fail_call(nth, error_number);
            const auto opened = this->link_.open();
            hit = has_failed();
            heal();
            if (!opened) {
                ++failures;
                EXPECT_EQ(opened.error(), LinkError::kOpen);
                EXPECT_EQ(this->link_.write(this->bytes_).error(), LinkError::kClosed);
                EXPECT_EQ(open_descriptors(), before) << "a descriptor leaks";
            }
            this->expect_in_order();
            if (testing::Test::HasFatalFailure()) return;
        }
        // A call that a signal interrupts is made again.
        if (error_number == EINTR) {
            EXPECT_EQ(failures, 0);
        } else {
            EXPECT_GE(failures, 3);
        }
    }
}

TYPED_TEST(FailingKernelLink, TransfersFailAsValues) {
    for (const int error_number : kErrors) {
        bool hit = true;
        for (std::uint64_t nth = 0; hit; ++nth) {
            SCOPED_TRACE(testing::Message() << "errno " << error_number << " at call " << nth);
            this->expect_in_order();
            fail_call(nth, error_number);
            std::array<std::byte, 8> into{};
            const auto written = this->link_.write(this->bytes_);
            const auto got = this->link_.read(into);
            hit = has_failed();
            heal();
            if (!written) {
                EXPECT_NE(written.error(), LinkError::kOpen);
            }
            if (written) {
                EXPECT_LE(*written, this->bytes_.size());
            }
            if (!got) {
                EXPECT_NE(got.error(), LinkError::kOpen);
            }
            if (error_number == EAGAIN) {
                EXPECT_TRUE(written && got);
            }
            if (error_number == EINTR) {
                EXPECT_TRUE(written && *written == this->bytes_.size());
            }
            if (testing::Test::HasFatalFailure()) return;
        }
    }
}

TYPED_TEST(FailingKernelLink, EndlessInterruptionEnds) {
    this->expect_in_order();
    fail_call(0, EINTR, true);
    static_cast<void>(this->link_.write(this->bytes_));
    heal();
}

TYPED_TEST(FailingKernelLink, TransfersOfOneByteAreCounted) {
    this->expect_in_order();
    limit_transfers(1);
    EXPECT_EQ(this->link_.write(this->bytes_).value(), 1U);
    limit_transfers(0);
}

TEST(FailingKernelTty, HangUpIsClosedAndEioToo) {
    TtyFixture fixture;
    std::array<std::byte, 8> bytes{};
    ASSERT_TRUE(fixture.link().open());
    fail_call(0, EIO);
    EXPECT_EQ(fixture.link().read(bytes).error(), LinkError::kClosed);
    heal();
    EXPECT_EQ(fixture.link().write(bytes).error(), LinkError::kClosed);  // sticky
    ASSERT_TRUE(fixture.link().open());
    fixture.unplug();
    EXPECT_EQ(fixture.link().read(bytes).error(), LinkError::kClosed);
    EXPECT_EQ(fixture.link().open().error(), LinkError::kOpen);
}

TEST(FailingKernelPty, EioIsNobodyThere) {
    PtyFixture fixture;
    std::array<std::byte, 8> bytes{};
    ASSERT_TRUE(fixture.link().open());
    fixture.join_other();
    fail_call(1, EIO);  // poll() first, then write()
    EXPECT_EQ(fixture.link().write(bytes).value(), 0U);
    EXPECT_EQ(failed_call(), "write");
    fail_call(0, EIO);
    EXPECT_EQ(fixture.link().read(bytes).value(), 0U);
    heal();
    EXPECT_EQ(fixture.link().write(bytes).value(), bytes.size());
}

class FailingKernelStore : public testing::Test {
  protected:
    void TearDown() override {
        heal();
        limit_transfers(0);
    }
    static constexpr std::size_t kSize = 9000;
    TempFolder folder_;
    PosixStore store_{folder_ / "store", kSize};
    std::vector<std::byte> bytes_{100, std::byte{3}};
};

TEST_F(FailingKernelStore, OpenLeavesNoHalfMadeFile) {
    for (const int error_number : kErrors) {
        bool hit = true;
        for (std::uint64_t nth = 0; hit; ++nth) {
            SCOPED_TRACE(testing::Message() << "errno " << error_number << " at call " << nth);
            store_.close();
            std::filesystem::remove(folder_ / "store");
            const int before = open_descriptors();
            fail_call(nth, error_number);
            const auto opened = store_.open();
            hit = has_failed();
            heal();
            EXPECT_FALSE(std::filesystem::exists(folder_ / "store.new"));
            EXPECT_EQ(open_descriptors(), before + (opened ? 1 : 0));
            if (std::filesystem::exists(folder_ / "store")) {
                EXPECT_EQ(std::filesystem::file_size(folder_ / "store"), kSize);
            }
            if (error_number == EINTR) {
                EXPECT_TRUE(opened);
            }
            ASSERT_TRUE(store_.open());
            std::vector<std::byte> all(kSize);
            ASSERT_TRUE(store_.read(0, all));
            EXPECT_EQ(all, std::vector<std::byte>(kSize, std::byte{0xFF}));
        }
    }
}

TEST_F(FailingKernelStore, NoSpaceIsSaid) {
    ASSERT_TRUE(store_.open());
    fail_call(0, ENOSPC);
    EXPECT_EQ(store_.program(0, bytes_).error(), StoreError::kNoSpace);
    fail_call(0, EIO);
    EXPECT_EQ(store_.erase(0, 100).error(), StoreError::kIo);
    fail_call(0, EIO);
    EXPECT_EQ(store_.read(0, bytes_).error(), StoreError::kIo);
}

TEST_F(FailingKernelStore, AfterAFailedSyncNothingIsTrustedUntilReopened) {
    ASSERT_TRUE(store_.open());
    ASSERT_TRUE(store_.program(0, bytes_));
    fail_call(0, EIO);
    EXPECT_EQ(store_.sync().error(), StoreError::kIo);
    heal();
    EXPECT_EQ(store_.sync().error(), StoreError::kIo);
    EXPECT_EQ(store_.read(0, bytes_).error(), StoreError::kIo);
    EXPECT_EQ(store_.program(0, bytes_).error(), StoreError::kIo);
    ASSERT_TRUE(store_.open());
    EXPECT_TRUE(store_.sync());
}

TEST_F(FailingKernelStore, ShortTransfersAreContinued) {
    limit_transfers(7);
    ASSERT_TRUE(store_.open());
    ASSERT_TRUE(store_.program(50, bytes_));
    std::vector<std::byte> back(bytes_.size());
    ASSERT_TRUE(store_.read(50, back));
    EXPECT_EQ(back, bytes_);
}

}  // namespace
}  // namespace rig::test
