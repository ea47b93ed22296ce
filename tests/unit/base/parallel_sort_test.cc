#include "core/base/parallel_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <stop_token>
#include <vector>

namespace rilievo {
namespace {

TEST(ParallelSortTest, SortsAsOneThreadDoes) {
  std::mt19937 random(5);
  for (const int count : {0, 1, 1000, 1 << 17, (1 << 17) + 1, 500000}) {
    std::vector<uint32_t> values(static_cast<size_t>(count));
    for (uint32_t& value : values) value = random() % 100000;
    std::vector<uint32_t> expected = values;
    std::sort(expected.begin(), expected.end(), std::greater<>());
    for (const int threads : {1, 3}) {
      RunContext context;
      context.threads = threads;
      std::vector<uint32_t> sorted = values;
      ASSERT_TRUE(ParallelSort(std::greater<>(), context, &sorted).ok());
      EXPECT_EQ(sorted, expected);
    }
  }
}

TEST(ParallelSortTest, Stops) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  std::vector<int> values{3, 1, 2};
  EXPECT_EQ(ParallelSort(std::less<>(), context, &values).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
