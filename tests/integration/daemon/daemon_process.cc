#include "tests/integration/daemon/daemon_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "core/base/sanitized.h"

extern char** environ;

namespace rilievo {
namespace {

// Ends with a null pointer, as exec wants it.
std::vector<char*> Pointers(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const auto& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

// posix_spawn: a fork of a process with gRPC's threads could hang in the child.
pid_t Spawn(const std::vector<std::string>& arguments, const std::vector<std::string>& environment,
            int out, int err) {
  std::vector<char*> argv = Pointers(arguments), variables = Pointers(environment);
  for (char** variable = environ; *variable != nullptr; ++variable) {
    variables.insert(variables.end() - 1, *variable);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (out >= 0) posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  if (err >= 0) posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t pid = -1;
  const int failed = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), variables.data());
  posix_spawn_file_actions_destroy(&actions);
  return failed == 0 ? pid : -1;
}

int ExitCode(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

int64_t MemoryBytes(pid_t process, const std::string& field) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(field, 0) == 0) return std::stoll(line.substr(field.size())) * 1024;
  }
  return 0;
}

}  // namespace

int64_t PeakBytesOf(pid_t process) { return MemoryBytes(process, "VmHWM:"); }

int RunProgram(const std::vector<std::string>& arguments) {
  const pid_t pid = Spawn(arguments, {}, -1, -1);
  int status = 0;
  if (pid < 0 || waitpid(pid, &status, 0) != pid || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

DaemonProcess::DaemonProcess(const std::vector<std::string>& arguments,
                             const std::vector<std::string>& environment) {
  std::vector<std::string> all = {RILIEVOD_PROGRAM};
  if (std::find(arguments.begin(), arguments.end(), "--listen") == arguments.end()) {
    all.insert(all.end(), {"--listen", "127.0.0.1:0"});
  }
  all.insert(all.end(), arguments.begin(), arguments.end());
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) return;
  pid_ = Spawn(all, environment, out[1], err[1]);
  close(out[1]);
  close(err[1]);
  log_reader_ = std::jthread([this, end = err[0]] { ReadLog(end); });
  std::string ready;
  char c;
  while (read(out[0], &c, 1) == 1 && c != '\n') ready += c;
  close(out[0]);
  const std::string words = "rilievod listening on ";
  if (ready.rfind(words, 0) == 0) address_ = ready.substr(words.size());
}

DaemonProcess::~DaemonProcess() {
  StallLog(false);
  // A sanitizer looks for what leaked when the program ends by itself.
  if (kSanitized && pid_ > 0 && !exit_code_) {
    Signal(SIGTERM);
    WaitForExit(std::chrono::seconds(10));
  }
  if (pid_ > 0 && !exit_code_) {
    Signal(SIGKILL);
    WaitForExit(std::chrono::seconds(10));
  }
}

int DaemonProcess::port() const { return std::stoi(address_.substr(address_.rfind(':') + 1)); }

void DaemonProcess::Signal(int signal) const {
  if (pid_ > 0 && !exit_code_) kill(pid_, signal);
}

std::optional<int> DaemonProcess::WaitForExit(std::chrono::milliseconds timeout) {
  const auto end = std::chrono::steady_clock::now() + timeout;
  while (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = ExitCode(status);
    } else if (std::chrono::steady_clock::now() > end) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  return exit_code_;
}

std::vector<pid_t> DaemonProcess::Workers() const {
  std::vector<pid_t> workers;
  std::error_code error;
  const std::string tasks = "/proc/" + std::to_string(pid_) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks, error)) {
    std::ifstream children(task.path() / "children");
    for (pid_t child; children >> child;) workers.push_back(child);
  }
  return workers;
}

pid_t DaemonProcess::WaitForWorker(std::chrono::milliseconds timeout) const {
  const auto end = std::chrono::steady_clock::now() + timeout;
  while (std::chrono::steady_clock::now() < end) {
    if (const auto workers = Workers(); !workers.empty()) return workers.front();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return -1;
}

int64_t DaemonProcess::ResidentBytes() const { return MemoryBytes(pid_, "VmRSS:"); }

void DaemonProcess::ReadLog(int pipe) {
  std::string line;
  char buffer[4096];
  for (ssize_t n; (n = read(pipe, buffer, sizeof(buffer))) > 0;) {
    while (log_stalled_) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::lock_guard lock(mutex_);
    for (ssize_t i = 0; i < n; ++i) {
      if (buffer[i] != '\n') {
        line += buffer[i];
        continue;
      }
      if (kSanitized) std::fprintf(stderr, "%s\n", line.c_str());  // its report is the test's
      log_.push_back(line);
      line.clear();
    }
    logged_.notify_all();
  }
  close(pipe);
}

std::vector<std::string> DaemonProcess::Log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

std::optional<std::string> DaemonProcess::WaitForLine(const std::string& text,
                                                      std::chrono::milliseconds timeout) const {
  std::unique_lock lock(mutex_);
  std::optional<std::string> found;
  logged_.wait_for(lock, timeout, [&] {
    for (const auto& line : log_) {
      if (line.find(text) != std::string::npos) found = line;
    }
    return found.has_value();
  });
  return found;
}

}  // namespace rilievo
