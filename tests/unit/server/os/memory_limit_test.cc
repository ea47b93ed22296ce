#include "server/os/memory_limit.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(MemoryLimit, TheSmallestCounts) {
  const TestFolder test;
  const auto write = [&](const std::string& path, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(test / path).parent_path());
    std::ofstream(test / path) << text;
  };
  write("proc/meminfo", "MemTotal:       1000000 kB\nMemFree: 5 kB\n");
  EXPECT_EQ(MemoryLimit(test.path()), 1'024'000'000);
  write("sys/fs/cgroup/memory.max", "max\n");
  EXPECT_EQ(MemoryLimit(test.path()), 1'024'000'000);
  write("sys/fs/cgroup/memory.max", "268435456\n");
  EXPECT_EQ(MemoryLimit(test.path()), 268'435'456);
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "1000000\n");
  EXPECT_EQ(MemoryLimit(test.path()), 1'000'000);
  EXPECT_GT(MemoryForThisProcess(), 1 << 20);
}

}  // namespace
}  // namespace rilievo
