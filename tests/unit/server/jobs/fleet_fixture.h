// Several servers over one store in PostgreSQL, each with a gRPC server inside this process.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/postgres/postgres_store.h"
#include "tests/unit/server/jobs/jobs_fixture.h"
#include "tests/unit/server/postgres/test_postgres.h"

namespace rilievo {

class FleetTest : public testing::Test {
 protected:
  struct Member {
    FakeJobWork work;
    std::unique_ptr<ServiceCore> core;
    std::unique_ptr<JobsService> service;
    std::unique_ptr<grpc::Server> server;
    std::unique_ptr<v1::JobsService::Stub> stub;

    ~Member() {
      work.Release();
      core->draining = true;
      service->BeginDrain();
      core->live_calls.StopAll(StopReason::kShutdown);
      core->live_calls.WaitUntilEmpty(std::chrono::seconds(5));
      server->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
    }
  };

  void SetUp() override {
    RILIEVO_TEST_POSTGRES(server);
    database_ = server;
    url_ = server->NewDatabase();
  }

  // `wait`: its jobs last until they are released or stopped.
  std::unique_ptr<Member> Join(bool serve_only, bool wait = false) {
    auto member = std::make_unique<Member>();
    member->work.wait = wait;
    ServerOptions options;
    options.store = url_;
    options.serve_only = serve_only;
    options.max_concurrent_jobs = 1;
    options.max_waiting_jobs = 20;
    options.scratch = testing::TempDir();
    options.part_points = 2048;
    options.memory_budget = 90'000'000;
    member->core = std::make_unique<ServiceCore>(
        options,
        [this, work = &member->work](const JobRequest& job, ScanBytes points,
                                     const RunContext& context) {
          if (job.parts) return do_parts_(work, job, std::move(points), context);
          if (context.progress) context.progress({Stage::kDomainFit, 0.5});
          return work->Run(context);
        },
        JobLog(), std::make_unique<Doorkeeper>());
    auto service = JobsService::Open(
        member->core.get(), [](const ServerOptions& given, StoreSettings settings) {
          return OpenPostgresStore(given.store, given.blobs, std::move(settings));
        });
    EXPECT_TRUE(service.ok()) << service.status();
    member->service = *std::move(service);
    grpc::ServerBuilder builder;
    builder.RegisterService(member->service.get());
    member->server = builder.BuildAndStart();
    member->stub = v1::JobsService::NewStub(member->server->InProcessChannel({}));
    return member;
  }

  static grpc::Status Upload(Member* at, const std::string& bytes, v1::UploadScanResponse* scan) {
    grpc::ClientContext context;
    const auto stream = at->stub->UploadScan(&context, scan);
    v1::UploadScanRequest request;
    request.mutable_header()->set_upload_id("scan");
    request.mutable_header()->set_total_bytes(bytes.size());
    stream->Write(request);
    request.set_chunk(bytes);
    stream->Write(request);
    request.mutable_end()->set_total_bytes(bytes.size());
    request.mutable_end()->set_sha256(absl::HexStringToBytes(ContentNameOf(bytes)));
    stream->Write(request);
    stream->WritesDone();
    return stream->Finish();
  }

  // `bytes`: three floats for each point. More than 20 do not fit into memory.
  static grpc::Status Create(Member* at, const std::string& request_id, v1::Job* job,
                             const std::string& bytes = std::string(20 * 12, 'x')) {
    v1::UploadScanResponse scan;
    const grpc::Status sent = Upload(at, bytes, &scan);
    if (!sent.ok()) return sent;
    v1::CreateJobRequest request;
    request.set_request_id(request_id);
    request.set_scan_id(scan.scan_id());
    request.mutable_header()->set_point_count(bytes.size() / 12);
    if (bytes.size() > 20 * 12) SetHungry(request.mutable_header()->mutable_options());
    request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
    v1::CreateJobResponse response;
    grpc::ClientContext context;
    const grpc::Status created = at->stub->CreateJob(&context, request, &response);
    *job = response.job();
    return created;
  }

  // They take more memory than parts do, and little time.
  static void SetHungry(v1::ReconstructOptions* options) {
    options->mutable_control()->set_control_faces(500);
    options->mutable_fit()->set_sample_level(4);
    options->mutable_fit()->set_rounds(1);
    options->set_max_level(0);
  }

  static std::string Created(Member* at, const std::string& request_id,
                             const std::string& bytes = std::string(20 * 12, 'x')) {
    v1::Job job;
    const grpc::Status status = Create(at, request_id, &job, bytes);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return job.job_id();
  }

  static grpc::Status Watch(Member* at, const std::string& id, uint64_t after,
                            std::vector<v1::JobEvent>* events) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    v1::WatchJobRequest request;
    request.set_job_id(id);
    request.set_after_sequence(after);
    const auto stream = at->stub->WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (stream->Read(&response)) events->push_back(response.event());
    return stream->Finish();
  }

  static v1::Job Get(Member* at, const std::string& id) {
    v1::GetJobRequest request;
    request.set_job_id(id);
    v1::GetJobResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(at->stub->GetJob(&context, request, &response).ok());
    return response.job();
  }

  static v1::Job WaitForState(Member* at, const std::string& id, v1::JobState state) {
    for (int i = 0; i < 1000; ++i) {
      const v1::Job job = Get(at, id);
      if (job.state() == state) return job;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Get(at, id);
  }

  // Of a job that is made by parts; set before it is created.
  std::function<absl::StatusOr<JobResult>(FakeJobWork*, const JobRequest&, ScanBytes,
                                          const RunContext&)>
      do_parts_;
  TestPostgres* database_ = nullptr;
  std::string url_;
};

}  // namespace rilievo
