// gRPC's life in a process, for servers and clients alike.
#pragma once

#include "grpc/grpc.h"

namespace rilievo {

// gRPC shuts itself down with its last user, and then waits up to 10 s for a poller of a connection
// that ended with unsent bytes (seen once in thirty refused uploads). One use is never given back.
inline void KeepGrpcRunning() {
  static const bool once = [] {
    grpc_init();
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace rilievo
