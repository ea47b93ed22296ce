#include <functional>
#include <future>

#include "tests/integration/line.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"
#include "tests/unit/server/os/loopback.h"

namespace rilievo::stress {
namespace {

using std::chrono::seconds;

constexpr char kHalfOpenPart[] = "half-open";
constexpr double kMostSeconds = 20 + 10 + 1;  // keepalive, its timeout, and one more

// A peer with its line frozen in the middle of what `begin` starts.
struct Frozen {
  std::string name;
  std::unique_ptr<Line> line;
  std::shared_ptr<grpc::Channel> channel;
};

// A client behind a line of its own that has shaken hands.
Frozen Connected(const StressServer& server, const std::string& name) {
  Frozen peer{name, std::make_unique<Line>(server.port()), nullptr};
  peer.channel = OwnConnection(peer.line->address());
  ReconstructionClient(peer.channel).GetCapabilities(Within(seconds(10))).status().IgnoreError();
  return peer;
}

}  // namespace

void HalfOpenPeers(const Scale&, Report* report) {
  StressServer server;
  server.Start();
  // Idle; watching a job; in the middle of an upload; before the first byte.
  std::vector<Frozen> peers;
  peers.push_back(Connected(server, "idle"));
  peers.push_back(Connected(server, "uploading"));
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto stub = v1::JobsService::NewStub(peers.back().channel);
  const auto upload = stub->UploadScan(&context, &response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id("half");
  request.mutable_header()->set_total_bytes(1'000'000);
  upload->Write(request);
  request.set_chunk(std::string(100'000, 'x'));
  upload->Write(request);
  const FileDescriptor mute = ConnectTo(server.port());
  WaitFor(seconds(5), [&] { return server.Connections() == 3; });
  const int before = server.Connections();
  for (const Frozen& peer : peers) peer.line->Freeze();
  const auto start = std::chrono::steady_clock::now();
  const bool reaped = WaitFor(seconds(60), [&] { return server.Connections() == 0; });
  const double taken = SecondsSince(start);
  report->Expect(
      kHalfOpenPart, "peers that vanish (idle, uploading, never spoke): let go within 31 s",
      before == 3 && reaped && taken <= kMostSeconds,
      absl::StrFormat("%d of %d left after %.1f s", server.Connections(), before, taken));
  for (const Frozen& peer : peers) peer.line->Cut();
  context.TryCancel();
  upload->Finish();
}

}  // namespace rilievo::stress
