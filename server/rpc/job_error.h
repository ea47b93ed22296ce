// What a client is told when its job ends early.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "server/conversion/call_error.h"
#include "server/conversion/job_request.h"
#include "server/conversion/server_options.h"
#include "server/rpc/live_calls.h"

namespace rilievo {

// UNAVAILABLE, SHUTTING_DOWN.
CallError ShutdownError();

// Of a call that was stopped; CANCELLED when the client did it.
CallError StopError(StopReason reason, const ServerOptions& options);

// RESOURCE_EXHAUSTED, MEMORY_LIMIT, when the job alone needs more memory than the server has.
std::optional<CallError> CheckMemory(const JobRequest& job, const ServerOptions& options);

// What of the request a stage that failed with `status` was about, as a path within it.
std::string FieldAtFault(Stage stage, const JobRequest& job, const absl::Status& status);

}  // namespace rilievo
