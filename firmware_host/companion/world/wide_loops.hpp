// Marks a function whose plain loops are worth a second copy for wider vectors, chosen when the program
// starts. Both copies do the same operations on each element in the same order (no contraction, no
// reassociation), so the results are equal. Sanitizers are not ready when the choice is made, and other
// compilers have no such thing.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define RIG_WIDE_LOOPS __attribute__((target_clones("avx2", "default")))
#else
#define RIG_WIDE_LOOPS
#endif
