#include "server/os/process_usage.h"

#include <unistd.h>

#include <ctime>
#include <fstream>

namespace rilievo {
namespace {

std::chrono::nanoseconds TimeOf(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

int64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  int64_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

std::chrono::nanoseconds ProcessorTime() { return TimeOf(CLOCK_PROCESS_CPUTIME_ID); }

std::chrono::nanoseconds ProcessorTimeOfThread() { return TimeOf(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace rilievo
