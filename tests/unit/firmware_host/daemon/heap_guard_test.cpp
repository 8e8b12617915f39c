#include "firmware_host/daemon/heap_guard.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <vector>

namespace rig::test {
namespace {

// What the optimiser must not remove.
void* volatile kept = nullptr;

TEST(HeapGuard, CountsEveryKindOfCallAfterTheSealOnly) {
    if (!heap_guard_is_active()) GTEST_SKIP() << "a sanitizer's allocator is in place";
    unsetenv("RIG_HEAP_GUARD");
    kept = std::malloc(10);
    const std::uint32_t before = heap_calls_after_seal();
    seal_heap();
    std::free(kept);
    kept = std::malloc(10);
    kept = std::realloc(kept, 100);
    std::free(kept);
    kept = std::calloc(3, 3);
    std::free(kept);
    void* aligned = nullptr;
    const int outcome = posix_memalign(&aligned, 64, 100);
    kept = aligned;
    std::free(kept);
    kept = ::operator new(5);
    ::operator delete(kept);
    unseal_heap();
    EXPECT_EQ(outcome, 0);
    EXPECT_EQ(heap_calls_after_seal() - before, 10U);
    const std::vector<int> afterwards(1000);
    EXPECT_EQ(heap_calls_after_seal() - before, 10U);
    EXPECT_EQ(afterwards.size(), 1000U);
}

TEST(HeapGuard, AlignedMemoryIsAligned) {
    for (const std::size_t alignment : {16U, 64U, 4096U}) {
        void* memory = nullptr;
        ASSERT_EQ(posix_memalign(&memory, alignment, 100), 0);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % alignment, 0U);
        std::free(memory);
    }
    if (!heap_guard_is_active()) return;  // a sanitizer ends the program where posix_memalign refuses
    void* memory = nullptr;
    EXPECT_NE(posix_memalign(&memory, 3, 100), 0);
}

TEST(HeapGuardDeath, AbortsWhenAskedTo) {
    if (!heap_guard_is_active()) GTEST_SKIP() << "a sanitizer's allocator is in place";
    EXPECT_DEATH(
        {
            setenv("RIG_HEAP_GUARD", "abort", 1);
            seal_heap();
            kept = std::malloc(1);
        },
        "heap call after seal");
}

}  // namespace
}  // namespace rig::test
