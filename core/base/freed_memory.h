// Freed memory goes back to the system between stages.
#pragma once

#include <cstdint>
#include <vector>

namespace rilievo {

// Frees the memory of a vector: `values = {}` would keep it, as clear() does.
template <typename T>
void FreeMemoryOf(std::vector<T>* values) {
  std::vector<T>().swap(*values);
}

// Points of a scan from which on memory counts for more than the hundredths of the time that it
// takes to return it and to make again what does not stay. Of 100 000 the peak would be lower by 2
// MB of 85.
inline constexpr int64_t kLargeScan = 200'000;

// Gives back what the allocator keeps of memory already freed: what one stage needed for a while
// would otherwise lie beneath what the next one needs. For glibc; does nothing elsewhere.
void ReleaseToOs();

// The same after work on so many points, where these are a large scan.
void ReleaseToOsAfter(int64_t points);

// For a program to call before much work, process-wide and for good: from here on a block of a
// megabyte or more goes back to the system as soon as it is freed. Left to itself the allocator of
// glibc soon keeps blocks of up to 32 MB, and of 500 000 points 30 bytes each lie in the holes
// between them; to ask for them anew takes up to a twentieth of the time. For glibc; does nothing
// elsewhere.
void ReleaseLargeBlocksAtOnce();

}  // namespace rilievo
