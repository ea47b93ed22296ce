// Kept jobs whose work the test controls: slow readers, shutdown, bounds of the queue.
#include <fcntl.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <future>

#include "client/library/jobs_client.h"
#include "client/library/status_conversion.h"
#include "server/health_probe.h"
#include "server/os/file_descriptor.h"
#include "tests/integration/service/service_fixture.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

int64_t ResidentBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stoll(line.substr(6)) * 1024;
  }
  return 0;
}

class KeptJobsTest : public ServiceTest {
 protected:
  void Start(ServerOptions options = {}) {
    server_.reset();
    options.store = test_ / "store";
    StartServer(options);
  }

  JobsClient Client() const { return JobsClient(NewChannel(), {.attempts = 1}); }

  static PackedScan Scan(float value) {
    PointCloud scan;
    scan.points.setConstant(3, 20, static_cast<double>(value));
    return PackScan(scan);
  }

  absl::StatusOr<v1::Job> Submit(const std::string& request_id) const {
    return Client().Submit(Scan(1), {}, request_id);
  }

  // Before server_, which it outlives.
  TestFolder test_;
  ~KeptJobsTest() override { server_.reset(); }
};

TEST_F(KeptJobsTest, ReadersThatDoNotReadHoldLittleAndAreSentAway) {
  work_.chunk_sizes = {1000, 40'000'000};
  ServerOptions options;
  options.max_idle_time = milliseconds(1500);
  Start(options);
  const auto job = Submit("r");
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_EQ(Client().Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  v1::StreamSurfaceRequest request;
  request.set_job_id(job->job_id());
  // Readers whose own buffers stay small: what piles up, piles up at the server.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  const auto stub = v1::JobsService::NewStub(
      grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::StreamSurfaceResponse>>> readers;
  const int64_t before = ResidentBytes();
  for (int i = 0; i < 50; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    readers.push_back(stub->StreamSurface(contexts.back().get(), request));
  }
  std::this_thread::sleep_for(milliseconds(700));
  // At most three pieces each, and both ends of the connection are in this process.
  EXPECT_LT(ResidentBytes() - before, 50 * 3 * (128 << 10));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(Client().Fetch(job->job_id()).ok()) << "others are served";
  int refused = 0;
  for (auto& reader : readers) {
    v1::StreamSurfaceResponse response;
    std::this_thread::sleep_until(start + seconds(3));
    while (reader->Read(&response)) {
    }
    refused += !reader->Finish().ok();
  }
  EXPECT_EQ(refused, 50);
}

TEST_F(KeptJobsTest, TheQueueOfKeptJobsIsBounded) {
  work_.wait = true;
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  options.max_waiting_jobs = 6;  // of which one client gets three
  Start(options);
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(Submit(id).ok());
  const auto start = std::chrono::steady_clock::now();
  const auto refused = Submit("d");
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ErrorReason(refused.status()), "JOBS_LIMIT");
  EXPECT_TRUE(RetryDelay(refused.status()).has_value());
  EXPECT_LT(SecondsSince(start), 1);
  EXPECT_TRUE(Submit("b").ok()) << "one that is known already";
  work_.Release();
  const auto jobs = Client().List(10);
  for (const v1::Job& job : *jobs) {
    EXPECT_EQ(Client().Watch(job.job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  }
  EXPECT_TRUE(Submit("d").ok());
}

TEST_F(KeptJobsTest, TheNextServerTakesUpWhatTheLastOneLeft) {
  work_.wait = true;
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  Start(options);
  const auto running = Submit("running"), waiting = Submit("waiting");
  ASSERT_TRUE(running.ok() && waiting.ok());
  ASSERT_TRUE(work_.WaitForBegun(1));
  auto watched =
      std::async(std::launch::async, [&] { return Client().Watch(running->job_id()).status(); });
  std::this_thread::sleep_for(milliseconds(100));
  server_->BeginDrain();
  EXPECT_TRUE(absl::IsUnavailable(watched.get())) << "watchers are sent elsewhere at once";
  EXPECT_EQ(Submit("new").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(server_->WaitUntilIdle(milliseconds(50))) << "what runs goes on";
  server_.reset();
  EXPECT_EQ(work_.stopped(), 1);
  work_.Release();
  Start(options);
  EXPECT_EQ(Client().Watch(running->job_id())->attempts(), 2u);
  EXPECT_EQ(Client().Watch(waiting->job_id())->attempts(), 1u);
  const EncodedSurface expected = work_.Encoded();
  EXPECT_EQ(*Client().Fetch(running->job_id()), expected.Concatenate());
}

TEST_F(KeptJobsTest, AJobThatTakesTooLongFails) {
  work_.wait = true;
  ServerOptions options;
  options.max_job_time = milliseconds(300);
  Start(options);
  const auto job = Submit("r");
  ASSERT_TRUE(job.ok());
  const auto done = Client().Watch(job->job_id());
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(done->error().code(), static_cast<int>(absl::StatusCode::kDeadlineExceeded));
}

TEST_F(KeptJobsTest, DeletingARunningJobStopsIt) {
  work_.wait = true;
  Start();
  const auto job = Submit("r");
  ASSERT_TRUE(work_.WaitForBegun(1));
  EXPECT_TRUE(Client().Delete(job->job_id()).ok());
  EXPECT_TRUE(work_.WaitForStopped(1, seconds(1)));
  EXPECT_TRUE(absl::IsNotFound(Client().Get(job->job_id()).status()));
  EXPECT_TRUE(Client().List(10)->empty());
}

// A disk that does not answer: files that nobody writes to.
TEST_F(KeptJobsTest, HealthTellsOfADiskThatHangs) {
  ServerOptions options;
  options.stuck_time = milliseconds(400);
  Start(options);
  const auto job = Submit("r");
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_EQ(Client().Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  std::vector<std::string> blobs;
  for (const auto& blob : std::filesystem::directory_iterator(test_ / "store/blobs")) {
    blobs.push_back(blob.path());
  }
  for (const std::string& blob : blobs) {
    std::filesystem::remove(blob);
    ASSERT_EQ(mkfifo(blob.c_str(), 0600), 0);
  }
  const auto probe = [&](const std::string& service) {
    return ProbeHealth(server_->address(), seconds(5), service).code();
  };
  const auto comes = [&](const std::string& service, absl::StatusCode code) {
    for (int i = 0; i < 100 && probe(service) != code; ++i) {
      std::this_thread::sleep_for(milliseconds(50));
    }
    return probe(service) == code;
  };
  EXPECT_EQ(probe("alive"), absl::StatusCode::kOk);
  std::vector<std::jthread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] { Client().Fetch(job->job_id()).status().IgnoreError(); });
  }
  EXPECT_TRUE(comes("alive", absl::StatusCode::kUnavailable));
  EXPECT_EQ(probe(""), absl::StatusCode::kUnavailable);
  EXPECT_EQ(probe("rilievo.v1.JobsService"), absl::StatusCode::kUnavailable);
  std::vector<FileDescriptor> writers;
  for (const std::string& blob : blobs) writers.emplace_back(open(blob.c_str(), O_RDWR));
  writers.clear();
  readers.clear();
  EXPECT_TRUE(comes("alive", absl::StatusCode::kOk));
  EXPECT_EQ(probe(""), absl::StatusCode::kOk);
}

}  // namespace
}  // namespace rilievo
