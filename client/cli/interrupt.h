// Ctrl-C and SIGTERM as a stop token.
#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace rilievo {

// While it lives, SIGINT and SIGTERM request a stop instead of ending the process; a second one
// ends it at once with exit code 5. Make it before any other thread, so that all inherit its mask.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  std::stop_token token() const { return stop_.get_token(); }

 private:
  sigset_t signals_, mask_before_;
  std::stop_source stop_;
  std::jthread watcher_;
};

}  // namespace rilievo
