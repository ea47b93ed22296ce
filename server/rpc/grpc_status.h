// Errors as they travel: google.rpc.Status in "grpc-status-details-bin".
#pragma once

#include <memory>

#include "grpcpp/server_context.h"
#include "grpcpp/support/server_interceptor.h"
#include "grpcpp/support/status.h"
#include "server/conversion/call_error.h"

namespace rilievo {

// Trailers travel in one HTTP/2 header block, 8 KiB by default: long lists and texts are cut.
grpc::Status GrpcStatus(const CallError& error);

// Ends a call whose write waits for a client that does not read; gRPC gives the write back. Past
// the bytes that lie unread only code and message travel, no details.
void BreakOff(grpc::CallbackServerContext* context, const CallError& error);

// INVALID_ARGUMENT: not the protobuf that was due.
CallError MalformedMessageError();

// What gRPC answers by itself, where that says nothing: it ends a call with UNIMPLEMENTED and no
// word both when it does not know the method and when the message is not a protobuf.
grpc::Status ExplainedStatus(const std::string& method, const grpc::Status& status);

// Sends ExplainedStatus() in place of each status.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> StatusExplainer();

}  // namespace rilievo
