#include "client/cli/interrupt.h"

#include <pthread.h>
#include <unistd.h>

#include "client/cli/exit_code.h"

namespace rilievo {

Interrupt::Interrupt() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, &mask_before_);
  watcher_ = std::jthread([this](std::stop_token end) {
    for (int signal = 0; !end.stop_requested();) {
      if (sigwait(&signals_, &signal) != 0 || end.stop_requested()) continue;
      if (!stop_.request_stop()) _exit(static_cast<int>(ExitCode::kCancelled));
    }
  });
}

Interrupt::~Interrupt() {
  watcher_.request_stop();
  pthread_kill(watcher_.native_handle(), SIGTERM);  // no other thread sees it
  watcher_.join();
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

}  // namespace rilievo
