// Kept jobs, from upload to removal, against the program itself.
#include <thread>

#include "client/library/status_conversion.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

TEST_F(JobsTest, FromAScanToItsSurface) {
  StartServer();
  const PointCloud scan = SphereScan(5'000);
  const auto job = Client().Submit(PackScan(scan), {}, "first");
  ASSERT_TRUE(job.ok()) << job.status();
  std::vector<uint64_t> numbers;
  std::vector<v1::JobState> states;
  int progress = 0;
  const auto done = Client().Watch(job->job_id(), [&](const v1::JobEvent& event) {
    numbers.push_back(event.sequence());
    if (event.has_job()) states.push_back(event.job().state());
    progress += event.has_progress();
  });
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done->attempts(), 1u);
  EXPECT_GT(progress, 3);
  EXPECT_EQ(states.back(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end()));
  EXPECT_EQ(done->report().points_in(), 5'000);
  EXPECT_GE(done->end_time().seconds(), done->create_time().seconds());
  const auto surface = Client().Fetch(job->job_id());
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(*surface, Expected(scan));
  EXPECT_EQ(done->surface().total_bytes(), surface->size());
  const auto jobs = Client().List(10);
  ASSERT_EQ(jobs->size(), 1u);
  EXPECT_EQ((*jobs)[0].job_id(), job->job_id());
  EXPECT_TRUE(Client().Delete(job->job_id()).ok());
  EXPECT_TRUE(absl::IsNotFound(Client().Get(job->job_id()).status()));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Delete(job->job_id())));
}

TEST_F(JobsTest, TheSameRequestSixteenTimesAtOnceIsOneJob) {
  StartServer();
  const PackedScan scan = PackScan(SphereScan(3'000));
  std::vector<absl::StatusOr<v1::Job>> jobs(16, absl::UnknownError("not called"));
  {
    std::vector<std::jthread> threads;
    for (auto& job : jobs) {
      threads.emplace_back([&] { job = Client().Submit(scan, {}, "same"); });
    }
  }
  for (const auto& job : jobs) {
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->job_id(), jobs[0]->job_id());
  }
  EXPECT_EQ(Client().List(100)->size(), 1u);
  v1::ReconstructOptions other;
  other.set_max_level(1);
  EXPECT_EQ(Client().Submit(scan, other, "same").status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(JobsTest, CancelEndsAJobInTheQueueAndAtWork) {
  StartServer({"--max-concurrent-jobs", "1"});
  const PackedScan scan = PackScan(SphereScan(200'000));
  const auto working = Client().Submit(scan, {}, "working");
  const auto waiting = Client().Submit(scan, {}, "waiting");
  ASSERT_TRUE(working.ok() && waiting.ok());
  ASSERT_GT(daemon_->WaitForWorker(seconds(10)), 0);
  EXPECT_EQ(Client().Cancel(waiting->job_id())->state(), v1::JOB_STATE_CANCELLED);
  const auto start = steady_clock::now();
  EXPECT_EQ(Client().Cancel(working->job_id())->state(), v1::JOB_STATE_CANCELLED);
  while (!daemon_->Workers().empty() && SecondsSince(start) < 5) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_LT(SecondsSince(start), 1) << "the worker is killed";
  EXPECT_EQ(Client().Watch(working->job_id())->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(Client().Cancel(working->job_id())->state(), v1::JOB_STATE_CANCELLED) << "again";
  const auto none = Client().Fetch(working->job_id());
  EXPECT_EQ(none.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ErrorReason(none.status()), "JOB_NOT_SUCCEEDED");
}

TEST_F(JobsTest, AJobThatCannotSucceedSaysWhy) {
  StartServer();
  PointCloud scan = SphereScan(100);
  scan.points.colwise() = Eigen::Vector3d(1, 2, 3);
  const auto job = Client().Submit(PackScan(scan), {}, "identical");
  ASSERT_TRUE(job.ok()) << job.status();
  const auto done = Client().Watch(job->job_id());
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(done->error().code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
  EXPECT_THAT(done->error().message(), HasSubstr("points: "));
}

TEST_F(JobsTest, WrongRequestsNameTheirField) {
  StartServer({"--max-points", "10000"});
  const PackedScan scan = PackScan(SphereScan(100));
  ASSERT_TRUE(Client().Upload(scan).ok());
  v1::CreateJobRequest request;
  request.set_request_id("r");
  request.set_scan_id(scan.scan_id);
  request.mutable_header()->set_point_count(100);
  request.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
  const auto field = [&](auto change) {
    v1::CreateJobRequest wrong = request;
    change(&wrong);
    const absl::Status status = HastyClient().Create(wrong).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    return std::string(status.message());
  };
  EXPECT_THAT(field([](auto* r) { r->set_request_id("a b"); }), HasSubstr("request_id"));
  EXPECT_THAT(field([](auto* r) { r->set_scan_id("../etc"); }), HasSubstr("scan_id"));
  EXPECT_THAT(field([](auto* r) { r->mutable_header()->set_point_count(99); }),
              HasSubstr("header.point_count"));
  EXPECT_THAT(field([](auto* r) { r->mutable_header()->set_point_count(10'001); }),
              HasSubstr("header.point_count"));
  EXPECT_THAT(field([](auto* r) { r->mutable_header()->mutable_options()->set_max_level(9); }),
              HasSubstr("max_level"));
  request.set_scan_id(std::string(64, '0'));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Create(request).status()));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Watch("nothing").status()));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Fetch("nothing").status()));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Cancel("nothing").status()));
}

TEST_F(JobsTest, TheSurfaceFromAnyByteOrLayer) {
  StartServer();
  const PointCloud scan = SphereScan(20'000);
  const auto job = Client().Submit(PackScan(scan), {}, "r");
  ASSERT_TRUE(job.ok());
  const auto done = Client().Watch(job->job_id());
  const auto whole = Client().Fetch(job->job_id());
  ASSERT_TRUE(whole.ok());
  const auto stub = v1::JobsService::NewStub(Channel());
  const auto read = [&](const v1::StreamSurfaceRequest& request, std::string* bytes) {
    grpc::ClientContext context;
    const auto stream = stub->StreamSurface(&context, request);
    v1::StreamSurfaceResponse response;
    while (stream->Read(&response)) *bytes += response.piece().data();
    return stream->Finish();
  };
  v1::StreamSurfaceRequest request;
  request.set_job_id(job->job_id());
  uint64_t begin = 0;
  for (int chunk = 0; chunk < done->surface().chunk_bytes_size(); ++chunk) {
    std::string bytes;
    request.set_chunk(static_cast<uint32_t>(chunk));
    EXPECT_TRUE(read(request, &bytes).ok());
    EXPECT_EQ(bytes, std::string(whole->begin() + static_cast<int64_t>(begin), whole->end()));
    begin += done->surface().chunk_bytes(chunk);
  }
  for (const uint64_t offset : {uint64_t{1}, whole->size() / 2, whole->size() - 1, whole->size()}) {
    std::string bytes;
    request.set_offset(offset);
    EXPECT_TRUE(read(request, &bytes).ok());
    EXPECT_EQ(bytes, std::string(whole->begin() + static_cast<int64_t>(offset), whole->end()));
  }
  std::string none;
  request.set_offset(whole->size() + 1);
  EXPECT_EQ(read(request, &none).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  request.set_chunk(99);
  EXPECT_EQ(read(request, &none).error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST_F(JobsTest, AWatcherThatComesBackMissesNothingAndSeesNothingTwice) {
  StartServer();
  const auto job = Client().Submit(PackScan(SphereScan(60'000)), {}, "r");
  ASSERT_TRUE(job.ok());
  const auto stub = v1::JobsService::NewStub(Channel());
  v1::WatchJobRequest request;
  request.set_job_id(job->job_id());
  bool finished = false;
  int streams = 0;
  for (; !finished && streams < 1000; ++streams) {
    grpc::ClientContext context;
    const auto stream = stub->WatchJob(&context, request);
    v1::WatchJobResponse response;
    // One event a stream.
    if (stream->Read(&response)) {
      EXPECT_GT(response.event().sequence(), request.after_sequence());
      request.set_after_sequence(response.event().sequence());
      finished = response.event().job().state() == v1::JOB_STATE_SUCCEEDED;
    }
    context.TryCancel();
    stream->Finish();
  }
  EXPECT_TRUE(finished);
  EXPECT_GT(streams, 3);
  EXPECT_TRUE(HastyClient().Watch(job->job_id()).ok());
}

TEST_F(JobsTest, AServerWithoutAStoreSaysSo) {
  DaemonProcess daemon;
  const JobsClient client(ConnectPlaintext(daemon.address()), {.attempts = 1});
  for (const absl::Status& status :
       {client.Get("x").status(), client.Watch("x").status(), client.Fetch("x").status(),
        client.Upload(PackScan(SphereScan(30))), client.List(1).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_EQ(ErrorReason(status), "NO_STORE");
  }
  EXPECT_NE(RunProgram({RILIEVOD_PROGRAM, "--ephemeral", "--store", "x"}), 0);
}

TEST_F(JobsTest, AStoreHasOneServer) {
  StartServer();
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--listen", "127.0.0.1:0", "--store", test_ / "store"}),
            1);
}

}  // namespace
}  // namespace rilievo
