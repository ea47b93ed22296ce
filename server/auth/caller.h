// Who calls.
#pragma once

#include <netinet/in.h>

#include <string>

namespace rilievo {

struct Caller {
  // As proven by a token or a certificate; empty when nothing was asked for. Jobs belong to it.
  std::string owner;
  // Takes turns with others: the owner, else MachineOfPeer().
  std::string client;
  // Of the trace that the call is part of; may be empty.
  std::string trace_id, parent_id;
};

// Whom an address counts for: the 4 bytes of an IPv4 address that is mapped into IPv6, else the
// first 8, which are the least that anybody is given.
std::string HouseholdOf(const in6_addr& address);

// Of gRPC's word for a peer: "ipv4:10.0.0.1" of "ipv4:10.0.0.1:4711", "ipv6:[2001:db8::]/64" of
// "ipv6:%5B2001:db8::1%5D:4711"; what is neither stays as it is.
std::string MachineOfPeer(const std::string& peer);

}  // namespace rilievo
