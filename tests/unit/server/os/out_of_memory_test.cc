#include "server/os/out_of_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
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

// Shortages of a quarter of the patience each. Its thread begins before the memory is limited: it
// needs a stack.
class Shortages {
 public:
  Shortages() {
    std::thread([this] {
      while (true) {
        std::this_thread::sleep_for(kMemoryPatience / 4);
        if (void* block = block_.exchange(nullptr)) munmap(block, kBlock);
      }
    }).detach();
  }

  void Begin() {
    block_ = mmap(nullptr, kBlock, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  }

 private:
  std::atomic<void*> block_ = nullptr;
};

TEST_F(OutOfMemory, AShortageThatPassesIsWaitedFor) {
  EXPECT_EXIT(
      {
        EndWithoutMemory();
        Shortages shortages;
        shortages.Begin();
        LimitMemory();
        Allocate();
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "");
}

// Together they last longer than the patience.
TEST_F(OutOfMemory, ShortagesOneAfterAnotherAreWaitedForEach) {
  EXPECT_EXIT(
      {
        EndWithoutMemory();
        Shortages shortages;
        shortages.Begin();
        LimitMemory();
        for (int round = 0; round < 10; ++round) {
          Allocate();
          std::this_thread::sleep_for(kMemoryPatience / 2);
          shortages.Begin();
        }
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
