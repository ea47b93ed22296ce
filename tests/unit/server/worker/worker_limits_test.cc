#include "server/worker/worker_limits.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "core/base/sanitized.h"

namespace rilievo {
namespace {

// The limits are for good, so each set lives in a process of its own.
#define EXPECT_IN_CHILD(condition) \
  EXPECT_EXIT(std::_Exit((condition) ? 42 : 1), testing::ExitedWithCode(42), "")

bool CanMap(size_t bytes) {
  void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (mapped == MAP_FAILED) return false;
  munmap(mapped, bytes);
  return true;
}

TEST(WorkerLimits, MemoryIsCountedFromWhatTheProgramHas) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer maps memory of its own";
  constexpr int64_t kMiB = 1 << 20;
  const WorkerLimits limits{.memory_bytes = 200 * kMiB, .processor_seconds = 0, .threads = 1};
  EXPECT_IN_CHILD(LimitThisProcess(limits).ok() && CanMap(200 * kMiB) && !CanMap(240 * kMiB));
  EXPECT_IN_CHILD(LimitThisProcess({}).ok() && CanMap(600 * kMiB));
}

TEST(WorkerLimits, NoFileIsWritten) {
  // A log that is a file gets nothing, and the process goes on.
  EXPECT_IN_CHILD([] {
    const int file = fileno(std::tmpfile());
    return LimitThisProcess({}).ok() && write(file, "x", 1) < 0 && errno == EFBIG &&
           lseek(file, 0, SEEK_END) == 0;
  }());
}

TEST(WorkerLimits, ProcessorTimeAndCoreFiles) {
  const auto limit = [](auto resource) {
    rlimit value{};
    getrlimit(resource, &value);
    return value.rlim_cur;
  };
  EXPECT_IN_CHILD(LimitThisProcess({.processor_seconds = 33}).ok() && limit(RLIMIT_CPU) == 33 &&
                  limit(RLIMIT_CORE) == 0);
}

}  // namespace
}  // namespace rilievo
