// rilievod as a process: ready line, probe, signals, memory under attack.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cstdio>
#include <sstream>

#include "client/library/reconstruction_client.h"
#include "client/library/status_conversion.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/simulated_scans.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

constexpr int64_t kMiB = 1 << 20;

double SecondsSince(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

int Probe(const std::string& address) { return RunProgram({RILIEVOD_PROGRAM, "--probe", address}); }

TEST(Daemon, SaysWhereItListensAndAnswersTheProbe) {
  DaemonProcess daemon;
  ASSERT_THAT(daemon.address(), HasSubstr("127.0.0.1:"));
  EXPECT_EQ(Probe(daemon.address()), 0);
  EXPECT_TRUE(ReconstructionClient(ConnectPlaintext(daemon.address())).GetCapabilities().ok());
  const auto start = steady_clock::now();
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.WaitForExit(seconds(5)), 0);
  EXPECT_LT(SecondsSince(start), 2) << "nothing runs, so nothing is waited for";
  EXPECT_EQ(Probe(daemon.address()), 1);
}

// What rilievod prints, errors included.
std::string Printed(const std::string& arguments) {
  std::FILE* pipe = popen((RILIEVOD_PROGRAM " " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  for (int c; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
  pclose(pipe);
  return text;
}

TEST(Daemon, HelpFitsATerminalAndWrongOptionsAreExplained) {
  const std::string help = Printed("--help");
  EXPECT_THAT(help, HasSubstr("--max-address-connections N"));
  EXPECT_THAT(help, HasSubstr("default 127.0.0.1:50051"));
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
  EXPECT_THAT(Printed("--max-point 5"), HasSubstr("did you mean --max-points?"));
  EXPECT_THAT(Printed("--log loud"), HasSubstr("'loud' is not one of"));
  EXPECT_THAT(Printed("--threads many"), HasSubstr("'many' is not a number"));
}

TEST(Daemon, MayOpenAsManyFilesAsTheHardLimitAllows) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit few = before;
  few.rlim_cur = 200;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  const DaemonProcess daemon;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit of_daemon{};
  ASSERT_EQ(prlimit(daemon.pid(), RLIMIT_NOFILE, nullptr, &of_daemon), 0);
  EXPECT_EQ(of_daemon.rlim_cur, before.rlim_max);
}

TEST(Daemon, RefusesWrongArguments) {
  EXPECT_NE(RunProgram({RILIEVOD_PROGRAM, "--no-such-option"}), 0);
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--max-concurrent-jobs", "0"}), 1);
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--max-job-seconds", "0"}), 1);
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--version"}), 0);
}

TEST(Daemon, LimitsFromTheCommandLineReachTheService) {
  DaemonProcess daemon({"--max-points", "1000", "--max-bytes", "9000", "--max-concurrent-jobs", "1",
                        "--queue", "3", "--threads", "1", "--max-job-seconds", "1.5",
                        "--max-idle-seconds", "2", "--max-surface-faces", "777"});
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const auto capabilities = client.GetCapabilities();
  ASSERT_TRUE(capabilities.ok()) << capabilities.status();
  const v1::Limits& limits = capabilities->limits();
  EXPECT_EQ(limits.max_points(), 1000u);
  EXPECT_EQ(limits.max_scan_bytes(), 9000u);
  EXPECT_EQ(limits.max_concurrent_jobs(), 1u);
  EXPECT_EQ(limits.max_queued_jobs(), 3u);
  EXPECT_EQ(limits.max_threads(), 1u);
  EXPECT_EQ(limits.max_job_seconds(), 1.5);
  EXPECT_EQ(limits.max_idle_seconds(), 2);
  EXPECT_EQ(limits.max_surface_faces(), 777u);
  const auto refused = client.Reconstruct(SphereScan(1001), {});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ErrorReason(refused.status()), "LIMIT_EXCEEDED");
}

TEST(Daemon, DrainsOnSigterm) {
  DaemonProcess daemon({"--drain-seconds", "600"});
  const auto channel = ConnectPlaintext(daemon.address());
  bool signalled = false;
  int probed = -1;
  absl::Status refused;
  ReconstructCallbacks callbacks;
  callbacks.progress = [&](const v1::Progress& progress) {
    if (signalled || progress.stage() < v1::STAGE_NEIGHBORS) return;
    signalled = true;
    daemon.Signal(SIGTERM);
    daemon.WaitForLine("draining", seconds(5));
    probed = Probe(daemon.address());
    refused = ReconstructionClient(channel).Reconstruct(SphereScan(50), {}).status();
  };
  const auto result = ReconstructionClient(channel).Reconstruct(SphereScan(60'000), {}, callbacks);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(signalled);
  EXPECT_EQ(probed, 1) << "health says so while the job still runs";
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ErrorReason(refused), "SHUTTING_DOWN");
  EXPECT_EQ(daemon.WaitForExit(seconds(5)), 0);
}

TEST(Daemon, StopsWhatOutlastsTheDrain) {
  DaemonProcess daemon({"--drain-seconds", "0"});
  steady_clock::time_point signalled{};
  ReconstructCallbacks callbacks;
  callbacks.progress = [&](const v1::Progress& progress) {
    if (signalled != steady_clock::time_point() || progress.stage() < v1::STAGE_CHECK) return;
    daemon.Signal(SIGTERM);
    signalled = steady_clock::now();
  };
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const auto result = client.Reconstruct(SphereScan(300'000), {}, callbacks);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kUnavailable) << result.status();
  EXPECT_EQ(daemon.WaitForExit(seconds(10)), 0);
  EXPECT_LT(SecondsSince(signalled), 3);
}

// Each stage of a real job is cancelled as soon as it reports itself; the log tells when the work
// has ended.
TEST(Daemon, CancelReachesEveryStageWithinASecond) {
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const PointCloud scan = SphereScan(150'000);
  int job = 0;
  for (int stage = v1::STAGE_CHECK; stage <= v1::STAGE_MEASURE; ++stage) {
    std::stop_source stop;
    steady_clock::time_point cancelled{};
    ReconstructCallbacks callbacks;
    callbacks.progress = [&](const v1::Progress& progress) {
      if (progress.stage() < stage || stop.stop_requested()) return;
      cancelled = steady_clock::now();
      stop.request_stop();
    };
    CallOptions call;
    call.stop = stop.get_token();
    const auto result = client.Reconstruct(scan, {}, callbacks, call);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled) << result.status();
    const auto line = daemon.WaitForLine("\"job\":" + std::to_string(++job) + ",", seconds(20));
    EXPECT_LT(SecondsSince(cancelled), 1) << v1::Stage_Name(static_cast<v1::Stage>(stage));
    ASSERT_TRUE(line.has_value());
    EXPECT_THAT(*line, HasSubstr("\"status\":\"CANCELLED\"")) << *line;
  }
}

// A message whose 256 MiB of zeros are 256 KiB on the wire.
TEST(Daemon, AGzipBombIsRefusedWithoutBeingInflated) {
  DaemonProcess daemon;
  ASSERT_EQ(Probe(daemon.address()), 0);
  const std::string zeros(kMiB, '\0');
  std::vector<grpc::Slice> slices(256, grpc::Slice(zeros));
  const grpc::ByteBuffer bomb(slices.data(), slices.size());
  for (const std::string method : {"Reconstruct", "GetCapabilities"}) {
    const int64_t before = daemon.PeakBytes();
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
    grpc::GenericStub stub(
        grpc::CreateCustomChannel(daemon.address(), grpc::InsecureChannelCredentials(), arguments));
    grpc::ClientContext context;
    context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
    context.set_deadline(std::chrono::system_clock::now() + seconds(60));
    grpc::CompletionQueue queue;
    const auto call = stub.PrepareUnaryCall(&context, "/rilievo.v1.ReconstructionService/" + method,
                                            bomb, &queue);
    call->StartCall();
    grpc::ByteBuffer response;
    grpc::Status status;
    call->Finish(&response, &status, nullptr);
    void* tag;
    bool ok;
    ASSERT_TRUE(queue.Next(&tag, &ok));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << status.error_message();
    EXPECT_LT(daemon.PeakBytes() - before, 16 * kMiB) << method;
  }
  EXPECT_EQ(Probe(daemon.address()), 0);
}

TEST(Daemon, AClaimOfFourBillionPointsCostsNothing) {
  DaemonProcess daemon({"--max-points", "100000000000", "--max-bytes", "9000000000000",
                        "--memory-budget", "9000000000000"});
  ASSERT_EQ(Probe(daemon.address()), 0);
  const auto stub = v1::ReconstructionService::NewStub(ConnectPlaintext(daemon.address()));
  const int64_t before = daemon.PeakBytes();
  // Even where the operator allows so many: nothing is allocated for points that have not come.
  grpc::ClientContext context;
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructRequest request;
  request.mutable_header()->set_point_count(4'000'000'000);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  ASSERT_TRUE(stream->Write(request));
  request.mutable_points()->set_data(std::string(1200, '\0'));
  ASSERT_TRUE(stream->Write(request));
  stream->WritesDone();
  v1::ReconstructResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_LT(daemon.PeakBytes() - before, 8 * kMiB);
  EXPECT_EQ(Probe(daemon.address()), 0);
}

TEST(Daemon, AClaimBeyondTheMemoryIsRefusedAtOnce) {
  DaemonProcess daemon({"--max-points", "100000000000", "--max-bytes", "9000000000000"});
  const auto stub = v1::ReconstructionService::NewStub(ConnectPlaintext(daemon.address()));
  grpc::ClientContext context;
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructRequest request;
  request.mutable_header()->set_point_count(4'000'000'000);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  stream->Write(request);
  const absl::Status status = StatusFromGrpc(stream->Finish());
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_EQ(ErrorReason(status), "MEMORY_LIMIT");
}

TEST(Daemon, MessagesOfOnePointCostTheirBytes) {
  DaemonProcess daemon;
  const auto stub = v1::ReconstructionService::NewStub(ConnectPlaintext(daemon.address()));
  grpc::ClientContext context;
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructRequest request;
  request.mutable_header()->set_point_count(1'000'000);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  ASSERT_TRUE(stream->Write(request));
  const int64_t before = daemon.ResidentBytes();
  request.mutable_points()->set_data(std::string(12, '\0'));
  int written = 0;
  while (written < 100'000 && stream->Write(request)) ++written;
  EXPECT_EQ(written, 100'000) << StatusFromGrpc(stream->Finish());
  if (HasFailure()) return;
  stream->WritesDone();
  v1::ReconstructResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_LT(daemon.PeakBytes() - before, 16 * kMiB);
}

}  // namespace
}  // namespace rilievo
