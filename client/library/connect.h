// Channels to a server, with what it asks for.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace grpc {
class ChannelInterface;
}

namespace rilievo {

struct ConnectOptions {
  std::string token = {};  // sent with every call; empty: none
  // PEM texts. With `ca` the channel is TLS, and the server's certificate must be of one of these
  // authorities and for the host of the address.
  std::string ca = {};
  std::string certificate = {}, key = {};  // the client's own, for mutual TLS; both or neither
  // Send the token unencrypted even to another machine.
  bool allow_plaintext = false;
};

// To "host:port". Connects when first used, again within seconds when the server was away. Proxies
// named by the environment are not used. INVALID_ARGUMENT when the options do not go together.
absl::StatusOr<std::shared_ptr<grpc::ChannelInterface>> Connect(const std::string& address,
                                                                const ConnectOptions& options);

// To each of several servers over one store, "host:port,host:port,...", in an order of chance, so
// that clients spread over them. INVALID_ARGUMENT also when one of the addresses is empty.
absl::StatusOr<std::vector<std::shared_ptr<grpc::ChannelInterface>>> ConnectToEach(
    const std::string& addresses, const ConnectOptions& options);

// The first of these that has a connection, each waited for up to two seconds; else the first of
// all.
std::shared_ptr<grpc::ChannelInterface> FirstReachable(
    const std::vector<std::shared_ptr<grpc::ChannelInterface>>& channels);

// Without any options.
std::shared_ptr<grpc::ChannelInterface> ConnectPlaintext(const std::string& address);

}  // namespace rilievo
