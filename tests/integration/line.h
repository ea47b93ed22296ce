// A TCP line to a server that can be cut, or fall silent.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/os/file_descriptor.h"

namespace rilievo {

// Passes on the bytes of one connection, the first that comes.
class Line {
 public:
  explicit Line(int server_port);
  ~Line();  // cuts it

  // Where clients connect, "127.0.0.1:PORT".
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  // Closes both ends.
  void Cut();

  // Passes nothing on any more and closes nothing, as a machine that lost its power.
  void Freeze() { frozen_ = true; }

 private:
  void Run();
  void Pass(int from, int to) const;

  const int server_port_;
  int port_ = 0;
  std::atomic<bool> frozen_ = false, cut_ = false;
  FileDescriptor listener_;
  std::mutex mutex_;  // of the two ends
  FileDescriptor client_, server_;
  std::jthread thread_;
};

}  // namespace rilievo
