// Exceptions of libraries end here.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace rilievo {

// What `work` makes. RESOURCE_EXHAUSTED where the memory did not suffice, INTERNAL for any other
// exception.
template <typename Work>
auto Safely(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the memory does not suffice for this scan");
  } catch (const std::exception& defect) {
    return absl::InternalError(absl::StrCat("a library threw: ", defect.what()));
  }
}

}  // namespace rilievo
