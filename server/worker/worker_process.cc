#include "server/worker/worker_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

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

// What loads the program and its sanitizers, and nothing that may be a secret of the server's.
std::vector<char*> EnvironmentOfWorkers() {
  constexpr std::string_view kHandedOn[] = {
      "LD_LIBRARY_PATH=", "MALLOC_",       "GLIBC_TUNABLES=", "ASAN_OPTIONS=",
      "UBSAN_OPTIONS=",   "LSAN_OPTIONS=", "TSAN_OPTIONS="};
  std::vector<char*> environment;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const bool handed_on = std::any_of(
        std::begin(kHandedOn), std::end(kHandedOn),
        [text = std::string_view(*variable)](auto prefix) { return text.starts_with(prefix); });
    if (handed_on) environment.push_back(*variable);
  }
  environment.push_back(nullptr);
  return environment;
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

absl::StatusOr<WorkerProgram> WorkerProgram::Open(const std::string& path) {
  const FileDescriptor opened(open(path.c_str(), O_PATH | O_CLOEXEC));
  // Beyond the numbers that a worker finds its files under: Start() must not write over it.
  FileDescriptor file;
  if (opened.valid()) {
    file = FileDescriptor(fcntl(opened.number(), F_DUPFD_CLOEXEC, kWorkerSocket + 2));
  }
  if (!file.valid()) {
    return absl::NotFoundError(
        absl::StrCat("the worker ", path, ": ", std::generic_category().message(errno)));
  }
  return WorkerProgram(std::make_shared<const FileDescriptor>(std::move(file)));
}

absl::StatusOr<WorkerProcess> WorkerProcess::Start(const WorkerProgram& program,
                                                   const FileDescriptor& points,
                                                   const std::vector<FileDescriptor>& scratch) {
  // Numbers that no file action overwrites before these are copied.
  constexpr int kBeyond = 64;
  std::vector<FileDescriptor> copies;
  for (const FileDescriptor& file : scratch) {
    copies.emplace_back(fcntl(file.number(), F_DUPFD_CLOEXEC, kBeyond));
    if (!copies.back().valid()) return StatusOfErrno(errno, "a file for the worker");
  }
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
  // By its descriptor: a file that takes the place of the program's is not started.
  posix_spawn_file_actions_adddup2(&settings.files, program.number(), kWorkerSocket + 1);
  int next = kFirstScratchFile;
  for (const FileDescriptor& file : copies) {
    posix_spawn_file_actions_adddup2(&settings.files, file.number(), next++);
  }
  posix_spawn_file_actions_addclosefrom_np(&settings.files, next);
  const std::string path = absl::StrCat("/proc/self/fd/", kWorkerSocket + 1);
  char* const arguments[] = {const_cast<char*>("rilievo-worker"), nullptr};
  std::vector<char*> environment = EnvironmentOfWorkers();
  pid_t process = -1;
  const int error = posix_spawn(&process, path.c_str(), &settings.files, &settings.attributes,
                                arguments, environment.data());
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
