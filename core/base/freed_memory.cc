#include "core/base/freed_memory.h"

#include <cstdlib>  // says whether this is glibc

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace rilievo {

void ReleaseToOs() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

void ReleaseToOsAfter(int64_t points) {
  if (points >= kLargeScan) ReleaseToOs();
}

void ReleaseLargeBlocksAtOnce() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
}

}  // namespace rilievo
