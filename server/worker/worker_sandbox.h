// What a worker gives up before it looks at the first byte of a job: everything but computing, and
// talking to its server.
#pragma once

#include "absl/status/status.h"

namespace rilievo {

// For all threads of this process and those to come, for good: no file is opened, listed or
// removed, no socket, process or program made, no other process read or signalled, no memory made
// executable. What would do so fails with EPERM. A seccomp filter sees to that, and beneath it, for
// the calling thread and those it makes, Landlock without a rule where the kernel has it.
// UNAVAILABLE when the kernel takes no filter. Without effect under a sanitizer, which needs more
// than a job.
//
// Of its open files it may write at any place, and cut, `written_count` alone, whose numbers begin
// at `first_written`.
absl::Status EnterSandbox(int first_written = 0, int written_count = 0);

}  // namespace rilievo
