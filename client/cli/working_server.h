// The server of a command: the one named, or one within this process.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "client/cli/server_connection.h"
#include "server/embedded_server.h"

namespace rilievo {

// The channel, and the server behind it when that is in this process.
struct WorkingServer {
  std::unique_ptr<EmbeddedServer> embedded;
  std::shared_ptr<grpc::ChannelInterface> channel;
};

// None of the limits that protect a server from strangers; one job at a time.
ServerOptions LimitsForOneself();

// Without a name, a server in this process without the limits that protect one from strangers.
absl::StatusOr<WorkingServer> ConnectOrStart(const ServerArguments& arguments);

}  // namespace rilievo
