#include "core/base/large_pages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace rilievo {
namespace {

TEST(HintLargePagesTest, LeavesTheContentsAlone) {
  for (size_t bytes : {size_t{0}, size_t{100}, size_t{3} << 20, size_t{20} << 20}) {
    std::vector<unsigned char> memory(bytes, 7);
    HintLargePages(memory.data(), memory.size());
    EXPECT_EQ(std::count(memory.begin(), memory.end(), 7), static_cast<std::ptrdiff_t>(bytes));
  }
}

}  // namespace
}  // namespace rilievo
