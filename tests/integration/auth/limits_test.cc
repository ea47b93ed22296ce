// Overload is answered at once, and no answer tells of the server's machine.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "client/library/connect.h"
#include "client/library/status_conversion.h"
#include "server/os/file_descriptor.h"
#include "tests/integration/auth/every_rpc.h"
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
  // Takes the place that there is to wait behind it.
  std::jthread busy([&](const std::stop_token& stop) {
    ReconstructionClient(Channel())
        .Reconstruct(SphereScan(50), {}, {}, {.timeout = {}, .stop = stop})
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
  request.mutable_header()->set_point_count(large.header.point_count());
  request.mutable_header()->set_coordinate_format(large.header.coordinate_format());
  EXPECT_LT(QuickestMilliseconds([&] { status = jobs.Create(request).status(); }), 50);
  ExpectOverload(status, "JOBS_LIMIT");
  busy.request_stop();
}

TEST_F(LimitsTest, StreamsAreBoundedAllTogether) {
  StartServer({"--max-calls", "6"});  // of which one client gets three
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

TEST_F(LimitsTest, ConnectionsAreBoundedByAddressAndAllTogether) {
  StartServer(
      {"--max-connections", "6", "--max-address-connections", "4", "--metrics", "127.0.0.1:0"});
  const int port = std::stoi(address_.substr(address_.rfind(':') + 1));
  std::vector<FileDescriptor> mute;
  const auto connect_from = [&](const char* from) {
    mute.emplace_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, from, &address.sin_addr);
    EXPECT_EQ(bind(mute.back().number(), reinterpret_cast<sockaddr*>(&address), sizeof(address)),
              0);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    EXPECT_EQ(connect(mute.back().number(), reinterpret_cast<sockaddr*>(&address), sizeof(address)),
              0);
  };
  // What the server says to a connection before it closes it.
  const auto answer = [&](const FileDescriptor& connection) {
    std::string said(12, '\0');
    return connection.Read(said.data(), said.size()).ok() ? said : "";
  };
  for (int i = 0; i < 4; ++i) connect_from("127.0.0.1");
  std::this_thread::sleep_for(milliseconds(200));
  absl::Status status = ReconstructionClient(Channel()).GetCapabilities().status();
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("http1.x server"))
      << "so gRPC 1.51 calls an answer in HTTP/1.1";
  connect_from("127.0.0.1");
  EXPECT_EQ(answer(mute.back()), "HTTP/1.1 503");
  for (const char* from : {"127.0.0.2", "127.0.0.3", "127.0.0.4"}) connect_from(from);
  EXPECT_EQ(answer(mute.back()), "HTTP/1.1 503") << "the seventh";
  const auto line = daemon_->WaitForLine("metrics at ", seconds(10));
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(std::system(("curl -s --max-time 10 " +
                         line->substr(line->find("http:"), line->rfind('"') - line->find("http:")) +
                         " > " + (test_ / "metrics"))
                            .c_str()),
            0);
  std::stringstream metrics;
  metrics << std::ifstream(test_ / "metrics").rdbuf();
  EXPECT_THAT(metrics.str(), HasSubstr("rilievo_connections 6\n"));
  EXPECT_THAT(metrics.str(), HasSubstr("rilievo_connections_refused_total{reason=\"ALL\"} 1\n"));
  EXPECT_THAT(metrics.str(),
              Not(HasSubstr("rilievo_connections_refused_total{reason=\"ADDRESS\"} 0\n")));
  mute.clear();
  for (int i = 0; i < 100 && !status.ok(); ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    status = ReconstructionClient(Channel()).GetCapabilities().status();
  }
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(LimitsTest, AnUploadHasItsTimeAndGoesOnInAnotherStream) {
  StartServer({"--max-job-seconds", "1"});
  const PackedScan scan = PackScan(SphereScan(3000));
  const auto stub = v1::JobsService::NewStub(Channel());
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto stream = stub->UploadScan(&context, &response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id(scan.scan_id);
  request.mutable_header()->set_total_bytes(scan.bytes.size());
  const auto start = std::chrono::steady_clock::now();
  // A few bytes at a time, never silent.
  for (size_t at = 0; stream->Write(request); at += 24) {
    request.set_chunk(scan.bytes.substr(at, 24));
    std::this_thread::sleep_for(milliseconds(20));
  }
  const absl::Status status = StatusFromGrpc(stream->Finish());
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  EXPECT_EQ(ErrorReason(status), "UPLOAD_TIME_LIMIT");
  EXPECT_TRUE(RetryDelay(status).has_value()) << "clients go on by themselves";
  EXPECT_GT(time.count(), 0.9);
  EXPECT_LT(time.count(), 15) << "gRPC's client looks for answers every 5 s while it writes";
  EXPECT_TRUE(Client().Upload(scan).ok()) << "from where it ended";
}

TEST_F(LimitsTest, UploadsLeavePlacesToOthers) {
  StartServer({"--max-uploads", "4"});
  const auto stub = v1::JobsService::NewStub(Channel());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>>> uploads;
  v1::UploadScanResponse response;
  for (int i = 0; i < 2; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    uploads.push_back(stub->UploadScan(contexts.back().get(), &response));
  }
  std::this_thread::sleep_for(milliseconds(300));
  ExpectOverload(HastyClient().Upload(PackScan(SphereScan(100))), "JOBS_LIMIT");
  for (const auto& context : contexts) context->TryCancel();
  for (const auto& upload : uploads) upload->Finish();
  EXPECT_TRUE(Client().Upload(PackScan(SphereScan(100))).ok());
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
    if (worker > 0) kill(worker, SIGABRT);
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
