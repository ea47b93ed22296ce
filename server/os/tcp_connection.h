// What the kernel knows of a TCP connection, and the end of one.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace rilievo {

// The other end: the bytes of its address, 4 where an IPv4 address is mapped into IPv6, then two of
// the port. No two open connections to one socket have the same.
std::string PeerKey(const std::string& address_bytes, int port);

// The peer of a connected socket; empty when the socket does not use IP.
std::string PeerKeyOf(int socket);

// The number that the system gives to a socket, and to no other while it is open; 0 when `file` is
// no socket.
ino_t InodeOf(int file);

// Of the stream, since the connection began.
struct TcpTraffic {
  int64_t read = 0;  // bytes that its owner has taken
  int64_t sent = 0;  // bytes
};

// Zeros when it is no TCP socket.
TcpTraffic TrafficOf(int socket);

// Ends the connection at once and drops what has arrived and was not read: the next read of its
// owner fails. Does nothing when `file` is no longer the socket with this inode.
bool AbortConnection(int file, ino_t inode);

}  // namespace rilievo
