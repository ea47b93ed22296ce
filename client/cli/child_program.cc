#include "client/cli/child_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr int kLookForStopMilliseconds = 100;

}  // namespace

absl::StatusOr<ChildProgram> ChildProgram::Start(const std::vector<std::string>& words) {
  int in[2], out[2];
  if (pipe2(in, O_CLOEXEC) != 0) return StatusOfErrno(errno, "a pipe");
  FileDescriptor their_input(in[0]), input(in[1]);
  if (pipe2(out, O_CLOEXEC) != 0) return StatusOfErrno(errno, "a pipe");
  FileDescriptor output(out[0]), their_output(out[1]);

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&files, their_input.number(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, their_output.number(), STDOUT_FILENO);
  // The signals that end this program are blocked in it, see interrupt.h.
  sigset_t none;
  sigemptyset(&none);
  sigset_t all;
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t process = -1;
  const int error = posix_spawnp(&process, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error == ENOENT) return absl::NotFoundError(absl::StrCat("there is no program ", words[0]));
  if (error != 0) return StatusOfErrno(error, words[0]);
  return ChildProgram(process, std::move(input), std::move(output));
}

ChildProgram::ChildProgram(ChildProgram&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      input_(std::move(other.input_)),
      output_(std::move(other.output_)),
      read_(std::move(other.read_)) {}

ChildProgram::~ChildProgram() {
  if (process_ < 0) return;
  kill(process_, SIGTERM);
  while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<std::string> ChildProgram::ReadLine(std::stop_token stop) {
  while (!stop.stop_requested()) {
    const size_t end = read_.find('\n');
    if (end != std::string::npos) {
      std::string line = read_.substr(0, end);
      read_.erase(0, end + 1);
      return line;
    }
    pollfd wait{output_.number(), POLLIN, 0};
    if (poll(&wait, 1, kLookForStopMilliseconds) <= 0) continue;
    char block[4096];
    const ssize_t got = read(output_.number(), block, sizeof(block));
    if (got == 0 || (got < 0 && errno != EINTR)) return std::nullopt;
    if (got > 0) read_.append(block, static_cast<size_t>(got));
  }
  return std::nullopt;
}

}  // namespace rilievo
