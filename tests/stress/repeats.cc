#include <random>
#include <set>

#include "client/library/status_conversion.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::seconds;

// Sends a scan from what is stored up to byte `cut`, then cancels, or closes without an end.
// Whether it was refused to be taken for whole.
bool UploadUpTo(const StressServer& server, const PackedScan& scan, uint64_t offset, size_t cut,
                bool cancel) {
  const auto stub = v1::JobsService::NewStub(OwnConnection(server.address()));
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto stream = stub->UploadScan(&context, &response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id(scan.scan_id);
  request.mutable_header()->set_offset(offset);
  request.mutable_header()->set_total_bytes(scan.bytes.size());
  stream->Write(request);
  for (size_t at = offset; at < cut;) {
    const size_t size = std::min<size_t>(7'001, cut - at);
    request.set_chunk(scan.bytes.substr(at, size));
    if (!stream->Write(request)) break;
    at += size;
  }
  if (cancel) {
    context.TryCancel();
  } else {
    stream->WritesDone();
  }
  return !stream->Finish().ok();
}

uint64_t StoredBytes(const StressServer& server, const PackedScan& scan) {
  const auto stub = v1::JobsService::NewStub(OwnConnection(server.address()));
  grpc::ClientContext context;
  v1::GetUploadRequest query;
  query.set_upload_id(scan.scan_id);
  v1::GetUploadResponse stored;
  stub->GetUpload(&context, query, &stored);
  return stored.stored_bytes();
}

void CutUploads(const Scale& scale, StressServer* server, Report* report) {
  std::mt19937 random(3);
  const PointCloud cloud = Simulated("star", 100'000);
  const PackedScan scan = PackScan(cloud);
  bool never_whole = true;
  uint64_t resumed_from_most = 0;
  for (int i = 0; i < scale.cuts; ++i) {
    const size_t cut = random() % scan.bytes.size();
    const uint64_t stored = StoredBytes(*server, scan);
    resumed_from_most = std::max(resumed_from_most, stored);
    if (cut <= stored) continue;  // sends nothing; a later one goes on
    never_whole &= UploadUpTo(*server, scan, stored, cut, i % 2 == 0);
  }
  // Each cut also from 0, of a scan of its own.
  int whole = 0;
  for (int i = 0; i < scale.cuts; ++i) {
    PackedScan one = PackScan(Simulated("sphere", 3'000, 0, static_cast<uint64_t>(100 + i)));
    const size_t cut = random() % one.bytes.size();
    never_whole &= UploadUpTo(*server, one, 0, cut, i % 2 == 0);
    int64_t first = -1;
    const auto sent = [&](int64_t bytes) { first = first < 0 ? bytes : first; };
    // The server answers OK only when its own SHA-256 is that of the client.
    whole += server->Jobs().Upload(one, sent).ok();
  }
  const absl::Status large = server->Jobs().Upload(scan);
  report->Expect(
      "repeats",
      absl::StrFormat("%d uploads cut at random bytes: resumed, checksum right", scale.cuts),
      never_whole && whole == scale.cuts && large.ok() && resumed_from_most > 0,
      absl::StrFormat("%d of %d whole; one cut %d times went on from byte %d of %d: %s%s", whole,
                      scale.cuts, scale.cuts, resumed_from_most, scan.bytes.size(),
                      large.ok() ? "whole" : large.ToString(),
                      never_whole ? "" : "; A CUT ONE WAS TAKEN FOR WHOLE"));
}

void SixteenAtOnce(StressServer* server, Report* report) {
  std::mutex mutex;
  std::set<std::string> ids;
  int refused = 0;
  const KnownScan& scan = KnownScans()[1];
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < 16; ++i) {
      clients.emplace_back([&] {
        const auto job =
            server->Jobs(OwnConnection(server->address())).Submit(scan.packed, {}, "the-same");
        const std::lock_guard lock(mutex);
        if (job.ok()) {
          ids.insert(job->job_id());
        } else {
          ++refused;
        }
      });
    }
  }
  const auto listed = server->Jobs().List(1000);
  if (ids.empty()) ids.insert("none");
  const auto done = server->Jobs().Watch(*ids.begin(), {}, Within(seconds(60)));
  const auto surface = server->Jobs().Fetch(*ids.begin());
  const size_t jobs = listed.ok() ? listed->size() : 0;
  report->Expect("repeats", "one request_id 16 times at once: one job",
                 ids.size() == 1 && refused == 0 && jobs == 1 && done.ok() &&
                     done->attempts() == 1 && surface.ok() && *surface == scan.surface,
                 absl::StrFormat("%d job ids, %d jobs listed, %d attempts, %d refused", ids.size(),
                                 jobs, done.ok() ? done->attempts() : 0, refused));
}

}  // namespace

void Repeats(const Scale& scale, Report* report) {
  StressServer server;
  server.Start();
  SixteenAtOnce(&server, report);
  CutUploads(scale, &server, report);
}

}  // namespace rilievo::stress
