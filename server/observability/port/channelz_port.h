// gRPC's own view of its connections and calls (channelz), on a port of its own.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace grpc {
class Server;
}

namespace rilievo {

// Serves grpc.channelz.v1.Channelz of this process in plaintext to anybody who reaches it:
// INVALID_ARGUMENT unless `address` is a loopback address or a socket. After all other servers of
// the process: those built later would serve it too. `*bound`: the address with its port.
absl::StatusOr<std::unique_ptr<grpc::Server>> OpenChannelzPort(const std::string& address,
                                                               std::string* bound);

}  // namespace rilievo
