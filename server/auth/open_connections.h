// How many connections there are, and whose.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "server/os/file_descriptor.h"
#include "server/os/tcp_connection.h"

namespace rilievo {

// Thread-safe. Nobody says when a connection that was handed on is closed: a count that has reached
// its limit looks which of them still are, at most every kLookAgain, so that a flood costs little.
class OpenConnections {
 public:
  enum class Verdict {
    kTaken,
    kTooMany,           // as many as the server takes
    kTooManyOfAddress,  // as many as it takes of one address
  };

  static constexpr std::chrono::milliseconds kLookAgain{100};

  // One of those that are open.
  struct Sample {
    uint64_t number = 0;        // in the order in which they came
    std::string address, peer;  // AddressOfPeer(), PeerKeyOf()
    TcpTraffic traffic;
  };

  // Both >= 1.
  OpenConnections(int most, int most_of_address) : most_(most), most_of_address_(most_of_address) {}

  // Counts a connection that was just accepted, unless that would be too many.
  Verdict Take(const FileDescriptor& connection);

  // Of those taken, how many are open.
  int size();

  // All of them that are open.
  std::vector<Sample> Look();

  // Ends the one with this number, and counts it no longer. False when it was closed before.
  bool Abort(uint64_t number);

 private:
  struct Connection {
    ino_t socket;
    uint64_t number;
    std::string address, peer;
  };

  // With mutex_ held: forgets those that are closed.
  void ForgetClosed(std::chrono::steady_clock::time_point now);
  void Forget(std::map<int, Connection>::iterator connection);

  const int most_, most_of_address_;
  std::mutex mutex_;
  std::map<int, Connection> connections_;  // by file handle
  std::map<std::string, int> of_address_;
  uint64_t next_number_ = 1;
  std::chrono::steady_clock::time_point looked_{};
};

// Whom a connection counts for: the bytes of an IPv4 address, or HouseholdOf() an IPv6 one. Empty
// when `socket` has no peer.
std::string AddressOfPeer(const FileDescriptor& socket);

}  // namespace rilievo
