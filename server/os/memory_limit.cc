#include "server/os/memory_limit.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>

namespace rilievo {
namespace {

constexpr int64_t kNoLimit = std::numeric_limits<int64_t>::max();

// A file that holds one number; "max", or no file, means that there is no limit.
int64_t NumberIn(const std::string& path) {
  std::ifstream file(path);
  int64_t bytes = 0;
  return file >> bytes && bytes > 0 ? bytes : kNoLimit;
}

int64_t MemoryOfMachine(const std::string& path) {
  std::ifstream file(path);
  std::string name;
  int64_t kilobytes = 0;
  // The first line: "MemTotal:  24600000 kB".
  return file >> name >> kilobytes && name == "MemTotal:" ? kilobytes * 1024 : kNoLimit;
}

}  // namespace

int64_t MemoryLimit(const std::string& root) {
  return std::min({MemoryOfMachine(root + "/proc/meminfo"),
                   NumberIn(root + "/sys/fs/cgroup/memory.max"),
                   NumberIn(root + "/sys/fs/cgroup/memory/memory.limit_in_bytes")});
}

int64_t MemoryForThisProcess() { return MemoryLimit(""); }

}  // namespace rilievo
