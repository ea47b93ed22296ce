// Where all calls of a server pass on their way to its audit log.
#pragma once

#include <memory>

#include "grpcpp/support/server_interceptor.h"
#include "server/auth/doorkeeper.h"

namespace rilievo {

// Writes each call of this protocol's services, by the status that it is sent, to one AuditLog.
// `door`, which says who calls, outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallAuditor(
    const Doorkeeper* door);

}  // namespace rilievo
