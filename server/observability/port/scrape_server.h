// A few requests in HTTP, and many connections that say nothing.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "server/os/connection_listener.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// One thread for all connections, so that a silent one keeps nobody waiting. A connection is closed
// after its answer, after kMostTime, or when it is the oldest of kMostConnections and another
// comes.
class ScrapeServer {
 public:
  static constexpr size_t kMostConnections = 64;
  static constexpr std::chrono::seconds kMostTime{5};

  // The whole answer to a request, of which `head` is the first line and the headers.
  using Answer = std::function<std::string(std::string_view head)>;

  // Errors as ConnectionListener::Open().
  static absl::StatusOr<std::unique_ptr<ScrapeServer>> Open(const std::string& address,
                                                            Answer answer);
  ~ScrapeServer();

  int port() const { return listener_->port(); }

 private:
  using Clock = std::chrono::steady_clock;

  struct Connection {
    FileDescriptor socket;
    Clock::time_point until;
    std::string head, answer;  // as far as it has come; what is left of it
    bool done = false;
  };

  ScrapeServer() = default;

  void Run(const std::stop_token& stop);
  void TakeNew();
  void Serve(Connection* connection) const;

  Answer answer_;
  FileDescriptor wake_;
  std::mutex mutex_;
  std::vector<FileDescriptor> new_;     // guarded by mutex_
  std::deque<Connection> connections_;  // of thread_, the oldest first
  std::unique_ptr<ConnectionListener> listener_;
  std::jthread thread_;
};

}  // namespace rilievo
