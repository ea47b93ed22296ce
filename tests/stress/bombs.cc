#include <thread>

#include "client/library/status_conversion.h"
#include "grpcpp/client_context.h"
#include "grpcpp/generic/generic_stub.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kBombsPart[] = "bombs";
constexpr char kBombedCall[] = "/rilievo.v1.ReconstructionService/GetCapabilities";
constexpr int64_t kMostBombGrowth = 32'000'000;

// `bytes` zeros in one message; takes little memory here.
grpc::ByteBuffer Zeros(int64_t bytes) {
  const grpc::Slice block(std::string(1 << 20, '\0'));
  return grpc::ByteBuffer(
      std::vector<grpc::Slice>(static_cast<size_t>(bytes / (1 << 20)), block).data(),
      static_cast<size_t>(bytes / (1 << 20)));
}

class Bomber {
 public:
  Bomber(StressServer* server, Report* report) : server_(server), report_(report) {}

  // `attack` gives the status that it was answered with.
  template <typename Attack>
  void Throw(const std::string& name, absl::StatusCode refusal, const Attack& attack) {
    const int64_t before = server_->ResidentBytes();
    server_->ForgetPeak();
    const auto start = std::chrono::steady_clock::now();
    const absl::Status status = attack();
    const double taken = SecondsSince(start);
    const int64_t growth = server_->PeakBytes() - before;
    const bool serves = ReconstructionClient(OwnConnection(server_->address()))
                            .GetCapabilities(Within(seconds(10)))
                            .ok();
    report_->Expect(kBombsPart, name + ": refused, server grows < 32 MB, serves on",
                    status.code() == refusal && growth < kMostBombGrowth && serves,
                    absl::StrFormat("%s in %.2f s, %+.1f MB%s",
                                    status.ok() ? "OK" : absl::StatusCodeToString(status.code()),
                                    taken, Megabytes(growth), serves ? "" : ", SERVES NO LONGER"));
  }

 private:
  StressServer* server_;
  Report* report_;
};

// One message of a unary call, whatever it holds.
absl::Status SendRaw(const std::string& address, const std::string& method,
                     grpc::ByteBuffer message, bool compress) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxSendMessageSize(-1);
  const auto channel = OwnConnection(address, arguments);
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(60));
  if (compress) context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  grpc::ByteBuffer answer;
  grpc::Status status;
  std::mutex mutex;
  std::condition_variable done;
  bool ended = false;
  stub.UnaryCall(&context, method, grpc::StubOptions(), &message, &answer,
                 [&](const grpc::Status& result) {
                   const std::lock_guard lock(mutex);
                   status = result;
                   ended = true;
                   done.notify_one();
                 });
  std::unique_lock lock(mutex);
  done.wait(lock, [&] { return ended; });
  return StatusFromGrpc(status);
}

// The header alone; no point follows.
absl::Status AnnouncePoints(const std::string& address, uint64_t points) {
  const auto stub = v1::ReconstructionService::NewStub(OwnConnection(address));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(10));
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructRequest request;
  request.mutable_header()->set_point_count(points);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  stream->Write(request);
  v1::ReconstructResponse response;
  while (stream->Read(&response)) {
  }
  return StatusFromGrpc(stream->Finish());
}

absl::Status AnnounceUpload(const std::string& address, uint64_t bytes) {
  const auto stub = v1::JobsService::NewStub(OwnConnection(address));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(10));
  v1::UploadScanResponse response;
  const auto stream = stub->UploadScan(&context, &response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id("bomb");
  request.mutable_header()->set_total_bytes(bytes);
  stream->Write(request);
  return StatusFromGrpc(stream->Finish());
}

// Two balls of a millimetre, a hundred metres apart: a grid of cells as small as the points ask for
// would have 10^19 of them.
PointCloud TwoDistantBalls() {
  PointCloud scan = Simulated("sphere", 4'000);
  scan.points *= 1e-3;
  scan.points.rightCols(2'000).colwise() += Eigen::Vector3d(60, 60, 60);
  return scan;
}

void ExplodingGrid(StressServer* server, Report* report) {
  const int64_t before = server->ResidentBytes();
  server->ForgetPeak();
  const auto start = std::chrono::steady_clock::now();
  std::atomic<bool> ended = false;
  std::atomic<int64_t> worker_peak = 0;
  std::jthread watcher([&] {
    while (!ended) {
      for (const pid_t worker : server->process().Workers()) {
        worker_peak = std::max<int64_t>(worker_peak, PeakBytesOf(worker));
      }
      std::this_thread::sleep_for(milliseconds(2));
    }
  });
  v1::ReconstructOptions options;
  options.mutable_control()->set_topology(v1::TOPOLOGY_ARBITRARY);
  const JobsClient jobs = server->Jobs();
  const auto job = jobs.Submit(PackScan(TwoDistantBalls()), options, "grid");
  const auto done = job.ok() ? jobs.Watch(job->job_id(), {}, Within(seconds(120))) : job;
  ended = true;
  watcher.join();
  const int64_t growth = server->PeakBytes() - before;
  const bool finished = done.ok() && (done->state() == v1::JOB_STATE_SUCCEEDED ||
                                      done->state() == v1::JOB_STATE_FAILED);
  const bool clear =
      finished && done->error().code() != static_cast<int>(absl::StatusCode::kInternal);
  report->Expect(
      kBombsPart, "grid that would explode: solved or refused within 256 MB, server grows < 32 MB",
      clear && growth < kMostBombGrowth && worker_peak < 256'000'000,
      absl::StrFormat("%s %s in %.1f s, worker %.0f MB, server %+.1f MB",
                      done.ok() ? v1::JobState_Name(done->state()) : done.status().ToString(),
                      done.ok() ? done->error().message() : "", SecondsSince(start),
                      Megabytes(worker_peak), Megabytes(growth)));
}

// Uploads at full speed, each on a connection of its own, while messages of 2 GB come. gRPC may
// cancel any stream when its memory is full: the client's library has to bring all of them through.
void HurtNobody(const StressServer& server, Report* report) {
  constexpr int kUploaders = 16, kBombs = 4;
  std::mutex mutex;
  int whole = 0;
  std::vector<absl::Status> failures;
  std::vector<std::shared_ptr<grpc::Channel>> lines;
  for (int i = 0; i < kUploaders; ++i) {
    lines.push_back(OwnConnection(server.address()));
    lines.back()->WaitForConnected(std::chrono::system_clock::now() + seconds(10));
  }
  std::atomic<bool> over = false;
  std::vector<std::jthread> threads;
  for (int i = 0; i < kUploaders; ++i) {
    threads.emplace_back([&, i] {
      PackedScan scan;
      scan.bytes = std::string(4'000'000, static_cast<char>(i));
      scan.scan_id = absl::StrFormat("%064x", i);  // wrong, so that nothing is kept
      const JobsClient jobs = server.Jobs(lines[static_cast<size_t>(i)]);
      do {
        const absl::Status status = jobs.Upload(scan);
        const std::lock_guard lock(mutex);
        if (absl::IsDataLoss(status)) {
          ++whole;  // all bytes came, and their sum was told wrong
        } else {
          failures.push_back(status);
        }
      } while (!over);
    });
  }
  for (int i = 0; i < kBombs; ++i) {
    SendRaw(server.address(), kBombedCall, Zeros(2'000'000'000), /*compress=*/false).IgnoreError();
  }
  over = true;
  threads.clear();
  report->Expect(kBombsPart,
                 "16 uploads beside messages of 2 GB: each comes whole, if by a second attempt",
                 failures.empty(),
                 absl::StrFormat("%d came whole, %d failed %s", whole, failures.size(),
                                 failures.empty() ? "" : failures.front().ToString()));
}

}  // namespace

void Bombs(const Scale&, Report* report) {
  StressServer server;
  server.Start();
  const std::string& address = server.address();
  // Warm: what every server holds after its first call.
  AnnouncePoints(address, 1).IgnoreError();
  const KnownScan& scan = KnownScans().front();
  ReconstructionClient(OwnConnection(address)).Reconstruct(scan.cloud, {}).status().IgnoreError();
  Bomber bomber(&server, report);
  bomber.Throw("256 MB of zeros in a gzip message", absl::StatusCode::kUnimplemented,
               [&] { return SendRaw(address, kBombedCall, Zeros(256 << 20), /*compress=*/true); });
  bomber.Throw("header of 4 000 000 000 points", absl::StatusCode::kInvalidArgument,
               [&] { return AnnouncePoints(address, 4'000'000'000); });
  bomber.Throw("header of 2^64 - 1 points", absl::StatusCode::kInvalidArgument,
               [&] { return AnnouncePoints(address, ~uint64_t{0}); });
  bomber.Throw("upload of 2^63 bytes", absl::StatusCode::kInvalidArgument,
               [&] { return AnnounceUpload(address, uint64_t{1} << 63); });
  bomber.Throw("message of 2 GB", absl::StatusCode::kResourceExhausted, [&] {
    return SendRaw(address, kBombedCall, Zeros(2'000'000'000), /*compress=*/false);
  });
  ExplodingGrid(&server, report);
  HurtNobody(server, report);
}

}  // namespace rilievo::stress
