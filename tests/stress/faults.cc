#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "absl/strings/match.h"
#include "client/library/status_conversion.h"
#include "core/base/sanitized.h"
#include "server/os/file_descriptor.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/preload/fault_control.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::seconds;

constexpr char kFaultsPart[] = "faults";
constexpr char kRequest[] = "only";

struct Kind {
  FaultKind kind;
  int error;
  const char* name;
  int most;              // calls that are made to fail, at most
  int fewest = 0;        // in the short form too
  bool lasting = false;  // as are all after it
  bool is_memory() const { return kind == FaultKind::kAllocate; }
};

constexpr int kAll = 1'000'000;
// A server that stays without memory ends, and says so; one that lacks it for a moment may, where
// gRPC ends it. What it acknowledged is there when it is started again. There are too many
// allocations to fail them all.
constexpr Kind kKinds[] = {{FaultKind::kWrite, ENOSPC, "write: disk full", kAll},
                           {FaultKind::kWrite, EIO, "write: I/O error", kAll},
                           {FaultKind::kSync, EIO, "sync: I/O error", kAll},
                           {FaultKind::kRename, EIO, "rename: I/O error", kAll},
                           {FaultKind::kAllocate, ENOMEM, "allocation", 150, 12},
                           {FaultKind::kAllocate, ENOMEM, "allocation and all after it", 50, 4,
                            /*lasting=*/true}};
// What the server says at its end.
constexpr char kLastLine[] = "goes on with all that it acknowledged";
constexpr int kExitOnNoMemory = 1, kExitOnAbort = 128 + SIGABRT;
// gRPC 1.51 writes to what malloc gave it for a slice without a look at it. Of rilievo's own code,
// and of the other libraries, nothing may end so.
constexpr int kExitOnNull = 128 + SIGSEGV;

// The control file, mapped here.
class FaultFile {
 public:
  explicit FaultFile(const std::string& folder) : path_(folder + "/faults") {
    const FileDescriptor file(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    if (!file.valid() || ftruncate(file.number(), sizeof(FaultControl)) != 0) return;
    void* mapped =
        mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, file.number(), 0);
    if (mapped != MAP_FAILED) control_ = static_cast<FaultControl*>(mapped);
  }
  ~FaultFile() {
    if (control_ != nullptr) munmap(control_, sizeof(FaultControl));
  }
  FaultFile(const FaultFile&) = delete;
  FaultFile& operator=(const FaultFile&) = delete;

  bool valid() const { return control_ != nullptr; }
  std::vector<std::string> environment() const {
    return {std::string("LD_PRELOAD=") + RILIEVO_FAILING_CALLS,
            std::string(kFaultVariable) + "=" + path_};
  }
  int64_t calls(FaultKind kind) const { return control_->calls[static_cast<int>(kind)]; }
  void FailAt(const Kind& kind, int64_t n) {
    control_->error = kind.error;
    control_->lasting = kind.lasting;
    control_->library[0] = 0;
    control_->countdown[static_cast<int>(kind.kind)] = n;
  }
  void Disarm() {
    for (auto& countdown : control_->countdown) countdown = 0;
  }
  bool happened() const { return control_->failed > 0; }
  std::string library() const { return control_->library; }

 private:
  const std::string path_;
  FaultControl* control_ = nullptr;
};

// What came of one upload, job and download while a call failed.
struct Attempt {
  bool scan_acknowledged = false;
  std::string job;  // its id when it was acknowledged
  std::vector<absl::Status> refusals;
};

Attempt UploadAndReconstruct(const StressServer& server, const KnownScan& scan) {
  const JobsClient jobs = server.HastyJobs();
  Attempt attempt;
  const auto note = [&](const absl::Status& status) {
    if (!status.ok()) attempt.refusals.push_back(status);
    return status.ok();
  };
  attempt.scan_acknowledged = note(jobs.Upload(scan.packed, {}, Within(seconds(20))));
  if (!attempt.scan_acknowledged) return attempt;
  v1::CreateJobRequest request;
  request.set_request_id(kRequest);
  request.set_scan_id(scan.packed.scan_id);
  request.mutable_header()->set_coordinate_format(scan.packed.header.coordinate_format());
  request.mutable_header()->set_point_count(scan.packed.header.point_count());
  request.mutable_header()->mutable_options();  // the same request as Submit() makes
  const auto job = jobs.Create(request, Within(seconds(20)));
  if (!note(job.status())) return attempt;
  attempt.job = job->job_id();
  if (!note(jobs.Watch(attempt.job, {}, Within(seconds(20))).status())) return attempt;
  note(jobs.Fetch(attempt.job, {}, Within(seconds(20))).status());
  return attempt;
}

// The right bytes of the acknowledged job, or of a new one; empty when all is well.
std::string WrongAfter(const StressServer& server, const KnownScan& scan, const Attempt& attempt) {
  const JobsClient jobs = server.Jobs(OwnConnection(server.address()));
  std::string id = attempt.job;
  if (id.empty()) {
    const auto job = jobs.Submit(scan.packed, {}, kRequest, {}, Within(seconds(20)));
    if (!job.ok()) return "a new job is refused: " + job.status().ToString();
    id = job->job_id();
  }
  const auto done = jobs.Watch(id, {}, Within(seconds(20)));
  if (!done.ok()) return "the job is lost: " + done.status().ToString();
  if (done->state() != v1::JOB_STATE_SUCCEEDED) return "the job failed: " + done->error().message();
  const auto surface = jobs.Fetch(id, {}, Within(seconds(20)));
  if (!surface.ok()) return "the surface is lost: " + surface.status().ToString();
  return *surface == scan.surface ? "" : "the surface has other bytes";
}

// Why the server should not have ended like that; empty when it should.
std::string WrongEnd(const Kind& kind, int exit, const FaultFile& faults, StressServer& server) {
  const bool of_grpc = absl::StrContains(faults.library(), "libgrpc");
  if (kind.is_memory() && exit == kExitOnNull && of_grpc) return "";
  if (!kind.is_memory() || (exit != kExitOnNoMemory && exit != kExitOnAbort)) {
    return absl::StrFormat("the server ended with %d, asked for memory by %s", exit,
                           faults.library());
  }
  return server.process().WaitForLine(kLastLine, seconds(5)) ? "" : "the server ended in silence";
}

class FaultyRuns {
 public:
  // Counts the calls of an undisturbed run.
  bool Count() {
    StressServer server;
    FaultFile faults(server.folder());
    if (!faults.valid()) return false;
    server.Start({}, faults.environment());
    for (const Kind& kind : kKinds) started_[kind.kind] = faults.calls(kind.kind);
    const Attempt attempt = UploadAndReconstruct(server, scan_);
    for (const Kind& kind : kKinds) {
      calls_[kind.kind] = faults.calls(kind.kind) - started_[kind.kind];
    }
    return attempt.refusals.empty() && calls_[FaultKind::kWrite] > 0;
  }

  int64_t calls(FaultKind kind) const { return calls_.at(kind); }

  // One run whose n-th call fails.
  void Run(const Kind& kind, int64_t n) {
    StressServer server;
    FaultFile faults(server.folder());
    server.Start({}, faults.environment());
    faults.FailAt(kind, n);
    const Attempt attempt = UploadAndReconstruct(server, scan_);
    faults.Disarm();
    happened_ += faults.happened();
    const bool silent =
        std::any_of(attempt.refusals.begin(), attempt.refusals.end(),
                    [](const absl::Status& refusal) { return ErrorReason(refusal).empty(); });
    const std::string after = silent ? "" : WrongAfter(server, scan_, attempt);
    // A server that ends for want of memory takes a moment to be gone.
    const auto exit = server.process().WaitForExit(seconds(silent || !after.empty() ? 5 : 0));
    const bool ended = exit.has_value();
    ended_ += ended;
    for (const absl::Status& refusal : attempt.refusals) {
      ++refusals_;
      if (ErrorReason(refusal).empty() && !(ended && absl::IsUnavailable(refusal))) {
        Wrong(kind, n, "a refusal without a reason: " + refusal.ToString());
      }
    }
    if (ended) Wrong(kind, n, WrongEnd(kind, *exit, faults, server));
    if (!ended && kind.lasting && !attempt.refusals.empty()) {
      Wrong(kind, n, "the server stays without memory");
    }
    if (!ended) Wrong(kind, n, silent ? WrongAfter(server, scan_, attempt) : after);
    server.Kill();
    server.Start();
    const std::string again = WrongAfter(server, scan_, attempt);
    Wrong(kind, n, again.empty() ? "" : "started again: " + again);
  }

  int wrong() const { return wrong_; }
  std::string Seen(int64_t runs) const {
    return absl::StrFormat("%d of %d calls failed, %d refusals, the server ended %d times%s%s",
                           happened_, runs, refusals_, ended_, wrong_ > 0 ? "; WRONG: " : "",
                           first_wrong_);
  }

 private:
  void Wrong(const Kind& kind, int64_t n, const std::string& what) {
    if (what.empty()) return;
    ++wrong_;
    if (first_wrong_.empty()) first_wrong_ = what;
    std::fprintf(stderr, "%s, call %d: %s\n", kind.name, static_cast<int>(n), what.c_str());
  }

  const KnownScan& scan_ = KnownScans().front();
  std::map<FaultKind, int64_t> started_, calls_;
  int happened_ = 0, refusals_ = 0, ended_ = 0, wrong_ = 0;
  std::string first_wrong_;
};

}  // namespace

void Faults(const Scale& scale, Report* report) {
  const std::string asked = "the n-th call fails: nothing acknowledged is lost, refusals say why";
  if (kSanitized) {
    report->NotLookedAt(kFaultsPart, asked, "a sanitizer has allocators and calls of its own");
    return;
  }
  FaultyRuns counting;
  if (!counting.Count()) {
    report->Expect(kFaultsPart, asked, false, "the undisturbed run failed");
    return;
  }
  for (const Kind& kind : kKinds) {
    FaultyRuns runs;
    const int64_t all = counting.calls(kind.kind);
    const int64_t count = std::min<int64_t>({all, kind.most, std::max(scale.faults, kind.fewest)});
    for (int64_t i = 0; i < count; ++i) runs.Run(kind, 1 + i * all / count);
    report->Expect(kFaultsPart, absl::StrFormat("%s: %s", kind.name, asked), runs.wrong() == 0,
                   absl::StrFormat("%d calls: ", all) + runs.Seen(count));
  }
}

}  // namespace rilievo::stress
