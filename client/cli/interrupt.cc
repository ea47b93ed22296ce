#include "client/cli/interrupt.h"

#include <pthread.h>
#include <unistd.h>

#include <ctime>

#include "client/cli/exit_code.h"

namespace rilievo {

Interrupt::Interrupt() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, &mask_before_);
  watcher_ = std::jthread([this](std::stop_token end) {
    const timespec wait{0, 100'000'000};
    while (!end.stop_requested()) {
      if (sigtimedwait(&signals_, nullptr, &wait) < 0) continue;
      if (!stop_.request_stop()) _exit(static_cast<int>(ExitCode::kCancelled));
    }
  });
}

Interrupt::~Interrupt() {
  watcher_.request_stop();
  watcher_.join();
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

}  // namespace rilievo
