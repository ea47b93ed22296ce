// The service inside this process: no port, no second program.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "server/conversion/server_options.h"
#include "server/worker/job_work.h"

namespace grpc {
class ChannelInterface;
}

namespace rilievo {

class ReconstructionServer;

// The same service as rilievod's, reached by gRPC's in-process channel.
class EmbeddedServer {
 public:
  // `options`: what concerns the network is not used.
  static absl::StatusOr<std::unique_ptr<EmbeddedServer>> Start(const ServerOptions& options);
  static absl::StatusOr<std::unique_ptr<EmbeddedServer>> Start(const ServerOptions& options,
                                                               ReconstructFunction reconstruct);

  // Cancels what is running and waits for its end.
  ~EmbeddedServer();

  // Valid until this object is gone.
  std::shared_ptr<grpc::ChannelInterface> channel() const;

 private:
  explicit EmbeddedServer(std::unique_ptr<ReconstructionServer> server);

  std::unique_ptr<ReconstructionServer> server_;
};

}  // namespace rilievo
