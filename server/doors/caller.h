// Who calls.
#pragma once

#include <string>

namespace rilievo {

struct Caller {
  // As proven by a token or a certificate; empty when nothing was asked for. Jobs belong to it.
  std::string owner;
  // Takes turns with others: the owner, else the machine that calls.
  std::string client;
  // Of the trace that the call is part of; may be empty.
  std::string trace_id, parent_id;
};

// "ipv4:10.0.0.1" of "ipv4:10.0.0.1:4711"; what has no port stays as it is.
std::string MachineOfPeer(const std::string& peer);

}  // namespace rilievo
