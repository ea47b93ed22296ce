// A worker whose job ends as its seed says.
#include "tests/unit/server/worker/moody_worker.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <stdexcept>
#include <thread>

#include "absl/strings/str_cat.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"

namespace rilievo {
namespace {

// Keeps what it allocates, so that nothing is optimised away.
std::vector<std::vector<char>>& Hoard() {
  static auto* const hoard = new std::vector<std::vector<char>>;
  return *hoard;
}

void Allocate(int64_t bytes) {
  for (int64_t done = 0; done < bytes; done += 1 << 20) Hoard().emplace_back(1 << 20, 'x');
}

std::string LimitsOfThisProcess() {
  std::string text;
  for (const auto resource : {RLIMIT_NOFILE, RLIMIT_FSIZE, RLIMIT_CORE, RLIMIT_CPU}) {
    rlimit limit{};
    getrlimit(resource, &limit);
    absl::StrAppend(&text, limit.rlim_cur, " ");
  }
  sigset_t blocked;
  sigprocmask(SIG_BLOCK, nullptr, &blocked);
  int open_files = 0;
  for (int file = 0; file < 1024; ++file) open_files += fcntl(file, F_GETFD) >= 0;
  return absl::StrCat(text, "term=", sigismember(&blocked, SIGTERM), " open=", open_files,
                      " own_group=", getpgrp() == getpid());
}

JobResult Answer(const PointCloud& scan) {
  JobResult result;
  result.report.set_points_in(scan.points.cols());
  result.report.set_road_reason(LimitsOfThisProcess());
  result.encoded.chunks = {std::vector<uint8_t>(10, 1), {}, std::vector<uint8_t>(3'000'000, 2), {}};
  return result;
}

absl::StatusOr<JobResult> Work(const JobRequest& job, ScanBytes points, const RunContext& context) {
  context.Report(Stage::kNormals, 0.5);
  switch (static_cast<Mood>(job.seed)) {
    case Mood::kWell:
      return Answer(*std::move(points).Decode(job.coordinates));
    case Mood::kRefuse:
      return absl::FailedPreconditionError("not planar");
    case Mood::kCrash:
      raise(SIGSEGV);
      break;
    case Mood::kKilled:
      raise(SIGKILL);
      break;
    case Mood::kExit:
      _exit(77);
    case Mood::kThrow:
      std::jthread([] { throw std::runtime_error("nobody catches this"); }).join();
      break;
    case Mood::kHungry:
      std::jthread([] { Allocate(int64_t{1} << 40); }).join();
      break;
    case Mood::kModest:
      Allocate(64 << 20);
      return Answer(*std::move(points).Decode(job.coordinates));
    case Mood::kSpin:
      for (std::atomic<int> turns = 0;;) ++turns;
    case Mood::kSleep:
      for (;;) pause();
  }
  return absl::UnknownError("no such mood");
}

}  // namespace
}  // namespace rilievo

int main() {
  const rilievo::FileDescriptor socket(rilievo::kWorkerSocket);
  const auto code = rilievo::RunWorkerJob(socket, rilievo::FileDescriptor(0), rilievo::Work);
  _exit(static_cast<int>(code));
}
