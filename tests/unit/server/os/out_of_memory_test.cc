#include "server/os/out_of_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <new>
#include <thread>

#include "core/base/sanitized.h"

namespace rilievo {
namespace {

constexpr size_t kBlock = size_t{256} << 20, kRest = size_t{64} << 20;

// From here on this process has kRest bytes more than it has mapped now.
void LimitMemory() {
  size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlimit limit{pages * static_cast<size_t>(sysconf(_SC_PAGESIZE)) + kRest, RLIM_INFINITY};
  setrlimit(RLIMIT_AS, &limit);
}

void Allocate() {
  void* block = ::operator new(kBlock);
  static_cast<volatile char*>(block)[0] = 1;
  ::operator delete(block);
}

class OutOfMemory : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "a sanitizer maps memory of its own";
  }
};

TEST_F(OutOfMemory, EndsWithALineThatSaysSo) {
  EXPECT_EXIT(
      {
        EndWithoutMemory();
        LimitMemory();
        try {
          Allocate();
        } catch (const std::bad_alloc&) {  // as gRPC catches what its callbacks throw
        }
        std::_Exit(2);
      },
      testing::ExitedWithCode(1), "no memory is left");
}

TEST_F(OutOfMemory, AShortageThatPassesIsWaitedFor) {
  EXPECT_EXIT(
      {
        EndWithoutMemory();
        void* in_the_way =
            mmap(nullptr, kBlock, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        std::thread other([&] {
          std::this_thread::sleep_for(kMemoryPatience / 4);
          munmap(in_the_way, kBlock);
        });
        LimitMemory();
        Allocate();
        other.join();
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "");
}

TEST_F(OutOfMemory, AnAbortIsExplained) {
  EXPECT_EXIT(
      {
        EndWithoutMemory();
        std::abort();
      },
      testing::KilledBySignal(SIGABRT), "aborted by a library");
}

}  // namespace
}  // namespace rilievo
