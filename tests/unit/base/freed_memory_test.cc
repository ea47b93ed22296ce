#include "core/base/freed_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <vector>

#include "core/base/sanitized.h"

namespace rilievo {
namespace {

// Bytes of this process that are in memory.
int64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

// A small block at the end keeps all that was freed below it.
TEST(FreedMemoryTest, GoesBackAlsoFromBelowWhatIsStillUsed) {
#ifndef __GLIBC__
  GTEST_SKIP() << "for glibc alone";
#endif
  if (kSanitized) GTEST_SKIP() << "a sanitizer has an allocator of its own";
  constexpr int kBlocks = 1024, kBytes = 1 << 16;
  std::vector<std::unique_ptr<std::vector<char>>> blocks;
  for (int i = 0; i < kBlocks; ++i) {
    blocks.push_back(std::make_unique<std::vector<char>>(kBytes, static_cast<char>(i)));
  }
  const std::vector<char> last(kBytes, 1);
  blocks.clear();
  const int64_t before = ResidentBytes();
  ReleaseToOs();
  EXPECT_LT(ResidentBytes(), before - kBlocks / 2 * int64_t{kBytes});
  EXPECT_EQ(last[0], 1);
}

}  // namespace
}  // namespace rilievo
