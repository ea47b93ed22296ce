// Takes connections and hands them on, and outlives a want of file handles.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// File handles that connections leave to the store and to the workers.
inline constexpr int kReservedHandles = 48;

// gRPC's own listener stops for ever at the first connection that finds no file handle. This one
// closes a connection that would leave fewer than kReservedHandles (a quarter, where the process
// may have few), and takes the next as soon as others have gone.
class ConnectionListener {
 public:
  // Given each connection, non-blocking, on a thread of the listener.
  using Take = std::function<void(FileDescriptor connection)>;

  // `address`: "HOST:PORT", "[IPV6]:PORT"; every address that HOST has, port 0: a free one.
  // INVALID_ARGUMENT when it is not one, UNAVAILABLE when it cannot be had.
  static absl::StatusOr<std::unique_ptr<ConnectionListener>> Open(const std::string& address);

  // Takes nothing any more once it returned.
  ~ConnectionListener();

  int port() const { return port_; }

  // Once. Until then connections wait. `no_handle`: told of each connection that was closed for
  // want of file handles.
  void Start(
      Take take, std::function<void()> no_handle = [] {});

 private:
  ConnectionListener() = default;

  absl::Status Bind(const std::string& host, const std::string& port);
  void Run(const std::stop_token& stop, const Take& take,
           const std::function<void()>& no_handle) const;

  std::vector<FileDescriptor> sockets_;
  FileDescriptor wake_;
  int port_ = 0;
  std::jthread thread_;
};

}  // namespace rilievo
