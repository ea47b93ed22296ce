// Options at the ends of their ranges and beyond, over odd clouds and meshes: whatever is asked,
// the server answers as its documentation says, and a worker takes no more memory than was reserved
// for it.
#include <atomic>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "absl/strings/str_format.h"
#include "client/library/status_conversion.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "tests/stress/odd_requests.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::seconds;

constexpr char kOptionsPart[] = "options";
constexpr int64_t kMostMemory = 3'000'000'000;  // of one worker
constexpr double kMostOverEstimate = 1.25;

// Carried by the call, and told by the log.
std::string TraceOf(uint64_t number) { return absl::StrFormat("%032x", number + 1); }

absl::Status Send(const OddRequest& odd, uint64_t number, v1::ReconstructionService::Stub* stub) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(60));
  context.AddMetadata("traceparent", "00-" + TraceOf(number) + "-00000000000000ab-01");
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructRequest request;
  *request.mutable_header() = odd.header;
  bool writes = stream->Write(request);
  constexpr size_t kChunkBytes = 24 << 12;  // whole points or triangles
  for (size_t at = 0; writes && at < odd.points.size(); at += kChunkBytes) {
    request.mutable_points()->set_data(odd.points.substr(at, kChunkBytes));
    writes = stream->Write(request);
  }
  for (size_t at = 0; writes && at < odd.triangles.size(); at += kChunkBytes) {
    request.mutable_triangles()->set_data(odd.triangles.substr(at, kChunkBytes));
    writes = stream->Write(request);
  }
  stream->WritesDone();
  v1::ReconstructResponse response;
  while (stream->Read(&response)) {
  }
  return StatusFromGrpc(stream->Finish());
}

// What the server's log says of all jobs.
struct Judgement {
  std::map<std::string, int> statuses;
  std::string broken, hungry;  // the first cases that should not be
  int workers = 0;
  double most_over_estimate = 0;
  int64_t largest = 0;

  void Take(const nlohmann::json& line) {
    const std::string status = line["status"];
    ++statuses[status];
    const uint64_t number = std::stoull(line.value("trace_id", "1"), nullptr, 16) - 1;
    const std::string detail = line.value("detail", "");
    if (status == "INTERNAL" || status == "UNKNOWN" || status == "UNAVAILABLE" ||
        status == "ABORTED" || status == "DATA_LOSS") {
      absl::StrAppendFormat(&broken, " case %d: %s", number, detail);
    }
    int64_t peak = line.value("peak_bytes", int64_t{0});
    if (detail.find("MB of memory it may have") != std::string::npos) peak = kMostMemory;
    const int64_t estimated = line.value("estimated_bytes", int64_t{0});
    if (peak == 0 || estimated == 0) return;
    const double share = static_cast<double>(peak) / static_cast<double>(estimated);
    most_over_estimate = std::max(most_over_estimate, share);
    largest = std::max(largest, peak);
    ++workers;
    if (share > kMostOverEstimate) {
      absl::StrAppendFormat(&hungry, " case %d: %.0f of %.0f MB", number, Megabytes(peak),
                            Megabytes(estimated));
    }
  }
};

Judgement JudgeLog(const std::vector<std::string>& log) {
  Judgement judgement;
  for (const std::string& text : log) {
    const auto line = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (line.is_object() && line.value("event", "") == "job") judgement.Take(line);
  }
  return judgement;
}

}  // namespace

void OddOptions(const Scale& scale, Report* report) {
  StressServer server;
  server.Start({"--threads", "1", "--max-concurrent-jobs", std::to_string(scale.odd_clients),
                "--max-job-seconds", "20", "--max-job-memory", std::to_string(kMostMemory)});
  std::atomic<uint64_t> next = scale.first_case;
  std::atomic<int> unanswered = 0;
  const auto end = std::chrono::steady_clock::now() + scale.options_time;
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < scale.odd_clients; ++i) {
      clients.emplace_back([&] {
        const auto stub = v1::ReconstructionService::NewStub(OwnConnection(server.address()));
        do {
          const uint64_t number = next++;
          const absl::Status status = Send(DrawOddRequest(scale.seed, number), number, stub.get());
          if (absl::IsUnavailable(status)) ++unanswered;
        } while (std::chrono::steady_clock::now() < end);
      });
    }
  }
  const uint64_t cases = next - scale.first_case;
  const bool ends = server.EndsWithin(seconds(30));
  const Judgement judgement = JudgeLog(server.process().Log());
  std::string statuses;
  for (const auto& [status, count] : judgement.statuses) {
    absl::StrAppendFormat(&statuses, "%s%s %d", statuses.empty() ? "" : ", ", status, count);
  }
  report->Expect(kOptionsPart, absl::StrFormat("seed %d: no defect, the server stays", scale.seed),
                 judgement.broken.empty() && unanswered == 0 && ends && cases > 0,
                 absl::StrFormat("%d cases: %s%s", cases, statuses, judgement.broken));
  report->Expect(kOptionsPart, "a worker takes at most 1.25 times its estimate",
                 judgement.workers > 0 && judgement.hungry.empty(),
                 absl::StrFormat("%d workers, at most %.2f times, %.0f MB%s", judgement.workers,
                                 judgement.most_over_estimate, Megabytes(judgement.largest),
                                 judgement.hungry));
}

}  // namespace rilievo::stress
