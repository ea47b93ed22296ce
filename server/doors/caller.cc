#include "server/doors/caller.h"

#include "absl/strings/match.h"

namespace rilievo {

std::string MachineOfPeer(const std::string& peer) {
  if (!absl::StartsWith(peer, "ipv4:") && !absl::StartsWith(peer, "ipv6:")) return peer;
  const size_t colon = peer.rfind(':');
  return colon > 4 ? peer.substr(0, colon) : peer;
}

}  // namespace rilievo
