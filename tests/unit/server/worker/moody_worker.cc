// A worker whose job ends as its seed says.
#include "tests/unit/server/worker/moody_worker.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <semaphore>
#include <stdexcept>
#include <thread>

#include "absl/strings/str_cat.h"
#include "server/worker/message_channel.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"
#include "server/worker/worker_protocol.pb.h"

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
  int open_files = 0;  // asked for in a way that workers may
  for (int file = 0; file < 1024; ++file) {
    open_files += lseek(file, 0, SEEK_CUR) >= 0 || errno == ESPIPE;
  }
  return absl::StrCat(text, "term=", sigismember(&blocked, SIGTERM), " open=", open_files,
                      " own_group=", getpgrp() == getpid());
}

// What succeeds of all that a worker has no need of.
std::string Reached() {
  std::string reached;
  const auto attempt = [&](const char* what, bool succeeds) {
    if (succeeds) absl::StrAppend(&reached, " ", what);
  };
  const std::string server = absl::StrCat("/proc/", getppid());
  attempt("open", open("/etc/passwd", O_RDONLY) >= 0);
  attempt("create", open("/tmp/rilievo-compromised", O_WRONLY | O_CREAT, 0600) >= 0);
  attempt("list", opendir("/") != nullptr);
  struct stat status {};
  attempt("stat", stat("/etc/passwd", &status) == 0);
  attempt("unlink", unlink("/tmp/rilievo-compromised") == 0);
  attempt("memory-of-server", open((server + "/mem").c_str(), O_RDWR) >= 0);
  attempt("environment-of-server", open((server + "/environ").c_str(), O_RDONLY) >= 0);
  attempt("secret", std::getenv("RILIEVO_TEST_SECRET") != nullptr);
  attempt("signal", kill(getppid(), 0) == 0);
  attempt("trace", ptrace(PTRACE_ATTACH, getppid(), nullptr, nullptr) == 0);
  for (const int family : {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK}) {
    attempt("socket", socket(family, SOCK_STREAM, 0) >= 0);
  }
  attempt("memfd", memfd_create("compromised", 0) >= 0);
  attempt("code", mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC,
                       MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED);
  char* const arguments[] = {const_cast<char*>("true"), nullptr};
  attempt("program", execve("/bin/true", arguments, nullptr) == 0);
  const pid_t child = fork();
  if (child == 0) _exit(0);
  attempt("process", child > 0);
  return reached;
}

// What of `files` from number `first` on is written, and of its other files.
std::string Written(int first, int files) {
  std::string written;
  const auto attempt = [&](const std::string& what, bool succeeds) {
    if (succeeds) absl::StrAppend(&written, " ", what);
  };
  for (int i = 0; i <= files; ++i) {
    const int file = first + i;
    attempt(absl::StrCat("place", i), pwrite(file, "x", 1, 1000) == 1);
    attempt(absl::StrCat("cut", i), ftruncate(file, 500) == 0);
    attempt(absl::StrCat("beyond", i), pwrite(file, "x", 1, 5000) == 1);
    attempt(absl::StrCat("end", i), write(file, "x", 1) == 1);
  }
  attempt("points", write(0, "x", 1) == 1 || pwrite(0, "x", 1, 0) == 1 || ftruncate(0, 0) == 0);
  return written;
}

// A library may have started threads before a worker shut itself in.
std::binary_semaphore earlier_begins{0};
std::string reached_earlier;
std::thread earlier;

JobResult Compromised() {
  JobResult result;
  earlier_begins.release();
  earlier.join();
  result.report.set_road_reason(
      absl::StrCat("from the job:", Reached(), "; from an earlier thread:", reached_earlier));
  return result;
}

// What no worker of ours says.
[[noreturn]] void Say(const worker::WorkerMessage& message) {
  SendMessage(FileDescriptor(kWorkerSocket), message).IgnoreError();
  for (;;) pause();
}

absl::StatusOr<JobResult> Answer(const JobRequest& job, ScanBytes points) {
  const auto scan = std::move(points).Decode(job.size);
  if (!scan.ok()) return scan.status();
  JobResult result;
  result.report.set_points_in(scan->scan.points.cols());
  result.report.set_road_reason(LimitsOfThisProcess());
  result.encoded.chunks = {std::vector<uint8_t>(10, 1), {}, std::vector<uint8_t>(3'000'000, 2), {}};
  return result;
}

absl::StatusOr<JobResult> Work(const JobRequest& job, ScanBytes points, const RunContext& context) {
  context.Report(Stage::kNormals, 0.5);
  switch (static_cast<Mood>(job.seed)) {
    case Mood::kWell:
      return Answer(job, std::move(points));
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
      return Answer(job, std::move(points));
    case Mood::kSpin:
      for (std::atomic<int> turns = 0;;) ++turns;
    case Mood::kSleep:
      for (;;) pause();
    case Mood::kCompromised:
      return Compromised();
    case Mood::kWriting: {
      JobResult result;
      result.report.set_road_reason(Written(kFirstScratchFile, job.parts ? 2 : 0));
      return result;
    }
    case Mood::kManyChunks:
    case Mood::kLargeChunk: {
      worker::WorkerMessage message;
      const bool many = static_cast<Mood>(job.seed) == Mood::kManyChunks;
      for (int i = 0; i < (many ? 1'000'000 : 2); ++i) {
        message.mutable_result()->add_chunk_bytes(many ? 0 : uint64_t{1} << 63);
      }
      Say(message);
    }
    case Mood::kForeignCode: {
      worker::WorkerMessage message;
      message.mutable_failure()->set_code(static_cast<int>(absl::StatusCode::kUnavailable));
      Say(message);
    }
  }
  return absl::UnknownError("no such mood");
}

}  // namespace
}  // namespace rilievo

int main() {
  rilievo::earlier = std::thread([] {
    rilievo::earlier_begins.acquire();
    rilievo::reached_earlier = rilievo::Reached();
  });
  const rilievo::FileDescriptor socket(rilievo::kWorkerSocket);
  const auto code = rilievo::RunWorkerJob(socket, rilievo::FileDescriptor(0), rilievo::Work);
  _exit(static_cast<int>(code));
}
