#include "server/embedded_server.h"

#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/reconstruct.h"
#include "grpcpp/channel.h"
#include "server/reconstruction_server.h"

namespace rilievo {

absl::StatusOr<std::unique_ptr<EmbeddedServer>> EmbeddedServer::Start(
    const ServerOptions& options) {
  return Start(options, ReconstructAndDrop);
}

absl::StatusOr<std::unique_ptr<EmbeddedServer>> EmbeddedServer::Start(
    const ServerOptions& options, ReconstructFunction reconstruct) {
  RILIEVO_ASSIGN_OR_RETURN(
      auto server,
      ReconstructionServer::Embed(options, InThisProcess(std::move(reconstruct)), /*log=*/{}));
  return std::unique_ptr<EmbeddedServer>(new EmbeddedServer(std::move(server)));
}

EmbeddedServer::EmbeddedServer(std::unique_ptr<ReconstructionServer> server)
    : server_(std::move(server)) {}

EmbeddedServer::~EmbeddedServer() = default;

std::shared_ptr<grpc::ChannelInterface> EmbeddedServer::channel() const {
  return server_->InProcessChannel();
}

}  // namespace rilievo
