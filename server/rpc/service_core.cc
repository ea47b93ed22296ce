#include "server/rpc/service_core.h"

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/rpc/client_places.h"

namespace rilievo {

ServiceCore::ServiceCore(const ServerOptions& server_options, JobWork job_work, JobLog job_log,
                         std::unique_ptr<const Doorkeeper> doorkeeper)
    : options(server_options),
      work([this, given = std::move(job_work)](const JobRequest& job, ScanBytes points,
                                               const RunContext& context) {
        absl::StatusOr<JobResult> result = given(job, std::move(points), context);
        if (const auto pause = machine.Judge(result.status())) pool.Hold(*pause);
        return result;
      }),
      log(std::move(job_log)),
      door(std::move(doorkeeper)),
      pool(server_options.max_concurrent_jobs, server_options.max_queued_jobs,
           server_options.MemoryBudget()) {}

std::optional<CallError> ServiceCore::AdmitStream(const grpc::CallbackServerContext& context,
                                                  Caller* caller) const {
  if (auto error = door->Admit(context, caller)) return error;
  const int own = live_calls.size(caller->client);
  if (MayTakePlace(options.max_calls, live_calls.size(), own)) return std::nullopt;
  return CallError(ErrorCause::kCallsLimit,
                   absl::StrCat("as many calls as this server takes of one client, or of all, are "
                                "under way (",
                                own, " are yours); try again later"))
      .Limit(options.max_calls, own)
      .RetryAfter(std::chrono::seconds(2));
}

void ServiceCore::Report(const JobRecord& record) const {
  record.id.empty() ? metrics->CountJob(record) : metrics->CountAttempt(record);
  if (log) log(record);
}

}  // namespace rilievo
