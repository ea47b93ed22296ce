#include "server/observability/port/channelz_port.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "grpcpp/ext/channelz_service_plugin.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "proto/local_address.h"

namespace rilievo {

absl::StatusOr<std::unique_ptr<grpc::Server>> OpenChannelzPort(const std::string& address,
                                                               std::string* bound) {
  if (!IsLocalAddress(address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--channelz ", address,
                     " would tell other machines who is connected; give 127.0.0.1:PORT"));
  }
  grpc::channelz::experimental::InitChannelzService();
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
  auto server = builder.BuildAndStart();
  if (!server || port == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve channelz on \"", address, "\"; is the port free?"));
  }
  *bound = absl::StartsWith(address, "unix")
               ? address
               : absl::StrCat(address.substr(0, address.rfind(':')), ":", port);
  return server;
}

}  // namespace rilievo
