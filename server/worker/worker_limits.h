// What a worker process denies itself before it touches a scan.
#pragma once

#include <cstdint>

#include "absl/status/status.h"

namespace rilievo {

struct WorkerLimits {
  int64_t memory_bytes = 0;       // writable, beyond what the program has now; 0: no limit
  int64_t processor_seconds = 0;  // of all threads together; 0: no limit
  int threads = 1;                // whose stacks come on top of memory_bytes
  int64_t file_bytes = 0;         // that each file it has may grow to; 0: no file is written
};

// For this process, for good: no core files, no files written beyond `file_bytes`, few opened, and
// the limits. A standard error that is a file becomes /dev/null. It asks the kernel to end this
// process first when memory runs out everywhere. Built with a sanitizer it sets no limit of memory
// (core/base/sanitized.h).
absl::Status LimitThisProcess(const WorkerLimits& limits);

}  // namespace rilievo
