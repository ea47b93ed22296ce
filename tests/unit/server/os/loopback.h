// TCP over 127.0.0.1, by hand.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>

#include "server/os/file_descriptor.h"

namespace rilievo {

// Port 0: a free one, for bind().
inline sockaddr_in LoopbackAddress(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  return address;
}

// A connected socket; invalid when nobody listens.
inline FileDescriptor ConnectTo(int port) {
  FileDescriptor end(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_in address = LoopbackAddress(port);
  if (connect(end.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    end.Close();
  }
  return end;
}

}  // namespace rilievo
