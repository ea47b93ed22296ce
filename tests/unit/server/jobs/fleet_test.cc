// Several servers over one store in PostgreSQL, each with a gRPC server inside this process.
#include <future>

#include "core/base/status_macros.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_store.h"
#include "tests/unit/server/jobs/jobs_fixture.h"
#include "tests/unit/server/postgres/test_postgres.h"

namespace rilievo {
namespace {

// Of a step of four parts, whose bytes are their numbers. Each is work of the test's; the surface
// is what came of all.
absl::StatusOr<JobResult> DoParts(SharedParts* shared, FakeJobWork* work,
                                  const RunContext& context) {
  constexpr PartStep kStep = PartStep::kHeights;
  constexpr int kParts = 4;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const SharedParts::Turn turn, shared->Next(kStep, kParts));
    if (!turn.part) break;
    RILIEVO_ASSIGN_OR_RETURN(JobResult result, work->Run(context));
    std::vector<uint8_t> bytes = {static_cast<uint8_t>('0' + *turn.part)};
    RILIEVO_RETURN_IF_ERROR(shared->Keep(
        kStep, *turn.part, [&, told = false]() mutable -> absl::StatusOr<std::span<const uint8_t>> {
          if (std::exchange(told, true)) bytes.clear();
          return bytes;
        }));
  }
  JobResult result;
  if (!shared->leads()) return result;
  std::vector<uint8_t>& surface = result.encoded.chunks.emplace_back();
  for (int part = 0; part < kParts; ++part) {
    RILIEVO_RETURN_IF_ERROR(shared->Fetch(kStep, part, [&](std::span<const uint8_t> piece) {
      surface.insert(surface.end(), piece.begin(), piece.end());
      return absl::OkStatus();
    }));
  }
  return result;
}

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
        [work = &member->work](const JobRequest& job, ScanBytes, const RunContext& context) {
          if (job.parts) return DoParts(job.parts->shared.get(), work, context);
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

  // `points`: many do not fit into memory.
  static grpc::Status Create(Member* at, const std::string& request_id, v1::Job* job,
                             size_t points = 20) {
    v1::UploadScanResponse scan;
    const grpc::Status sent = Upload(at, std::string(points * 12, 'x'), &scan);
    if (!sent.ok()) return sent;
    v1::CreateJobRequest request;
    request.set_request_id(request_id);
    request.set_scan_id(scan.scan_id());
    request.mutable_header()->set_point_count(points);
    request.mutable_header()->mutable_options()->mutable_fit()->set_sample_level(4);
    request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
    v1::CreateJobResponse response;
    grpc::ClientContext context;
    const grpc::Status created = at->stub->CreateJob(&context, request, &response);
    *job = response.job();
    return created;
  }

  static std::string Created(Member* at, const std::string& request_id, size_t points = 20) {
    v1::Job job;
    const grpc::Status status = Create(at, request_id, &job, points);
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

  static constexpr size_t kMany = 13'000;
  TestPostgres* database_ = nullptr;
  std::string url_;
};

TEST_F(FleetTest, AJobOfOneServerIsWorkedOnByAnotherAndReadAtAThird) {
  const auto front = Join(/*serve_only=*/true), reader = Join(/*serve_only=*/true);
  const std::string id = Created(front.get(), "r");
  EXPECT_EQ(Get(reader.get(), id).state(), v1::JOB_STATE_QUEUED) << "nobody works";
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_THAT(reader->core->metrics->Text(),
              ::testing::HasSubstr("rilievo_fleet_jobs{state=\"queued\"} 1\n"));
  const auto worker = Join(/*serve_only=*/false);
  const v1::Job done = WaitForState(reader.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u);
  v1::StreamSurfaceRequest request;
  request.set_job_id(id);
  grpc::ClientContext context;
  const auto stream = reader->stub->StreamSurface(&context, request);
  std::string surface;
  for (v1::StreamSurfaceResponse response; stream->Read(&response);) {
    surface += response.piece().data();
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(surface, "surface");
}

TEST_F(FleetTest, WhoWatchesElsewhereSeesTheSameNumbers) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  std::vector<v1::JobEvent> far, near;
  auto watched = std::async(std::launch::async, [&] { return Watch(front.get(), id, 0, &far); });
  auto beside = std::async(std::launch::async, [&] { return Watch(worker.get(), id, 0, &near); });
  std::this_thread::sleep_for(std::chrono::seconds(2));
  worker->work.Release();
  EXPECT_TRUE(watched.get().ok());
  EXPECT_TRUE(beside.get().ok());
  const auto progress = [](const std::vector<v1::JobEvent>& events) {
    for (const auto& event : events) {
      if (event.has_progress()) return event.sequence();
    }
    return uint64_t{0};
  };
  EXPECT_NE(progress(far), 0u) << "progress comes through the store";
  EXPECT_EQ(progress(far), progress(near));
  ASSERT_FALSE(far.empty());
  EXPECT_EQ(far.back().job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(far.back().sequence(), near.back().sequence());
  std::vector<v1::JobEvent> none;
  EXPECT_TRUE(Watch(front.get(), id, near.back().sequence(), &none).ok());
  EXPECT_TRUE(none.empty()) << "a watcher may go from server to server";
}

TEST_F(FleetTest, ACancelAtAnotherServerStopsTheWork) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  v1::CancelJobRequest request;
  request.set_job_id(id);
  v1::CancelJobResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(front->stub->CancelJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_CANCELLED);
  const std::string next = Created(front.get(), "next");
  EXPECT_TRUE(worker->work.WaitForBegun(2)) << "its place is free again";
  EXPECT_EQ(Get(worker.get(), id).state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(FleetTest, AServerThatEndsInOrderLeavesItsJobsToOthers) {
  const auto front = Join(/*serve_only=*/true);
  auto first = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(first->work.WaitForBegun(1));
  std::vector<v1::JobEvent> events;
  auto watched = std::async(std::launch::async, [&] { return Watch(front.get(), id, 0, &events); });
  const auto second = Join(/*serve_only=*/false);
  // Its worker is stopped, not released.
  first->core->draining = true;
  first->service->BeginDrain();
  first->core->live_calls.StopAll(StopReason::kShutdown);
  EXPECT_TRUE(watched.get().ok()) << "who watches at a third one sees all of it";
  EXPECT_EQ(events.back().job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(events.back().job().attempts(), 2u);
}

TEST_F(FleetTest, WhatOneMachineCannotWorkOnAnotherDoes) {
  auto broken = Join(/*serve_only=*/false);
  broken->work.answers.assign(50, absl::UnavailableError("no worker starts here"));
  const std::string id = Created(broken.get(), "r");
  ASSERT_TRUE(broken->work.WaitForBegun(1));
  const auto whole = Join(/*serve_only=*/false);
  const v1::Job done = WaitForState(broken.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u) << "what was not an attempt does not count";
}

TEST_F(FleetTest, ADatabaseThatIsAwayIsWaitedFor) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  database_->Kill();
  v1::Job job;
  const grpc::Status away = Create(front.get(), "s", &job);
  EXPECT_EQ(away.error_code(), grpc::StatusCode::UNAVAILABLE) << away.error_message();
  EXPECT_EQ(ReasonOf(away), "STORE_BUSY");
  worker->work.Release();  // the job is done while nobody can be told
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  database_->Start();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!Create(front.get(), "s", &job).ok() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const v1::Job done = WaitForState(front.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u) << "its worker went on meanwhile";
}

TEST_F(FleetTest, WhoHasNothingElseToDoHelpsWithALargeJob) {
  const auto leader = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(leader.get(), "large", kMany);
  ASSERT_TRUE(leader->work.WaitForBegun(1));
  const auto helper = Join(/*serve_only=*/false);
  PostgresDatabase database(url_);
  const char* const kDone = "SELECT COUNT(*) FROM job_parts WHERE result <> ''";
  for (int i = 0; i < 1000 && *database.Number(kDone) < 3; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(helper->work.WaitForBegun(3)) << "of four parts all but the leader's";
  leader->work.Release();
  const v1::Job done = WaitForState(helper.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.error().message();
  EXPECT_EQ(absl::BytesToHexString(done.surface().sha256()), ContentNameOf("0123"));
  EXPECT_EQ(done.attempts(), 1u);
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM job_parts"), 0);
  Created(leader.get(), "next");
  EXPECT_TRUE(leader->work.WaitForBegun(2) || helper->work.WaitForBegun(4)) << "both are free";
}

TEST_F(FleetTest, ACancelStopsThoseWhoHelp) {
  const auto leader = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(leader.get(), "large", kMany);
  ASSERT_TRUE(leader->work.WaitForBegun(1));
  const auto helper = Join(/*serve_only=*/false, /*wait=*/true);
  ASSERT_TRUE(helper->work.WaitForBegun(1));
  v1::CancelJobRequest request;
  request.set_job_id(id);
  v1::CancelJobResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(leader->stub->CancelJob(&context, request, &response).ok());
  for (const char* next : {"a", "b"}) Created(leader.get(), next);
  EXPECT_TRUE(leader->work.WaitForBegun(2));
  EXPECT_TRUE(helper->work.WaitForBegun(2));
}

TEST_F(FleetTest, TheLimitOfWaitingJobsIsTheFleets) {
  const auto one = Join(/*serve_only=*/true), two = Join(/*serve_only=*/true);
  int kept = 0;
  for (int i = 0; i < 30; ++i) {
    v1::Job job;
    Member* at = (i % 2 == 0 ? one : two).get();
    const grpc::Status status = Create(at, absl::StrCat("r", i), &job);
    if (!status.ok()) {
      EXPECT_EQ(ReasonOf(status), "JOBS_LIMIT");
      break;
    }
    ++kept;
  }
  EXPECT_EQ(kept, 10) << "half of it is one client's alone";
}

}  // namespace
}  // namespace rilievo
