// What is acknowledged outlives servers, workers, lines and disks.
#include <signal.h>

#include <random>
#include <thread>

#include "client/library/status_conversion.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// The server is killed at random moments while jobs are submitted and worked on.
TEST_F(JobsTest, EveryAcknowledgedJobEndsThoughTheServerIsKilled) {
  std::mt19937 random(1);
  StartServer();
  std::vector<PointCloud> scans;
  for (int i = 0; i < 4; ++i) scans.push_back(SphereScan(4'000 + 3'000 * i));
  std::vector<std::string> ids;
  std::jthread submitter([&] {
    for (size_t i = 0; i < 8; ++i) {
      const auto job =
          Client().Submit(PackScan(scans[i % scans.size()]), {}, "request-" + std::to_string(i));
      EXPECT_TRUE(job.ok()) << job.status();
      if (job.ok()) ids.push_back(job->job_id());
    }
  });
  for (int kill = 0; kill < 10; ++kill) {
    std::this_thread::sleep_for(milliseconds(random() % 400));
    KillServer();
    StartServer();
  }
  submitter.join();
  ASSERT_EQ(ids.size(), 8u);
  EXPECT_EQ(Client().List(100)->size(), 8u) << "none lost, none doubled";
  std::vector<std::vector<uint8_t>> expected;
  for (const PointCloud& scan : scans) expected.push_back(Expected(scan));
  for (size_t i = 0; i < ids.size(); ++i) {
    const auto done = Client().Watch(ids[i]);
    ASSERT_TRUE(done.ok()) << done.status();
    ASSERT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED) << done->error().message();
    EXPECT_EQ(*Client().Fetch(ids[i]), expected[i % scans.size()]);
  }
}

TEST_F(JobsTest, AJobEndsThoughItsWorkersAreKilled) {
  StartServer({"--max-concurrent-jobs", "1"});
  std::mt19937 random(2);
  const PointCloud scan = SphereScan(30'000);
  const auto job = Client().Submit(PackScan(scan), {}, "r");
  ASSERT_TRUE(job.ok());
  for (int i = 0; i < 5; ++i) {
    const pid_t worker = daemon_->WaitForWorker(seconds(10));
    ASSERT_GT(worker, 0);
    std::this_thread::sleep_for(milliseconds(random() % 100));
    kill(worker, SIGKILL);
  }
  const auto done = Client().Watch(job->job_id());
  ASSERT_TRUE(done.ok()) << done.status();
  ASSERT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED) << done->error().message();
  EXPECT_GE(done->attempts(), 4u);
  EXPECT_EQ(*Client().Fetch(job->job_id()), Expected(scan));
}

TEST_F(JobsTest, AWorkerThatIsKilledForEverFailsItsJob) {
  StartServer({"--max-concurrent-jobs", "1"});
  const auto job = Client().Submit(PackScan(SphereScan(300'000)), {}, "r");
  ASSERT_TRUE(job.ok());
  v1::Job now = *job;
  while (now.state() == v1::JOB_STATE_QUEUED || now.state() == v1::JOB_STATE_RUNNING) {
    const pid_t worker = daemon_->WaitForWorker(milliseconds(200));
    if (worker > 0) kill(worker, SIGKILL);
    now = *Client().Get(job->job_id());
  }
  EXPECT_EQ(now.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(now.error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
  EXPECT_EQ(now.attempts(), 10u);
}

TEST_F(JobsTest, ADrainLeavesWaitingJobsToTheNextServer) {
  StartServer({"--max-concurrent-jobs", "1", "--drain-seconds", "0"});
  const PointCloud scan = SphereScan(60'000);
  const PackedScan packed = PackScan(scan);
  const auto first = Client().Submit(packed, {}, "a");
  const auto second = Client().Submit(packed, {}, "b");
  ASSERT_TRUE(first.ok() && second.ok());
  ASSERT_GT(daemon_->WaitForWorker(seconds(10)), 0);
  absl::Status watched;
  std::jthread watcher([&] { watched = HastyClient().Watch(second->job_id()).status(); });
  std::this_thread::sleep_for(milliseconds(100));
  daemon_->Signal(SIGTERM);
  EXPECT_EQ(daemon_->WaitForExit(seconds(10)), 0);
  watcher.join();
  EXPECT_TRUE(absl::IsUnavailable(watched)) << watched;
  StartServer();
  for (const auto& id : {first->job_id(), second->job_id()}) {
    EXPECT_EQ(Client().Watch(id)->state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(*Client().Fetch(id), Expected(scan));
  }
}

// The line is cut at random bytes, and the upload goes on.
TEST_F(JobsTest, UploadsCutAtRandomBytesBecomeWhole) {
  StartServer();
  std::mt19937 random(3);
  const PackedScan scan = PackScan(SphereScan(50'000));
  const auto stub = v1::JobsService::NewStub(Channel());
  for (int round = 0; round < 25; ++round) {
    const size_t cut = random() % scan.bytes.size();
    v1::GetUploadRequest query;
    query.set_upload_id(scan.scan_id);
    v1::GetUploadResponse stored;
    grpc::Status asked;
    // The connection to a server that was killed may break only when it is used.
    for (int attempt = 0; attempt < 5; ++attempt) {
      grpc::ClientContext query_context;
      query_context.set_wait_for_ready(true);
      asked = stub->GetUpload(&query_context, query, &stored);
      if (asked.ok()) break;
    }
    ASSERT_TRUE(asked.ok()) << asked.error_message();
    grpc::ClientContext context;
    v1::UploadScanResponse response;
    const auto stream = stub->UploadScan(&context, &response);
    v1::UploadScanRequest request;
    request.mutable_header()->set_upload_id(scan.scan_id);
    request.mutable_header()->set_offset(stored.stored_bytes());
    request.mutable_header()->set_total_bytes(scan.bytes.size());
    stream->Write(request);
    for (size_t at = stored.stored_bytes(); at < cut;) {
      const size_t size = std::min<size_t>(1 + random() % 40'000, cut - at);
      request.set_chunk(scan.bytes.substr(at, size));
      if (!stream->Write(request)) break;
      at += size;
    }
    if (round % 2 == 0) {
      context.TryCancel();
    } else {
      stream->WritesDone();  // without `end`: never taken for a whole one
    }
    EXPECT_FALSE(stream->Finish().ok());
    v1::CreateJobRequest job;
    job.set_request_id("r");
    job.set_scan_id(scan.scan_id);
    job.mutable_header()->set_point_count(scan.header.point_count());
    job.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
    EXPECT_TRUE(absl::IsNotFound(HastyClient().Create(job).status()));
    if (round == 12) {
      KillServer();
      StartServer();
    }
  }
  int64_t first_sent = 0;
  ASSERT_TRUE(Client()
                  .Upload(scan, [&](int64_t sent) { first_sent = first_sent ? first_sent : sent; })
                  .ok());
  EXPECT_GT(first_sent, 300'000) << "it went on where it was cut";
  EXPECT_TRUE(Client().Submit(scan, {}, "r").ok());
}

TEST_F(JobsTest, AWrongSumIsRefusedAndDropped) {
  StartServer();
  PackedScan scan = PackScan(SphereScan(1'000));
  scan.scan_id[0] = scan.scan_id[0] == '0' ? '1' : '0';
  EXPECT_TRUE(absl::IsDataLoss(HastyClient().Upload(scan)));
  EXPECT_TRUE(std::filesystem::is_empty(test_ / "store/blobs"));
  EXPECT_TRUE(std::filesystem::is_empty(test_ / "store/uploads"));
}

// A client that falls silent in the middle, and one that does not read.
TEST_F(JobsTest, SilentClientsAreSentAway) {
  StartServer({"--max-idle-seconds", "0.5"});
  const auto stub = v1::JobsService::NewStub(Channel());
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto stream = stub->UploadScan(&context, &response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id("silent");
  request.mutable_header()->set_total_bytes(1000);
  stream->Write(request);
  const auto start = std::chrono::steady_clock::now();
  const absl::Status status = StatusFromGrpc(stream->Finish());
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  EXPECT_EQ(ErrorReason(status), "IDLE_LIMIT");
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(3));
}

TEST_F(JobsTest, UploadJobFetchDeleteForEverFillsNothing) {
  StartServer({"--keep-bytes", "400000"});
  for (int round = 0; round < 12; ++round) {
    PointCloud scan = SphereScan(10'000);
    scan.points.array() *= 1 + 0.01 * round;
    const auto job = HastyClient().Submit(PackScan(scan), {}, "r-" + std::to_string(round));
    ASSERT_TRUE(job.ok()) << round << ": " << job.status();
    ASSERT_EQ(Client().Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
    ASSERT_TRUE(Client().Fetch(job->job_id()).ok());
    ASSERT_TRUE(Client().Delete(job->job_id()).ok());
    EXPECT_TRUE(std::filesystem::is_empty(test_ / "store/blobs"));
  }
}

TEST_F(JobsTest, AScanIsDeletedByItself) {
  StartServer();
  const PackedScan scan = PackScan(SphereScan(1'000));
  ASSERT_TRUE(Client().Upload(scan).ok());
  EXPECT_TRUE(Client().DeleteScan(scan.scan_id).ok());
  EXPECT_TRUE(std::filesystem::is_empty(test_ / "store/blobs"));
  EXPECT_TRUE(absl::IsNotFound(HastyClient().DeleteScan(scan.scan_id)));
  EXPECT_TRUE(absl::IsInvalidArgument(HastyClient().DeleteScan("../x")));
}

TEST_F(JobsTest, AJobThatTakesTheServerAlongFailsInTheEnd) {
  StartServer({"--threads", "1"});
  const auto job = Client().Submit(PackScan(SphereScan(200'000)), {}, "poison");
  ASSERT_TRUE(job.ok()) << job.status();
  for (int kill = 0; kill < 10; ++kill) {
    const auto end = std::chrono::steady_clock::now() + seconds(10);
    while (Client().Get(job->job_id())->state() != v1::JOB_STATE_RUNNING &&
           std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    KillServer();
    StartServer({"--threads", "1"});
  }
  const auto failed = Client().Get(job->job_id());
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(failed->state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(failed->error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
}

}  // namespace
}  // namespace rilievo
