// The calls that are going on: their clock, and the way to end them all.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/rpc/heartbeat.h"

namespace rilievo {

// Why a call ends before its time.
enum class StopReason {
  kNone,
  kClient,      // cancelled, deadline over, or gone
  kJobTime,     // worked longer than the server allows
  kIdle,        // the client neither sent nor read for too long
  kUploadTime,  // the points took too long to arrive
  kShutdown,    // the server ends
};

// What an upload sends at least, in the mean since its begin: an old modem sends more, and a place
// held by less is a place lost to others.
inline constexpr double kSteadyBytesPerSecond = 4096;
// A call that waits with its points in memory is given so long to get going.
inline constexpr std::chrono::seconds kUploadGrace{10};

class LiveCall {
 public:
  using Clock = std::chrono::steady_clock;
  virtual ~LiveCall() = default;

  // Called several times a second; stops the call when a limit of time is over.
  virtual void Tick(Clock::time_point now) = 0;

  // Ends the call soon. Any thread, any number of times; the first reason counts.
  virtual void Stop(StopReason reason) = 0;
};

// Thread-safe. One thread of its own, which only calls Tick().
class LiveCalls {
 public:
  LiveCalls();
  ~LiveCalls();  // every call has left

  LiveCalls(const LiveCalls&) = delete;
  LiveCalls& operator=(const LiveCalls&) = delete;

  // `client`: whose it is, see size(); a kept job is nobody's.
  void Enter(const std::shared_ptr<LiveCall>& call, const std::string& client = "");
  // The last thing a call does.
  void Leave(const LiveCall* call);

  void StopAll(StopReason reason);

  // Whether all calls left in time.
  bool WaitUntilEmpty(std::chrono::milliseconds timeout);

  int size() const;

  // Of one client.
  int size(const std::string& client) const;

  // Of the thread that ticks.
  const Heartbeat& heart() const { return heart_; }

 private:
  struct Entry {
    std::weak_ptr<LiveCall> call;
    std::string client;
  };

  std::vector<std::shared_ptr<LiveCall>> Snapshot() const;
  void TickUntil(const std::stop_token& stop);

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::unordered_map<const LiveCall*, Entry> calls_;
  std::unordered_map<std::string, int> of_client_;
  Heartbeat heart_;
  std::jthread ticker_;
};

}  // namespace rilievo
