#include "server/worker/worker_limits.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

#include "core/base/sanitized.h"
#include "core/base/status_macros.h"
#include "server/os/file_descriptor.h"

namespace rilievo {
namespace {

constexpr rlim_t kOpenFiles = 32;
// Between SIGXCPU, which says why the process ends, and SIGKILL, which does not.
constexpr rlim_t kGraceSeconds = 5;
constexpr int64_t kStackBytes = 8 << 20;  // of a thread

absl::Status Limit(int resource, rlim_t value, const char* name, rlim_t grace = 0) {
  const rlimit limit{value, value + grace};
  if (setrlimit(static_cast<__rlimit_resource>(resource), &limit) == 0) return absl::OkStatus();
  return StatusOfErrno(errno, name);
}

// Bytes that this process may write; 0 when the kernel does not say.
int64_t WritableBytes() {
  int64_t pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%*d %*d %*d %*d %*d %ld", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * sysconf(_SC_PAGESIZE);
}

// A wish: where the file cannot be written nothing is lost but the order of the victims.
void BeEndedFirst() {
  const FileDescriptor file(open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC));
  if (file.valid()) file.Write("1000", 4).IgnoreError();
}

// A library's warnings must not fill the operator's log file.
absl::Status ShutStandardError() {
  struct stat file;
  if (fstat(STDERR_FILENO, &file) != 0 || !S_ISREG(file.st_mode)) return absl::OkStatus();
  const FileDescriptor nothing(open("/dev/null", O_WRONLY | O_CLOEXEC));
  for (const int number : {STDOUT_FILENO, STDERR_FILENO}) {
    if (dup2(nothing.number(), number) < 0) return StatusOfErrno(errno, "standard error");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status LimitThisProcess(const WorkerLimits& limits) {
  BeEndedFirst();
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (limits.memory_bytes > 0 && !kSanitized) {
    // Not the address space: glibc reserves 64 MiB of it for each thread and hardly uses them.
    const int64_t own = WritableBytes() + (limits.threads + 1) * kStackBytes;
    RILIEVO_RETURN_IF_ERROR(
        Limit(RLIMIT_DATA, static_cast<rlim_t>(own + limits.memory_bytes), "memory limit"));
  }
  if (limits.processor_seconds > 0) {
    RILIEVO_RETURN_IF_ERROR(Limit(RLIMIT_CPU, static_cast<rlim_t>(limits.processor_seconds),
                                  "processor time limit", kGraceSeconds));
  }
  RILIEVO_RETURN_IF_ERROR(Limit(RLIMIT_NOFILE, kOpenFiles, "limit of open files"));
  // A library that warns on a standard error that is a file must not end the job.
  std::signal(SIGXFSZ, SIG_IGN);
  RILIEVO_RETURN_IF_ERROR(ShutStandardError());
  RILIEVO_RETURN_IF_ERROR(
      Limit(RLIMIT_FSIZE, static_cast<rlim_t>(limits.file_bytes), "limit of written files"));
  return Limit(RLIMIT_CORE, 0, "limit of core files");
}

}  // namespace rilievo
