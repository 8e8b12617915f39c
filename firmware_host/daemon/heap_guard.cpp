#include "firmware_host/daemon/heap_guard.hpp"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RIG_HEAP_GUARD_ACTIVE 0
#else
#define RIG_HEAP_GUARD_ACTIVE 1
#endif

namespace rig {

namespace {

std::atomic<bool> sealed{false};
std::atomic<bool> aborts{false};
std::atomic<std::uint32_t> calls{0};

}  // namespace

void seal_heap() {
    const char* mode = std::getenv("RIG_HEAP_GUARD");
    aborts = mode != nullptr && std::strcmp(mode, "abort") == 0;
    sealed = true;
}

void unseal_heap() {
    sealed = false;
}

std::uint32_t heap_calls_after_seal() {
    return calls.load(std::memory_order_relaxed);
}

bool heap_guard_is_active() {
    return RIG_HEAP_GUARD_ACTIVE != 0;
}

#if RIG_HEAP_GUARD_ACTIVE
namespace {

void note_heap_call() {
    if (!sealed.load(std::memory_order_relaxed)) return;
    calls.fetch_add(1, std::memory_order_relaxed);
    if (!aborts.load(std::memory_order_relaxed)) return;
    constexpr char kLine[] = "headrigd: a heap call after seal(), and RIG_HEAP_GUARD=abort\n";
    const ssize_t ignored = write(STDERR_FILENO, kLine, sizeof(kLine) - 1);
    static_cast<void>(ignored);
    std::abort();
}

}  // namespace
#endif

}  // namespace rig

#if RIG_HEAP_GUARD_ACTIVE
// glibc's own entry points under the names that it exports for exactly this. operator new of libstdc++ calls
// malloc, so it is caught here too. NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size) {
    rig::note_heap_call();
    return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
    rig::note_heap_call();
    return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
    rig::note_heap_call();
    return __libc_realloc(memory, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
    rig::note_heap_call();
    return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
    rig::note_heap_call();
    return __libc_memalign(alignment, size);
}

int posix_memalign(void** into, std::size_t alignment, std::size_t size) {
    rig::note_heap_call();
    const bool power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
    if (!power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
    void* memory = __libc_memalign(alignment, size);
    if (memory == nullptr) return ENOMEM;
    *into = memory;
    return 0;
}

void free(void* memory) {
    if (memory != nullptr) rig::note_heap_call();
    __libc_free(memory);
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)
#endif
