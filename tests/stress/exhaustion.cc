#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <filesystem>
#include <thread>

#include "client/library/status_conversion.h"
#include "core/base/sanitized.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kExhaustionPart[] = "exhaustion";

std::string Words(const absl::Status& status) {
  return absl::StrFormat("%s %s", absl::StatusCodeToString(status.code()), ErrorReason(status));
}

// Whether the server takes a new job to its right end.
bool Works(const StressServer& server, const std::string& request_id) {
  const KnownScan& scan = KnownScans().front();
  const JobsClient jobs = server.Jobs(OwnConnection(server.address()));
  const CallOptions patience = Within(seconds(60));
  const auto job = jobs.Submit(scan.packed, {}, request_id, {}, patience);
  if (!job.ok() || !jobs.Watch(job->job_id(), {}, patience).ok()) return false;
  const auto surface = jobs.Fetch(job->job_id(), {}, patience);
  return surface.ok() && *surface == scan.surface;
}

void FullDisk(Report* report) {
  const std::string asked = "full disk: uploads refused with STORE_FULL, works again with room";
  StressServer server;
  const std::string folder = server.folder() + "/store";
  std::filesystem::create_directory(folder);
  if (mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=1m") != 0) {
    report->NotLookedAt(kExhaustionPart, asked, "this process may not mount a small disk");
    return;
  }
  server.Start();
  const PackedScan large = PackScan(Simulated("sphere", 200'000));
  const absl::Status full = server.HastyJobs().Upload(large);
  const bool serves = ReconstructionClient(OwnConnection(server.address())).GetCapabilities().ok();
  std::filesystem::remove_all(folder + "/uploads/" + large.scan_id);
  const bool works = Works(server, "after");
  report->Expect(
      kExhaustionPart, asked,
      absl::IsResourceExhausted(full) && ErrorReason(full) == "STORE_FULL" && serves && works,
      Words(full) + (works ? ", then a job succeeds" : ", then NO JOB SUCCEEDS"));
  server.process().Signal(SIGKILL);
  server.process().WaitForExit(seconds(10));
  umount2(folder.c_str(), MNT_DETACH);
}

// Connections until there is no handle left, then none.
void NoFiles(Report* report) {
  StressServer server;
  server.Start();
  const bool before = Works(server, "before");
  // A job that is acknowledged before must end all the same.
  const KnownScan& scan = KnownScans().back();
  const rlimit few{static_cast<rlim_t>(server.OpenFiles() + 30), 1024};
  if (prlimit(server.process().pid(), RLIMIT_NOFILE, &few, nullptr) != 0) {
    report->NotLookedAt(kExhaustionPart, "no file handles left",
                        "limits of the server cannot be changed");
    return;
  }
  const auto line = OwnConnection(server.address());
  const auto acknowledged = server.Jobs(line).Submit(scan.packed, {}, "acknowledged");
  std::vector<std::shared_ptr<grpc::Channel>> crowd;
  int served = 0;
  absl::Status refused;
  for (int i = 0; i < 100; ++i) {
    crowd.push_back(OwnConnection(server.address()));
    const absl::Status status = ReconstructionClient(crowd.back())
                                    .GetCapabilities(Within(milliseconds(i < 40 ? 1000 : 50)))
                                    .status();
    served += status.ok();
    if (!status.ok()) refused = status;
  }
  const auto done = acknowledged.ok()
                        ? server.Jobs(line).Watch(acknowledged->job_id(), {}, Within(seconds(60)))
                        : acknowledged;
  crowd.clear();
  const bool works = Works(server, "after");
  report->Expect(
      kExhaustionPart,
      "no file handles left: who comes then is refused, an acknowledged job ends, works again",
      before && !refused.ok() && done.ok() && done->state() == v1::JOB_STATE_SUCCEEDED && works,
      absl::StrFormat("%d of 100 served, then %s; the job %s; afterwards %s", served,
                      absl::StatusCodeToString(refused.code()),
                      done.ok() ? v1::JobState_Name(done->state()) + " " + done->error().message()
                                : done.status().ToString(),
                      works ? "a job succeeds" : "NO JOB SUCCEEDS"));
}

void NoMemory(Report* report) {
  const std::string asked =
      "worker out of memory: RESOURCE_EXHAUSTED, kept and in one call, works again";
  if (kSanitized) {
    report->NotLookedAt(kExhaustionPart, asked, "a sanitizer maps memory of its own");
    return;
  }
  StressServer server;
  server.Start({"--max-job-memory", "40000000", "--threads", "1"});
  const auto large = Simulated("torus", 300'000);
  const JobsClient jobs = server.Jobs();
  const auto job = jobs.Submit(PackScan(large), {}, "large");
  const auto done = job.ok() ? jobs.Watch(job->job_id(), {}, Within(seconds(60))) : job;
  const absl::Status once =
      ReconstructionClient(OwnConnection(server.address())).Reconstruct(large, {}).status();
  const bool works = Works(server, "after");
  report->Expect(
      kExhaustionPart, asked,
      done.ok() && done->error().code() == static_cast<int>(absl::StatusCode::kResourceExhausted) &&
          absl::IsResourceExhausted(once) && works,
      absl::StrFormat("kept: %s; at once: %s; afterwards %s",
                      done.ok() ? done->error().message() : done.status().ToString(), Words(once),
                      works ? "a job succeeds" : "NO JOB SUCCEEDS"));
}

}  // namespace

void Exhaustion(const Scale&, Report* report) {
  FullDisk(report);
  NoFiles(report);
  NoMemory(report);
}

}  // namespace rilievo::stress
