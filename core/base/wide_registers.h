// Kernels in two versions, one for wider registers where the machine has them.
#pragma once

#include <cstdlib>  // says whether this is glibc

// Before a free function over plain arrays; what it calls has to be inlined. The wider version
// knows no fused multiplication, so both agree to the last bit on x86-64. Nothing where the
// compiler or the C library cannot choose at start-up, nor under a sanitizer.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RILIEVO_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define RILIEVO_WIDE
#endif
