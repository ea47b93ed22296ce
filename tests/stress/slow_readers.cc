#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kReadersPart[] = "readers";
constexpr int kReaders = 50;
constexpr double kChunkBytes = 128 << 10;  // of a piece of a surface
constexpr uint64_t kLeastSurface = 800'000;

// A surface of a megabyte from 30 000 points: many levels, written very exactly.
absl::StatusOr<v1::Job> LargeSurface(const JobsClient& jobs) {
  v1::ReconstructOptions options;
  options.set_max_level(6);
  options.mutable_encode()->set_height_step_ratio(1e-9);
  options.set_measure(false);
  auto job = jobs.Submit(PackScan(Simulated("star", 30'000, 0.0005)), options, "large");
  if (!job.ok()) return job;
  return jobs.Watch(job->job_id(), {}, Within(seconds(120)));
}

}  // namespace

void SlowReaders(const Scale&, Report* report) {
  const std::string asked =
      "50 readers that stop reading: at most 3 chunks of 128 KiB held for each";
  StressServer server;
  server.Start({"--max-idle-seconds", "4"});
  // Their own buffers stay small: what piles up, piles up at the server.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  std::vector<std::shared_ptr<grpc::Channel>> lines;
  for (int i = 0; i < kReaders; ++i) {
    lines.push_back(OwnConnection(server.address(), arguments));
    ReconstructionClient(lines.back()).GetCapabilities(Within(seconds(10))).status().IgnoreError();
  }
  // All that it takes from here on counts, the making and keeping of the surface too.
  const int64_t before = server.ResidentBytes();
  const auto job = LargeSurface(server.Jobs());
  if (!job.ok() || job->surface().total_bytes() < kLeastSurface) {
    report->Expect(
        kReadersPart, asked, false,
        job.ok() ? absl::StrFormat("the surface has only %d bytes", job->surface().total_bytes())
                 : job.status().ToString());
    return;
  }
  server.ForgetPeak();
  v1::StreamSurfaceRequest request;
  request.set_job_id(job->job_id());
  std::vector<std::unique_ptr<v1::JobsService::Stub>> stubs;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::StreamSurfaceResponse>>> readers;
  for (int i = 0; i < kReaders; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    stubs.push_back(v1::JobsService::NewStub(lines[static_cast<size_t>(i)]));
    readers.push_back(stubs.back()->StreamSurface(contexts.back().get(), request));
  }
  std::this_thread::sleep_for(milliseconds(1500));
  const double chunks = static_cast<double>(server.PeakBytes() - before) / kReaders / kChunkBytes;
  const bool others = server.Jobs(OwnConnection(server.address())).Fetch(job->job_id()).ok();
  report->Expect(
      kReadersPart, asked, others && chunks <= 3,
      absl::StrFormat("%.2f chunks each at the peak, of a surface of %.1f MB; others are "
                      "%sserved meanwhile",
                      chunks, Megabytes(static_cast<int64_t>(job->surface().total_bytes())),
                      others ? "" : "NOT "));
  // Past --max-idle-seconds.
  std::this_thread::sleep_for(seconds(5));
  int sent_away = 0;
  for (auto& reader : readers) {
    v1::StreamSurfaceResponse response;
    while (reader->Read(&response)) {
    }
    sent_away += !reader->Finish().ok();
  }
  report->Expect(kReadersPart, "and they are sent away after --max-idle-seconds",
                 sent_away == kReaders, absl::StrFormat("%d of %d", sent_away, kReaders));
}

}  // namespace rilievo::stress
