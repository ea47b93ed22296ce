// The border between C++ and C: statuses and exceptions become a code and a sentence.
#pragma once

#include <exception>
#include <new>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "client/decoder_c/rilievo_decoder.h"

namespace rilievo::decoder_c {

// Keeps the sentence for rilievo_last_error() and gives the code that C sees.
RilievoCode Fail(const absl::Status& status);
RilievoCode Fail(RilievoCode code, const char* sentence) noexcept;

// Runs `body`, which returns an absl::Status, and lets nothing but a code out.
template <typename Body>
RilievoCode Guarded(Body&& body) noexcept {
  try {
    const absl::Status status = std::forward<Body>(body)();
    return status.ok() ? RILIEVO_OK : Fail(status);
  } catch (const std::bad_alloc&) {
    return Fail(RILIEVO_RESOURCE_EXHAUSTED, "no memory left");
  } catch (const std::exception& error) {
    return Fail(RILIEVO_INTERNAL, error.what());
  } catch (...) {
    return Fail(RILIEVO_INTERNAL, "an exception of unknown kind");
  }
}

// A pointer to the elements of a vector or matrix, and how many there are.
template <typename Data>
auto Elements(const Data& data, size_t* count) {
  if (count != nullptr) *count = static_cast<size_t>(data.size());
  return data.data();
}

// What the caller asked for, or one where there are no threads.
int Threads(int asked);

// INVALID_ARGUMENT when a pointer is NULL that must not be.
absl::Status NotNull(const void* pointer, const char* name);

}  // namespace rilievo::decoder_c
