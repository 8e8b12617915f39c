// The contract of hal/store.hpp, on every backend, and what a power cut may leave behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "hal/linux/posix_store.hpp"
#include "hal/sim/memory_store.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

constexpr std::size_t kSize = 10'000;

std::vector<std::byte> filled(std::size_t count, unsigned value) {
    return std::vector<std::byte>(count, static_cast<std::byte>(value));
}

std::vector<std::byte> read_back(Store& store, std::size_t offset, std::size_t length) {
    std::vector<std::byte> bytes(length);
    EXPECT_TRUE(store.read(offset, bytes));
    return bytes;
}

class StoreBench {
  public:
    virtual ~StoreBench() = default;
    [[nodiscard]] virtual Store& store() = 0;
    virtual void restart() = 0;  // as after a clean end of the process
};

class MemoryBench final : public StoreBench {
  public:
    Store& store() override { return store_; }
    void restart() override {
        store_.cut_power_now(sim::CutOutcome::kNotDone);
        store_.power_on();
    }

  private:
    sim::MemoryStore store_{kSize};
};

class PosixBench final : public StoreBench {
  public:
    PosixBench() { EXPECT_TRUE(store_->open()); }
    Store& store() override { return *store_; }
    void restart() override {
        store_ = std::make_unique<PosixStore>(folder_ / "store", kSize);
        ASSERT_TRUE(store_->open());
    }

  private:
    TempFolder folder_;
    std::unique_ptr<PosixStore> store_ = std::make_unique<PosixStore>(folder_ / "store", kSize);
};

struct StoreBackend {
    const char* name;
    std::unique_ptr<StoreBench> (*make)();
};

class StoreContract : public testing::TestWithParam<StoreBackend> {
  protected:
    std::unique_ptr<StoreBench> bench_ = GetParam().make();
};

TEST_P(StoreContract, StartsErased) {
    EXPECT_EQ(bench_->store().size_bytes(), kSize);
    EXPECT_EQ(read_back(bench_->store(), 0, kSize), filled(kSize, 0xFF));
}

TEST_P(StoreContract, ProgramChangesExactlyItsRange) {
    Store& store = bench_->store();
    ASSERT_TRUE(store.program(4000, filled(500, 0xA5)));
    EXPECT_EQ(read_back(store, 4000, 500), filled(500, 0xA5));
    EXPECT_EQ(read_back(store, 0, 4000), filled(4000, 0xFF));
    EXPECT_EQ(read_back(store, 4500, kSize - 4500), filled(kSize - 4500, 0xFF));
}

TEST_P(StoreContract, EraseSetsItsRangeOnly) {
    Store& store = bench_->store();
    ASSERT_TRUE(store.program(0, filled(kSize, 0)));
    ASSERT_TRUE(store.erase(100, 8192));
    EXPECT_EQ(read_back(store, 100, 8192), filled(8192, 0xFF));
    EXPECT_EQ(read_back(store, 0, 100), filled(100, 0));
    EXPECT_EQ(read_back(store, 8292, kSize - 8292), filled(kSize - 8292, 0));
}

TEST_P(StoreContract, RangesAreChecked) {
    Store& store = bench_->store();
    std::vector<std::byte> one(1);
    EXPECT_EQ(store.read(kSize, one).error(), StoreError::kOutOfRange);
    EXPECT_EQ(store.program(kSize, one).error(), StoreError::kOutOfRange);
    EXPECT_EQ(store.erase(0, kSize + 1).error(), StoreError::kOutOfRange);
    EXPECT_EQ(store.erase(~std::size_t{0}, 2).error(), StoreError::kOutOfRange);
    EXPECT_EQ(store.erase(2, ~std::size_t{0}).error(), StoreError::kOutOfRange);
    EXPECT_TRUE(store.erase(kSize, 0));
    EXPECT_TRUE(store.program(kSize, {}));
}

TEST_P(StoreContract, SyncedChangesSurviveARestart) {
    ASSERT_TRUE(bench_->store().program(10, filled(20, 7)));
    ASSERT_TRUE(bench_->store().sync());
    bench_->restart();
    EXPECT_EQ(read_back(bench_->store(), 10, 20), filled(20, 7));
}

INSTANTIATE_TEST_SUITE_P(Backends, StoreContract,
                         testing::Values(StoreBackend{"Memory",
                                                      []() -> std::unique_ptr<StoreBench> {
                                                          return std::make_unique<MemoryBench>();
                                                      }},
                                         StoreBackend{"Posix",
                                                      []() -> std::unique_ptr<StoreBench> {
                                                          return std::make_unique<PosixBench>();
                                                      }}),
                         [](const auto& backend) { return std::string(backend.param.name); });

// A change of two halves with one sync, cut at every operation in every way: before the sync nothing is
// promised but old, half or new bytes; from a good sync on, new bytes.
TEST(MemoryStorePowerCut, EveryOperationInEveryWay) {
    for (const auto outcome : {sim::CutOutcome::kNotDone, sim::CutOutcome::kHalf, sim::CutOutcome::kDone}) {
        for (std::uint64_t cut = 0; cut <= 3; ++cut) {
            sim::MemoryStore store(100);
            ASSERT_TRUE(store.program(0, filled(100, 1)));
            ASSERT_TRUE(store.sync());
            const std::uint64_t first = store.operation_count();
            store.cut_power_at(first + cut, outcome);
            const bool first_done = store.program(0, filled(10, 2)).has_value();
            const bool second_done = store.program(50, filled(10, 3)).has_value();
            const bool synced = store.sync().has_value();
            EXPECT_EQ(first_done, cut > 0);
            EXPECT_EQ(second_done, cut > 1);
            EXPECT_EQ(synced, cut > 2);
            if (synced) {
                store.cut_power_now(outcome);
            }
            EXPECT_EQ(store.read(0, {}).error(), StoreError::kIo);
            store.power_on();
            const auto head = read_back(store, 0, 10);
            const auto middle = read_back(store, 50, 10);
            const auto done = static_cast<std::ptrdiff_t>(synced || outcome == sim::CutOutcome::kDone ? 10
                                                          : outcome == sim::CutOutcome::kHalf         ? 5
                                                                                                      : 0);
            EXPECT_EQ(std::count(head.begin(), head.end(), std::byte{2}), done);
            EXPECT_EQ(std::count(middle.begin(), middle.end(), std::byte{3}), cut >= 1 ? done : 0);
            EXPECT_EQ(read_back(store, 20, 30), filled(30, 1));
        }
    }
}

TEST(PosixStore, RefusesAFileOfAnotherSize) {
    const TempFolder folder;
    std::ofstream(folder / "store") << "short";
    PosixStore store(folder / "store", kSize);
    EXPECT_EQ(store.open().error(), StoreError::kOpen);
    EXPECT_EQ(std::filesystem::file_size(folder / "store"), 5U);  // and leaves it alone
}

TEST(PosixStore, LeavesNoTemporaryFile) {
    const TempFolder folder;
    PosixStore store(folder / "store", kSize);
    ASSERT_TRUE(store.open());
    EXPECT_FALSE(std::filesystem::exists(folder / "store.new"));
}

TEST(PosixStore, MissingFolderIsKOpen) {
    const TempFolder folder;
    PosixStore store(folder / "nowhere/store", kSize);
    EXPECT_EQ(store.open().error(), StoreError::kOpen);
    std::vector<std::byte> one(1);
    EXPECT_EQ(store.read(0, one).error(), StoreError::kIo);
}

}  // namespace
}  // namespace rig::test
