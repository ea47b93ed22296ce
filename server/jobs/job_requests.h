// The unary RPCs of JobsService, as plain functions that wait for the disk.
#pragma once

#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/auth/caller.h"
#include "server/jobs/jobs_core.h"

namespace rilievo {

// Each has the contract that jobs.proto states.
grpc::Status GetUpload(JobsCore* core, const Caller& caller, const v1::GetUploadRequest& request,
                       v1::GetUploadResponse* response);
grpc::Status CreateJob(JobsCore* core, const Caller& caller, const v1::CreateJobRequest& request,
                       v1::CreateJobResponse* response);
grpc::Status GetJob(JobsCore* core, const Caller& caller, const v1::GetJobRequest& request,
                    v1::GetJobResponse* response);
grpc::Status ListJobs(JobsCore* core, const Caller& caller, const v1::ListJobsRequest& request,
                      v1::ListJobsResponse* response);
grpc::Status CancelJob(JobsCore* core, const Caller& caller, const v1::CancelJobRequest& request,
                       v1::CancelJobResponse* response);
grpc::Status DeleteJob(JobsCore* core, const Caller& caller, const v1::DeleteJobRequest& request,
                       v1::DeleteJobResponse* response);
grpc::Status DeleteScan(JobsCore* core, const Caller& caller, const v1::DeleteScanRequest& request,
                        v1::DeleteScanResponse* response);

// The name under which an upload of the caller is stored: no other caller's.
std::string UploadName(const Caller& caller, const std::string& upload_id);

}  // namespace rilievo
