#include "server/worker/worker_process.h"

#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

extern char** environ;

namespace rilievo {
namespace {

// Spawning settings that free themselves.
struct SpawnSettings {
  SpawnSettings() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
};

// A group of its own: the Ctrl-C of a terminal is the server's to answer. The server's threads
// block the signals that end it; a worker blocks none.
void SetSignals(posix_spawnattr_t* attributes) {
  sigset_t none, changed;
  sigemptyset(&none);
  sigemptyset(&changed);
  sigaddset(&changed, SIGPIPE);
  posix_spawnattr_setsigmask(attributes, &none);
  posix_spawnattr_setsigdefault(attributes, &changed);
  posix_spawnattr_setpgroup(attributes, 0);
  posix_spawnattr_setflags(attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

}  // namespace

absl::StatusOr<std::string> WorkerBesideThisProgram() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string worker = (program.parent_path() / "rilievo-worker").string();
  if (!error && access(worker.c_str(), X_OK) == 0) return worker;
  return absl::NotFoundError(
      "there is no rilievo-worker beside this program; install it, name it with --worker PATH, or "
      "work in this process with --in-process");
}

absl::StatusOr<WorkerProcess> WorkerProcess::Start(const std::string& program,
                                                   FileDescriptor points) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return StatusOfErrno(errno, "a socket to the worker");
  }
  FileDescriptor own(ends[0]);
  const FileDescriptor theirs(ends[1]);
  SpawnSettings settings;
  SetSignals(&settings.attributes);
  posix_spawn_file_actions_adddup2(&settings.files, points.number(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&settings.files, STDERR_FILENO, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&settings.files, theirs.number(), kWorkerSocket);
  posix_spawn_file_actions_addclosefrom_np(&settings.files, kWorkerSocket + 1);
  char* const arguments[] = {const_cast<char*>("rilievo-worker"), nullptr};
  pid_t process = -1;
  const int error = posix_spawn(&process, program.c_str(), &settings.files, &settings.attributes,
                                arguments, environ);
  if (error != 0) return StatusOfErrno(error, "start of the worker");
  return WorkerProcess(process, std::move(own));
}

WorkerProcess::WorkerProcess(WorkerProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)), socket_(std::move(other.socket_)) {}

WorkerProcess::~WorkerProcess() { End(); }

void WorkerProcess::Abandon() const { shutdown(socket_.number(), SHUT_RDWR); }

int WorkerProcess::End() {
  if (process_ < 0) return 0;
  int status = 0;
  // A worker that said its last word ends by itself; one that has not is ended here.
  kill(process_, SIGKILL);
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return status;
}

}  // namespace rilievo
