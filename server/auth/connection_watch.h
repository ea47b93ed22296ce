// Keeps hostile connections from taking the server's memory and processors.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/auth/connection_judge.h"
#include "server/auth/open_connections.h"
#include "server/auth/transport_view.h"

namespace rilievo {

// Debian's gRPC 1.51 enforces its limits of streams and headers only against a client that
// acknowledges them. So a thread of its own looks at the connections, by what the kernel and gRPC's
// channelz tell of them, and closes those that ConnectionJudge names. Afterwards it gives the
// memory that is free back to the system. It looks every kPeriod while other threads work, every
// kIdlePeriod else, and takes at most a tenth of a processor.
class ConnectionWatch {
 public:
  static constexpr std::chrono::milliseconds kPeriod{20}, kIdlePeriod{1000};

  struct Hooks {
    std::function<int64_t()> held_bytes;  // memory that the server knows to hold for clients
    std::function<void()> closed;         // told of each connection that was closed
  };

  // After the gRPC server was built. `connections` outlives this object.
  ConnectionWatch(OpenConnections* connections, const ConnectionJudge::Limits& limits, Hooks hooks);
  ~ConnectionWatch();

 private:
  using Clock = std::chrono::steady_clock;

  void WatchUntil(const std::stop_token& stop);
  // Whether other threads have worked since the last look, or that is long ago.
  bool IsDue(Clock::time_point now);
  void Look(Clock::time_point now);
  std::vector<ConnectionState> States(Clock::time_point now);
  // Whether the server uses the processors more than the bytes it received explain.
  bool Busy(Clock::time_point now);
  void GiveBackMemory(int64_t resident, Clock::time_point now);

  OpenConnections* const connections_;
  const Hooks hooks_;
  ConnectionJudge judge_;
  TransportView view_;
  // What channelz was asked last of a connection.
  struct Asked {
    int64_t read = 0, open = 0;
    int64_t seen = 0;  // bytes at the last look
    Clock::time_point when;
  };
  std::map<uint64_t, Asked> asked_;
  struct Usage {
    Clock::time_point when;
    std::chrono::nanoseconds processors;
    int64_t read;
  };
  std::deque<Usage> usage_;
  int64_t read_ = 0;  // of all connections
  Clock::time_point looked_{};
  std::chrono::nanoseconds others_time_{0};  // of the processors, at the last look
  Clock::time_point gave_back_{};
  const int64_t first_resident_;
  int64_t least_resident_;  // since memory was given back
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace rilievo
