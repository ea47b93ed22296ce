// The service with its gRPC server around it: on a port, or inside this process.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/auth/connection_watch.h"
#include "server/auth/open_connections.h"
#include "server/conversion/server_options.h"
#include "server/jobs/open_store.h"
#include "server/observability/job_log.h"
#include "server/os/connection_listener.h"
#include "server/rpc/vital_signs.h"
#include "server/server_health.h"
#include "server/worker/job_work.h"

namespace grpc {
class ChannelInterface;
class Server;
class ServerCredentials;
}  // namespace grpc

namespace rilievo {

class JobsService;
class ReconstructionService;
class ServerMetrics;
class TemporaryFolder;
struct ServerState;
struct ServiceCore;

class ReconstructionServer {
 public:
  // Listens on options.listen, with health and (options.reflection) reflection services.
  // INVALID_ARGUMENT for wrong options, UNAVAILABLE when the address or the store cannot be had.
  static absl::StatusOr<std::unique_ptr<ReconstructionServer>> Listen(
      const ServerOptions& options, JobWork work, JobLog log, const OpenStore& open = OpenFolder);

  // No port; reached by InProcessChannel() alone.
  static absl::StatusOr<std::unique_ptr<ReconstructionServer>> Embed(
      const ServerOptions& options, JobWork work, JobLog log, const OpenStore& open = OpenFolder);

  // Stops at once what still runs.
  ~ReconstructionServer();

  // "host:port", the port as bound; empty when embedded.
  const std::string& address() const { return address_; }

  std::shared_ptr<grpc::ChannelInterface> InProcessChannel() const;

  // Of this server; may outlive it.
  std::shared_ptr<ServerMetrics> metrics() const;

  // Health says NOT_SERVING and new jobs are refused; those under way go on.
  void BeginDrain();

  // Of a server that shares its store: for how long there was nothing to work on.
  std::chrono::steady_clock::duration IdleTime() const;

  // Whether no call is under way any more.
  bool WaitUntilIdle(std::chrono::milliseconds timeout);

  // Stops what still runs with UNAVAILABLE, and the server. Once.
  void Shutdown();

 private:
  ReconstructionServer();

  static absl::StatusOr<std::unique_ptr<ReconstructionServer>> Start(ServerOptions options,
                                                                     bool embedded, JobWork work,
                                                                     JobLog log,
                                                                     const OpenStore& open);

  // `connection` is accepted: counts it, or tells its client why it is closed.
  bool TakeConnection(const FileDescriptor& connection);
  ServerState State() const;
  void WatchConnections();
  void WatchThreads();

  std::unique_ptr<TemporaryFolder> temporary_;
  // Destroyed after the server, whose calls they serve; the core last.
  std::unique_ptr<ServiceCore> core_;
  std::unique_ptr<ReconstructionService> service_;
  std::unique_ptr<JobsService> jobs_;
  std::shared_ptr<grpc::ServerCredentials> credentials_;  // follow their files while they live
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<ServerHealth> health_;  // not of an embedded one
  std::unique_ptr<VitalSigns> vital_signs_;
  std::unique_ptr<OpenConnections> connections_;
  std::unique_ptr<ConnectionWatch> watch_;
  std::unique_ptr<ConnectionListener> listener_;
  std::string address_;
};

}  // namespace rilievo
