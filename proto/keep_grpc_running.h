// gRPC's life in a process, for servers and clients alike.
#pragma once

namespace rilievo {

// gRPC shuts itself down with its last user, and then waits up to 10 s for a poller of a connection
// that ended with unsent bytes (seen once in thirty refused uploads). One use is never given back.
void KeepGrpcRunning();

// Before a process makes connections. gRPC 1.51 reads errno some calls after connect() (mended in
// its pull request 35064). A mutex of abseil that is waited for there for the first time looks for
// the processor's clock rate in a file that few machines have, and the connection fails with its
// ENOENT. Here it looks beforehand, and remembers; 5 ms, more under load.
void PrepareToConnect();

}  // namespace rilievo
