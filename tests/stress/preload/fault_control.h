// How a test tells a server which of its system calls is to fail.
#pragma once

#include <atomic>
#include <cstdint>

namespace rilievo::stress {

enum class FaultKind : int { kWrite, kSync, kRename, kAllocate };
inline constexpr int kFaultKinds = 4;

// In a file that both processes map. Counting begins when the server starts, and only its own
// regular files count: what goes to sockets and pipes is the business of other parts.
struct FaultControl {
  std::atomic<int64_t> calls[kFaultKinds];  // made so far
  // The `countdown`-th call of `kind` from now on, counted from 1, fails with errno `error`; 0:
  // none.
  std::atomic<int64_t> countdown[kFaultKinds];
  std::atomic<bool> lasting;  // and so do all after it
  std::atomic<int> error;
  std::atomic<int64_t> failed;  // calls that were made to fail
  // File name of the library that asked for the last failed allocation; read once all is quiet.
  char library[64];
};

// The server finds the file by this variable.
inline constexpr char kFaultVariable[] = "RILIEVO_TEST_FAULTS";

}  // namespace rilievo::stress
