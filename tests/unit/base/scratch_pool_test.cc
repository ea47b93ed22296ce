#include "core/base/scratch_pool.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <vector>

#include "core/base/parallel_for.h"

namespace rilievo {
namespace {

TEST(ScratchPoolTest, LendsEachToOneAtATimeAndLendsItAgain) {
  const std::vector<int> prototype = {1, 2, 3};
  ScratchPool<std::vector<int>> pool(prototype);
  std::vector<int>* first = nullptr;
  {
    const auto a = pool.Take();
    const auto b = pool.Take();
    EXPECT_NE(a.get(), b.get());
    EXPECT_EQ(*a, prototype);
    first = a.get();
  }
  const auto c = pool.Take();
  const auto d = pool.Take();
  EXPECT_TRUE(c.get() == first || d.get() == first);
}

TEST(ScratchPoolTest, ManyBlocksNeedNoMoreThanTheThreads) {
  const int prototype = 0;
  ScratchPool<int> pool(prototype);
  std::mutex mutex;
  std::set<const int*> seen;
  RunContext context;
  context.threads = 2;
  ASSERT_TRUE(ParallelFor(1000, 1, context, [&](int64_t, int64_t) {
                const auto own = pool.Take();
                const std::lock_guard lock(mutex);
                seen.insert(own.get());
              }).ok());
  EXPECT_LE(seen.size(), 2U);
}

}  // namespace
}  // namespace rilievo
