// A hint for large results: the system may back them with large pages.
#pragma once

#include <cstddef>

namespace rilievo {

// Says of memory about to be filled for the first time that it is one large piece. Saves most page
// faults where the system takes the hint (Linux, transparent huge pages at "madvise"); does nothing
// elsewhere, nor for less than two large pages. Contents do not change.
void HintLargePages(void* begin, size_t bytes);

}  // namespace rilievo
