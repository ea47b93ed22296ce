// A rilievod with a store, watched from outside: what it holds, who is connected to it.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "client/library/jobs_client.h"
#include "client/library/reconstruction_client.h"
#include "grpcpp/channel.h"
#include "grpcpp/support/channel_arguments.h"
#include "tests/integration/daemon/daemon_process.h"

namespace rilievo::stress {

// A connection of its own; gRPC would share one among all channels of a process.
std::shared_ptr<grpc::Channel> OwnConnection(const std::string& address,
                                             grpc::ChannelArguments arguments = {});

class StressServer {
 public:
  // The store is made in `folder`, or in a folder that goes with this object.
  explicit StressServer(std::string folder = {});
  ~StressServer();
  StressServer(const StressServer&) = delete;
  StressServer& operator=(const StressServer&) = delete;

  // The second time at the same port. Ends this program when the server does not start.
  void Start(std::vector<std::string> arguments = {},
             const std::vector<std::string>& environment = {});
  void Kill();

  const std::string& address() const { return address_; }
  int port() const;
  DaemonProcess& process() { return *process_; }
  const std::string& folder() const { return folder_; }

  // Patient: a server that is started again is waited for.
  JobsClient Jobs() const;
  JobsClient Jobs(const std::shared_ptr<grpc::ChannelInterface>& channel) const;
  // Gives up at once.
  JobsClient HastyJobs() const;

  int64_t ResidentBytes() const { return process_->ResidentBytes(); }
  // Since the last call of ForgetPeak().
  int64_t PeakBytes() const { return process_->PeakBytes(); }
  void ForgetPeak() const;
  int OpenFiles() const;
  // TCP connections that it holds open.
  int Connections() const;

  // SIGTERM; true when it ended by itself with exit code 0 within `time`.
  bool EndsWithin(std::chrono::milliseconds time);

 private:
  // What each file handle of the server stands for.
  std::vector<std::string> Files() const;

  std::string folder_;
  bool own_folder_ = false;
  std::string address_;
  std::unique_ptr<DaemonProcess> process_;
};

// Asks `condition` every few milliseconds; whether it came true in time.
template <typename Condition>
bool WaitFor(std::chrono::milliseconds time, const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

inline CallOptions Within(std::chrono::milliseconds time) { return {.timeout = time, .stop = {}}; }

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

inline double Megabytes(int64_t bytes) { return static_cast<double>(bytes) / 1e6; }

}  // namespace rilievo::stress
