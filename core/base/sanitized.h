// Whether this program carries a sanitizer, by the compiler's own word.
#pragma once

namespace rilievo {

// Such a program maps terabytes of shadow and keeps freed memory for a while, so no limit of memory
// fits it; and it ends with a report where another is ended by a signal.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace rilievo
