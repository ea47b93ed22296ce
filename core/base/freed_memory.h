// Freed memory goes back to the system between stages.
#pragma once

namespace rilievo {

// Gives back what the allocator keeps of memory already freed: what one stage needed for a while
// would otherwise lie beneath what the next one needs. For glibc; does nothing elsewhere.
void ReturnFreedMemory();

}  // namespace rilievo
