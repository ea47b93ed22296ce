#include "server/calls/caller.h"

#include "absl/strings/match.h"
#include "grpcpp/server_context.h"

namespace rilievo {

std::string MachineOfPeer(const std::string& peer) {
  if (!absl::StartsWith(peer, "ipv4:") && !absl::StartsWith(peer, "ipv6:")) return peer;
  const size_t colon = peer.rfind(':');
  return colon > 4 ? peer.substr(0, colon) : peer;
}

Caller CallerOf(const grpc::CallbackServerContext& context) {
  Caller caller;
  const auto proof = context.auth_context();
  if (proof && proof->IsPeerAuthenticated()) {
    for (const grpc::string_ref& part : proof->GetPeerIdentity()) {
      caller.owner = std::string(part.data(), part.size());
      break;
    }
  }
  caller.client = caller.owner.empty() ? MachineOfPeer(context.peer()) : caller.owner;
  return caller;
}

}  // namespace rilievo
