// The word that says why a call ended with an error.
#pragma once

#include <string>

#include "grpcpp/support/status.h"

namespace rilievo {

// ErrorInfo.reason of the details of `status`; empty when it has none.
std::string ErrorReasonOf(const grpc::Status& status);

}  // namespace rilievo
