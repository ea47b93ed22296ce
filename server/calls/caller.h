// Who calls.
#pragma once

#include <string>

namespace grpc {
class CallbackServerContext;
}

namespace rilievo {

struct Caller {
  // As proven by the connection; empty when it proves nothing. Jobs belong to it.
  std::string owner;
  // Takes turns with others: the owner, else the machine that calls.
  std::string client;
};

Caller CallerOf(const grpc::CallbackServerContext& context);

// "ipv4:10.0.0.1" of "ipv4:10.0.0.1:4711"; what has no port stays as it is.
std::string MachineOfPeer(const std::string& peer);

}  // namespace rilievo
