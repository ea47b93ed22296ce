// What gRPC itself says of its connections.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

namespace rilievo {

// Of one connection, since it began.
struct TransportStreams {
  int64_t started = 0, ended = 0;  // calls, cancelled ones too
  int64_t messages = 0;            // whole ones that came in

  int64_t open() const { return started - ended; }
};

// Channelz of one server, through gRPC's own functions and no port. For one thread.
class TransportView {
 public:
  // Of the server that this process has built last.
  TransportView();

  // `peer`: of PeerKey(). Nothing when gRPC has no such connection (yet, or any more).
  std::optional<TransportStreams> Of(const std::string& peer);

  // Looks for connections that are new; forgets those that are not among `open`.
  void Refresh(const std::set<std::string>& open);

 private:
  intptr_t server_ = 0, last_socket_ = 0;
  std::map<std::string, intptr_t> sockets_;  // by peer
  std::map<intptr_t, std::string> peers_;    // the other way round
};

}  // namespace rilievo
