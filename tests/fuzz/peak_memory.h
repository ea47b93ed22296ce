// Memory that is asked for between two points of a program, counted where a sanitizer tells of it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#if defined(__SANITIZE_ADDRESS__)
#define RILIEVO_COUNTS_MEMORY
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define RILIEVO_COUNTS_MEMORY
#endif
#endif
#ifdef RILIEVO_COUNTS_MEMORY
#include <sanitizer/allocator_interface.h>
#endif

namespace rilievo {

// The most bytes that were held at once since it was made, beyond those held then; 0 without the
// address sanitizer. One at a time, and one thread.
class PeakMemory {
 public:
  PeakMemory() {
#ifdef RILIEVO_COUNTS_MEMORY
    static const int installed = __sanitizer_install_malloc_and_free_hooks(Taken, Given);
    (void)installed;
    held_ = peak_ = 0;
#endif
  }
  int64_t Peak() const { return peak_; }

 private:
#ifdef RILIEVO_COUNTS_MEMORY
  static void Taken(const volatile void* /*block*/, size_t size) {
    held_ += static_cast<int64_t>(size);
    peak_ = std::max(peak_, held_);
  }
  static void Given(const volatile void* block) {
    if (block == nullptr) return;
    held_ -= static_cast<int64_t>(__sanitizer_get_allocated_size(const_cast<const void*>(block)));
  }
#endif
  static inline int64_t held_ = 0, peak_ = 0;
};

}  // namespace rilievo
