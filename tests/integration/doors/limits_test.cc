// Overload is answered at once, and no answer tells of the server's machine.
#include <filesystem>
#include <thread>

#include "client/library/connect.h"
#include "client/library/status_conversion.h"
#include "tests/integration/doors/every_rpc.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;

// The quickest of a few: a busy machine may delay any one of them.
template <typename Call>
double QuickestMilliseconds(const Call& call) {
  double quickest = 1e9;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    quickest = std::min(quickest, time.count());
  }
  return quickest;
}

class LimitsTest : public JobsTest {
 protected:
  static void ExpectOverload(const absl::Status& status, const std::string& reason) {
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_EQ(ErrorReason(status), reason) << status;
    EXPECT_TRUE(RetryDelay(status).has_value()) << status;
  }
};

TEST_F(LimitsTest, AFullServerSaysSoWithinFiftyMilliseconds) {
  StartServer({"--max-concurrent-jobs", "1", "--queue", "0", "--max-waiting-jobs", "1"});
  const PackedScan large = PackScan(SphereScan(300'000));
  ASSERT_TRUE(Client().Submit(large, {}, "first").ok());
  std::jthread busy([&](const std::stop_token& stop) {
    ReconstructionClient(Channel())
        .Reconstruct(SphereScan(300'000), {}, {}, {.timeout = {}, .stop = stop})
        .status()
        .IgnoreError();
  });
  std::this_thread::sleep_for(milliseconds(500));
  const ReconstructionClient client(Channel());
  ASSERT_TRUE(client.GetCapabilities().ok());
  const PointCloud small = SphereScan(50);
  absl::Status status;
  EXPECT_LT(QuickestMilliseconds([&] { status = client.Reconstruct(small, {}).status(); }), 50);
  ExpectOverload(status, "JOBS_LIMIT");
  const JobsClient jobs = HastyClient();
  v1::CreateJobRequest request;
  request.set_request_id("second");
  request.set_scan_id(large.scan_id);
  request.mutable_header()->set_point_count(large.point_count);
  request.mutable_header()->set_coordinate_format(large.format);
  EXPECT_LT(QuickestMilliseconds([&] { status = jobs.Create(request).status(); }), 50);
  ExpectOverload(status, "JOBS_LIMIT");
  busy.request_stop();
}

TEST_F(LimitsTest, StreamsAreBoundedAllTogether) {
  StartServer({"--max-calls", "3"});
  const auto stub = v1::JobsService::NewStub(Channel());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>>> uploads;
  v1::UploadScanResponse response;
  for (int i = 0; i < 3; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    uploads.push_back(stub->UploadScan(contexts.back().get(), &response));
  }
  std::this_thread::sleep_for(milliseconds(300));
  absl::Status status;
  EXPECT_LT(QuickestMilliseconds([&] { status = HastyClient().Watch("x").status(); }), 50);
  ExpectOverload(status, "CALLS_LIMIT");
  EXPECT_TRUE(HastyClient().List(1).ok()) << "short calls are served";
  for (const auto& context : contexts) context->TryCancel();
  for (const auto& upload : uploads) upload->Finish();
  for (int i = 0; i < 100 && ErrorReason(status) == "CALLS_LIMIT"; ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    status = HastyClient().Watch("x").status();
  }
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
}

// Everything a client can provoke, with a store, a worker and a working folder whose paths are
// known.
TEST_F(LimitsTest, NoErrorNamesAPathOrTheMachine) {
  StartServer({"--max-points", "5000", "--max-surface-faces", "100000"});
  std::vector<std::string> said;
  for (const auto& [rpc, status] : CallEveryRpc(Channel())) {
    said.push_back(status.error_message() + status.error_details());
  }
  const ReconstructionClient client(Channel());
  const JobsClient jobs = HastyClient();
  PointCloud line;
  line.points.setZero(3, 100);
  line.points.row(0).setLinSpaced(0, 1);
  v1::ReconstructOptions odd;
  odd.set_max_level(8);
  const auto add = [&](const absl::Status& status) {
    EXPECT_FALSE(status.ok());
    said.push_back(std::string(status.message()));
  };
  add(client.Reconstruct(line, {}).status());
  add(client.Reconstruct(SphereScan(6000), {}).status());
  add(client.Reconstruct(SphereScan(4000), odd).status());
  add(jobs.Get("../../etc/passwd").status());
  add(jobs.Fetch("nothing").status());
  v1::CreateJobRequest request;
  request.set_request_id("r");
  request.set_scan_id(std::string(64, 'a'));
  request.mutable_header()->set_point_count(100);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  add(jobs.Create(request).status());
  // A store that is damaged beneath the server.
  const PackedScan scan = PackScan(SphereScan(500));
  const auto job = jobs.Submit(scan, {}, "one");
  ASSERT_TRUE(job.ok());
  ASSERT_TRUE(jobs.Watch(job->job_id()).ok());
  std::filesystem::remove_all(test_ / "store/blobs");
  std::filesystem::remove_all(test_ / "store/uploads");
  add(jobs.Fetch(job->job_id()).status());
  add(jobs.Upload(PackScan(SphereScan(501))));
  // A worker that dies.
  std::jthread killer([&] {
    const pid_t worker = daemon_->WaitForWorker(seconds(10));
    if (worker > 0) kill(worker, SIGSEGV);
  });
  add(client.Reconstruct(SphereScan(5000), {}).status());
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  for (const std::string& text : said) {
    for (const std::string& secret :
         {test_ / "", std::string("/tmp"), std::string("/bin"), std::string("rilievo-worker"),
          std::string(".cc"), std::string("0x")}) {
      EXPECT_THAT(text, Not(HasSubstr(secret)));
    }
    if (host[0] != '\0' && std::string(host) != "localhost") {
      EXPECT_THAT(text, Not(HasSubstr(host)));
    }
  }
}

TEST_F(LimitsTest, AnEphemeralServerKeepsJobsWhileItRuns) {
  ASSERT_TRUE(std::filesystem::create_directory(test_ / "tmp"));
  setenv("TMPDIR", (test_ / "tmp").c_str(), 1);
  const auto left = [&] {
    return std::distance(std::filesystem::directory_iterator(test_ / "tmp"),
                         std::filesystem::directory_iterator());
  };
  const PackedScan scan = PackScan(SphereScan(500));
  std::string id;
  {
    DaemonProcess daemon({"--ephemeral"});
    const JobsClient jobs(ConnectPlaintext(daemon.address()));
    const auto job = jobs.Submit(scan, {}, "one");
    ASSERT_TRUE(job.ok()) << job.status();
    id = job->job_id();
    ASSERT_EQ(jobs.Watch(id)->state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_TRUE(jobs.Fetch(id).ok());
    EXPECT_EQ(left(), 1);
    daemon.Signal(SIGTERM);
    EXPECT_EQ(daemon.WaitForExit(seconds(10)), 0);
  }
  EXPECT_EQ(left(), 0) << "nothing is kept";
  {
    DaemonProcess killed({"--ephemeral"});
    EXPECT_TRUE(absl::IsNotFound(JobsClient(ConnectPlaintext(killed.address())).Get(id).status()));
    killed.Signal(SIGKILL);
    killed.WaitForExit(seconds(10));
  }
  EXPECT_EQ(left(), 1);
  DaemonProcess next({"--ephemeral"});
  EXPECT_EQ(left(), 1) << "its own: what the killed one left is gone";
  unsetenv("TMPDIR");
}

}  // namespace
}  // namespace rilievo
