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

// Sets `job->parts` where the job alone needs more memory than it may take, and the server has a
// scratch folder. RESOURCE_EXHAUSTED, MEMORY_LIMIT, where that is not possible either.
std::optional<CallError> FitIntoMemory(const ServerOptions& options, JobRequest* job);

// RESOURCE_EXHAUSTED, STORE_FULL, when the scratch folder has no room for the parts of a job and
// the scan as it comes. Waits
// for the disk.
std::optional<CallError> CheckScratch(const JobRequest& job);

// What of the request a stage that failed with `status` was about, as a path within it.
std::string FieldAtFault(Stage stage, const JobRequest& job, const absl::Status& status);

}  // namespace rilievo
