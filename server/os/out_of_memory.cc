#include "server/os/out_of_memory.h"

#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <new>
#include <string_view>
#include <thread>

#include "core/base/freed_memory.h"

namespace rilievo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPause{10};
// An allocation asks again at once after its pause; a busy processor makes that later.
constexpr std::chrono::milliseconds kAtOnce{50};

constexpr std::string_view kNoMemory =
    "rilievod: no memory is left, so the server ends; started again it goes on with all that it "
    "acknowledged\n";
constexpr std::string_view kAborted =
    "rilievod: aborted by a library, most often for want of memory; started again the server goes "
    "on with all that it acknowledged\n";

// No memory is taken for it, and a signal may come here.
void Say(std::string_view line) {
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), line.size());
}

// `operator new` calls this until there is memory.
void FindMemory() {
  thread_local Clock::time_point first, last;
  const auto now = Clock::now();
  if (now - last > kAtOnce) first = now;  // another allocation than the last time
  if (now - first >= kMemoryPatience) {
    Say(kNoMemory);
    std::_Exit(EXIT_FAILURE);
  }
  ReleaseToOs();
  std::this_thread::sleep_for(kPause);
  last = Clock::now();
}

// abort() goes on to end the process.
void OnAbort(int /*signal*/) { Say(kAborted); }

}  // namespace

void EndWithoutMemory() {
  std::set_new_handler(FindMemory);
  struct sigaction action {};
  action.sa_handler = OnAbort;
  sigaction(SIGABRT, &action, nullptr);
}

}  // namespace rilievo
