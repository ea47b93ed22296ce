// Errors as they travel: google.rpc.Status in "grpc-status-details-bin".
#pragma once

#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "server/conversion/call_error.h"

namespace rilievo {

// The message and the details.
google::rpc::Status RpcStatus(const CallError& error);

// Trailers travel in one HTTP/2 header block, 8 KiB by default: long lists and texts are cut.
grpc::Status GrpcStatus(const CallError& error);

}  // namespace rilievo
