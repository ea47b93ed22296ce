#include "server/jobs/job_requests.h"

#include <random>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "server/conversion/parts_request.h"
#include "server/conversion/scan_size.h"
#include "server/jobs/job_run.h"
#include "server/jobs/request_checks.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

grpc::Status Refused(const CallError& error) { return GrpcStatus(error); }
grpc::Status Refused(const absl::Status& status) { return GrpcStatus(ErrorOfStore(status)); }

// 128 random bits: nobody guesses another's.
std::string NewJobId() {
  std::random_device random;
  std::string id;
  for (int i = 0; i < 4; ++i) absl::StrAppend(&id, absl::Hex(random(), absl::kZeroPad8));
  return id;
}

std::optional<CallError> CheckScanId(const std::string& scan_id) {
  if (IsContentName(scan_id)) return std::nullopt;
  return BadRequestError(
      {{"scan_id", "it is not a scan_id; give the 64 hexadecimal digits of UploadScan"}});
}

// Everything that is wrong with a request before the store is asked.
// `job`: as it will be worked on.
std::optional<CallError> CheckCreate(const JobsCore& core, const v1::CreateJobRequest& request,
                                     JobRequest* job) {
  if (core.service->draining) return ShutdownError();
  if (auto error = CheckId("request_id", request.request_id())) return error;
  if (auto error = CheckScanId(request.scan_id())) return error;
  auto parsed = ParseHeader(request.header(), core.service->options);
  if (auto* error = std::get_if<CallError>(&parsed)) return *std::move(error);
  *job = std::get<JobRequest>(std::move(parsed));
  return FitIntoMemory(core.service->options, job);
}

std::optional<CallError> CheckScan(const JobsCore& core, const Caller& caller,
                                   const v1::CreateJobRequest& request) {
  const auto size = core.store->BytesOfScan(caller.owner, request.scan_id());
  if (!size.ok()) return ErrorOfStore(size.status());
  const v1::ReconstructHeader& header = request.header();
  if (*size == ScanBytesOf(header)) return std::nullopt;
  return BadRequestError(
      {{"header.point_count",
        absl::StrCat("these points",
                     header.triangle_count() > 0 ? " and triangles"
                     : header.has_base_surface() ? " and the base surface"
                                                 : "",
                     " take ", ScanBytesOf(header), " bytes; the scan has another size")}});
}

std::optional<CallError> CheckRoom(const JobsCore& core, const Caller& caller) {
  int all, own;
  if (core.store->shared()) {
    const auto counts = core.store->CountUnfinished(caller.client);
    if (!counts.ok()) return ErrorOfStore(counts.status());
    all = static_cast<int>(counts->all);
    own = static_cast<int>(counts->of_client);
  } else {
    all = core.board.size();
    own = core.board.size(caller.client);
  }
  if (MayTakePlace(core.service->options.max_waiting_jobs, all, own)) return std::nullopt;
  return CallError(ErrorCause::kJobsLimit,
                   absl::StrCat("as many jobs as this server takes of one client, or of all, are "
                                "waiting (",
                                own, " are yours); try again later"))
      .Limit(core.service->options.max_waiting_jobs, own)
      .RetryAfter(core.service->pool.RetryDelay());
}

// The job of an earlier CreateJob, if this one asks for the same.
grpc::Status Known(const StoredJob& known, const v1::CreateJobRequest& request, v1::Job* job) {
  v1::ReconstructHeader header = request.header();
  std::string mesh;
  if (header.options().control().has_control_mesh()) {
    v1::ControlOptions* control = header.mutable_options()->mutable_control();
    mesh = ContentNameOf(control->control_mesh().SerializeAsString());
    control->clear_control_mesh();
  }
  if (known.job.scan_id() != request.scan_id() || known.mesh != mesh ||
      known.header.SerializeAsString() != header.SerializeAsString()) {
    return Refused(
        CallError(ErrorCause::kRequestIdUsed,
                  "request_id: it was used for another scan or other options; choose a new one"));
  }
  *job = known.job;
  return grpc::Status::OK;
}

}  // namespace

std::string UploadName(const Caller& caller, const std::string& upload_id) {
  if (caller.owner.empty()) return upload_id;
  return absl::StrCat(ContentNameOf(caller.owner).substr(0, 32), ".", upload_id);
}

grpc::Status GetUpload(JobsCore* core, const Caller& caller, const v1::GetUploadRequest& request,
                       v1::GetUploadResponse* response) {
  if (auto error = CheckId("upload_id", request.upload_id())) return Refused(*error);
  const auto stored = core->store->uploads().StoredBytes(UploadName(caller, request.upload_id()));
  if (!stored.ok()) return Refused(stored.status());
  response->set_stored_bytes(static_cast<uint64_t>(*stored));
  return grpc::Status::OK;
}

grpc::Status CreateJob(JobsCore* core, const Caller& caller, const v1::CreateJobRequest& request,
                       v1::CreateJobResponse* response) {
  JobRequest work;
  if (const auto error = CheckCreate(*core, request, &work)) return Refused(*error);
  const auto known = core->store->Find(caller.owner, request.request_id());
  if (!known.ok()) return Refused(known.status());
  if (*known) return Known(**known, request, response->mutable_job());
  if (const auto error = CheckScan(*core, caller, request)) return Refused(*error);
  if (const auto error = CheckRoom(*core, caller)) return Refused(*error);
  if (!core->service->options.serve_only) {
    if (const auto error = CheckScratch(work)) return Refused(*error);
  }

  StoredJob stored{.owner = caller.owner, .client = caller.client, .header = request.header()};
  stored.job.set_job_id(NewJobId());
  stored.job.set_request_id(request.request_id());
  stored.job.set_scan_id(request.scan_id());
  stored.job.set_state(v1::JOB_STATE_QUEUED);
  stored.job.set_sequence(SequenceOfState(v1::JOB_STATE_QUEUED, 0));
  stored.job.set_trace_id(caller.trace_id);
  if (work.parts) stored.job.set_part_points(static_cast<uint64_t>(work.parts->points));
  SetTime(stored.job.mutable_create_time());
  if (core->store->shared()) {
    stored.memory = core->board.MemoryOf(stored);
    if (work.parts) stored.parts_bytes = EstimateKeptParts(work);
  }
  auto kept = core->store->Insert(stored);
  if (!kept.ok()) return Refused(kept.status());
  // Another call with the same request_id may have come first.
  if (kept->job.job_id() != stored.job.job_id()) {
    return Known(*kept, request, response->mutable_job());
  }
  *response->mutable_job() = stored.job;
  core->Begin(*std::move(kept));
  return grpc::Status::OK;
}

grpc::Status GetJob(JobsCore* core, const Caller& caller, const v1::GetJobRequest& request,
                    v1::GetJobResponse* response) {
  auto stored = core->store->Get(caller.owner, request.job_id());
  if (!stored.ok()) return Refused(stored.status());
  *response->mutable_job() = std::move(stored->job);
  return grpc::Status::OK;
}

grpc::Status ListJobs(JobsCore* core, const Caller& caller, const v1::ListJobsRequest& request,
                      v1::ListJobsResponse* response) {
  int limit = 0;
  int64_t before = 0;
  if (const auto error = ReadPage(request, &limit, &before)) return Refused(*error);
  auto jobs = core->store->List(caller.owner, limit, &before);
  if (!jobs.ok()) return Refused(jobs.status());
  for (v1::Job& job : *jobs) *response->add_jobs() = std::move(job);
  response->set_next_page_token(PageToken(before));
  return grpc::Status::OK;
}

grpc::Status CancelJob(JobsCore* core, const Caller& caller, const v1::CancelJobRequest& request,
                       v1::CancelJobResponse* response) {
  auto job = core->board.Cancel(caller.owner, request.job_id());
  if (!job.ok()) return Refused(job.status());
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status DeleteJob(JobsCore* core, const Caller& caller, const v1::DeleteJobRequest& request,
                       v1::DeleteJobResponse* /*response*/) {
  const auto job = core->board.Cancel(caller.owner, request.job_id());
  if (!job.ok() && !absl::IsDataLoss(job.status())) return Refused(job.status());
  const absl::Status removed = core->store->Remove(caller.owner, request.job_id());
  return removed.ok() ? grpc::Status::OK : Refused(removed);
}

grpc::Status DeleteScan(JobsCore* core, const Caller& caller, const v1::DeleteScanRequest& request,
                        v1::DeleteScanResponse* /*response*/) {
  if (auto error = CheckScanId(request.scan_id())) return Refused(*error);
  const absl::Status removed = core->store->RemoveScan(caller.owner, request.scan_id());
  return removed.ok() ? grpc::Status::OK : Refused(removed);
}

}  // namespace rilievo
