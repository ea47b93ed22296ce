// HTTP/2 as no client speaks it, from a stranger: to the server itself, and to the front before it.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "tests/integration/daemon/raw_http2.h"
#include "tests/stress/front.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using http2::Bytes;
using http2::RawConnection;
using http2::Type;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr char kHttp2Part[] = "http2";
constexpr char kUnary[] = "/rilievo.v1.ReconstructionService/GetCapabilities";
constexpr char kStream[] = "/rilievo.v1.ReconstructionService/Reconstruct";
constexpr int64_t kMostGrowth = 64'000'000;
constexpr double kMostAnswerSeconds = 0.2;
constexpr uint32_t kManyStreams = 20'000;
constexpr size_t kHugeHeader = 64 << 20;

// What another client, on a connection of its own, sees of the server meanwhile.
class Neighbor {
 public:
  explicit Neighbor(const std::string& address)
      : client_(OwnConnection(address)),
        thread_([this](const std::stop_token& stop) { Run(stop); }) {}

  // The 99th percentile of the answers' seconds; a call that failed took for ever.
  double End() {
    thread_.request_stop();
    thread_.join();
    std::sort(seconds_.begin(), seconds_.end());
    return seconds_.empty() ? 1e9 : seconds_[(seconds_.size() * 99 - 1) / 100];
  }

 private:
  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto start = steady_clock::now();
      const bool answered = client_.GetCapabilities(Within(seconds(10))).ok();
      seconds_.push_back(answered ? SecondsSince(start) : 1e9);
      std::this_thread::sleep_for(milliseconds(20));
    }
  }

  ReconstructionClient client_;
  std::vector<double> seconds_;
  std::jthread thread_;
};

// Frames until the time is over or the connection is closed; how many streams were begun.
uint32_t Flood(RawConnection* connection, steady_clock::time_point end, uint32_t most_streams,
               const std::function<std::string(uint32_t stream)>& frames) {
  uint32_t streams = 0;
  while (streams < most_streams && steady_clock::now() < end) {
    std::string batch;
    for (int i = 0; i < 100; ++i) batch += frames(2 * streams++ + 1);
    if (!connection->Send(batch)) break;
  }
  return streams;
}

// Calls whose messages never come, more than the server allows, from a client that never says that
// it has read the server's limit.
std::string ManyStreams(int port, seconds time) {
  RawConnection connection(port);
  const std::string headers = http2::CallHeaders(kUnary);
  const uint32_t streams =
      Flood(&connection, steady_clock::now() + time, kManyStreams, [&](uint32_t stream) {
        return Bytes({Type::kHeaders, http2::kEndHeaders, stream, headers});
      });
  connection.Receive(seconds(1));
  return absl::StrFormat("%u of %u sent", streams, kManyStreams);
}

std::string Resets(int port, seconds time, bool acknowledge) {
  RawConnection connection(port);
  if (acknowledge) connection.Acknowledge();
  const std::string headers = http2::CallHeaders(kUnary);
  const uint32_t streams =
      Flood(&connection, steady_clock::now() + time, ~uint32_t{0} / 2,
            [&](uint32_t stream) { return http2::OpenAndReset(stream, headers); });
  return absl::StrFormat("%u sent", streams);
}

std::string HugeHeader(int port) {
  RawConnection connection(port);
  const std::string piece = Bytes({Type::kContinuation, 0, 1, std::string(4096, 'a')});
  connection.Send(Bytes({Type::kHeaders, 0, 1,
                         http2::CallHeaders(kUnary) + std::string(1, '\0') + http2::Integer(5, 7) +
                             "x-big" + http2::Integer(kHugeHeader, 7)}));
  const auto start = steady_clock::now();
  size_t sent = 0;
  while (sent < kHugeHeader && connection.Send(piece)) sent += piece.size();
  return absl::StrFormat("%s after %.1f MB and %.2f s",
                         sent < kHugeHeader ? "closed" : "read and dropped",
                         Megabytes(static_cast<int64_t>(sent)), SecondsSince(start));
}

// Whether a call on the same connection lives on after one with `headers`.
bool NeighborSurvives(int port, const std::string& headers) {
  RawConnection connection(port);
  connection.Acknowledge();
  connection.Send(Bytes({Type::kHeaders, http2::kEndHeaders, 1, http2::CallHeaders(kStream)}));
  connection.Receive(milliseconds(200));
  connection.Send(Bytes({Type::kHeaders, http2::kEndHeaders | http2::kEndStream, 3, headers}));
  bool ended = false;
  for (const http2::Frame& frame : connection.Receive(milliseconds(700))) {
    ended =
        ended || frame.type == Type::kGoAway || (frame.type == Type::kReset && frame.stream == 1);
  }
  return !ended && !connection.closed();
}

class Attacker {
 public:
  Attacker(StressServer* server, const std::string& where, int port, Report* report)
      : server_(server), where_(where), port_(port), report_(report) {}

  void Attack(const std::string& name, const std::function<std::string(int port)>& attack) {
    const int64_t before = server_->ResidentBytes();
    server_->ForgetPeak();
    Neighbor neighbor(absl::StrFormat("127.0.0.1:%d", port_));
    std::this_thread::sleep_for(milliseconds(200));
    const std::string seen = attack(port_);
    std::this_thread::sleep_for(seconds(1));
    const double slow = neighbor.End();
    const int64_t growth = server_->PeakBytes() - before;
    report_->Expect(
        kHttp2Part,
        absl::StrFormat(
            "%s, %s: the server grows by less than 64 MB, another client's p99 < 200 ms", name,
            where_),
        growth < kMostGrowth && slow < kMostAnswerSeconds,
        absl::StrFormat("%s; %.1f MB, %.0f ms", seen, Megabytes(growth), 1e3 * slow));
  }

 private:
  StressServer* const server_;
  const std::string where_;
  const int port_;
  Report* const report_;
};

void AllAttacks(StressServer* server, const std::string& where, int port, const Scale& scale,
                Report* report) {
  Attacker attacker(server, where, port, report);
  attacker.Attack("20 000 streams without SETTINGS ACK",
                  [&](int to) { return ManyStreams(to, scale.flood_time); });
  attacker.Attack("streams that are reset, without SETTINGS ACK",
                  [&](int to) { return Resets(to, scale.flood_time, /*acknowledge=*/false); });
  attacker.Attack("streams that are reset, with SETTINGS ACK",
                  [&](int to) { return Resets(to, scale.flood_time, /*acknowledge=*/true); });
  attacker.Attack("a header of 64 MB in CONTINUATIONs", HugeHeader);
}

// What people use a server for, with a byte-exact result.
void RealWork(const Front& front, Report* report) {
  const KnownScan& scan = KnownScans().front();
  const auto called =
      ReconstructionClient(OwnConnection(front.address())).Reconstruct(scan.cloud, {});
  const JobsClient jobs(OwnConnection(front.address()), {.attempts = 1});
  const auto job = jobs.Submit(scan.packed, {}, "through-the-front");
  const auto done = job.ok() ? jobs.Watch(job->job_id()) : job;
  const auto fetched = done.ok() ? jobs.Fetch(done->job_id()) : done.status();
  const auto status = !called.ok() ? called.status() : fetched.status();
  const bool right = status.ok() && called->dss == scan.surface && *fetched == scan.surface;
  report->Expect(kHttp2Part,
                 "through the front: Reconstruct, upload, watch and download give the bytes", right,
                 right ? "the same" : std::string(status.message()));
}

void BadHeaders(const std::string& where, int port, bool expected, Report* report) {
  const std::pair<const char*, std::string> headers[] = {
      {"a -bin header that is not base64", http2::Header("x-bin", "!!!!")},
      {"9 KB of headers", http2::Header("x-long", std::string(9000, 'a'))}};
  for (const auto& [name, header] : headers) {
    const std::string asked =
        absl::StrFormat("%s, %s: another call on the same connection goes on", name, where);
    const bool survives = NeighborSurvives(port, http2::CallHeaders(kUnary) + header);
    if (expected || survives) {
      report->Expect(kHttp2Part, asked, survives, survives ? "it does" : "it was ended");
    } else {
      report->NotLookedAt(kHttp2Part, asked, "gRPC 1.51 closes the connection; the front keeps it");
    }
  }
}

}  // namespace

void HostileHttp2(const Scale& scale, Report* report) {
  StressServer server;
  server.Start();
  ReconstructionClient(OwnConnection(server.address()))
      .Reconstruct(KnownScans().front().cloud, {})
      .status()
      .IgnoreError();  // warm
  AllAttacks(&server, "direct", server.port(), scale, report);
  BadHeaders("direct", server.port(), /*expected=*/false, report);
  const Front front(server.port());
  if (!front.missing().empty()) {
    report->NotLookedAt(kHttp2Part, "the same through the front", front.missing());
    return;
  }
  RealWork(front, report);
  AllAttacks(&server, "through the front", front.port(), scale, report);
  BadHeaders("through the front", front.port(), /*expected=*/true, report);
}

}  // namespace rilievo::stress
