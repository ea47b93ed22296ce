// A rilievod of its own for each test: the program itself, as an operator starts it.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace rilievo {

// Runs a program and gives its exit code; -1 when it did not end by itself.
int RunProgram(const std::vector<std::string>& arguments);

// The most resident memory that a process has had, in bytes; 0 when there is none of that number.
int64_t PeakBytesOf(pid_t process);

class DaemonProcess {
 public:
  // Starts `rilievod --listen 127.0.0.1:0` with more arguments, and waits for its ready line.
  // `environment`: variables beside this process's own, as "NAME=VALUE".
  explicit DaemonProcess(const std::vector<std::string>& arguments = {},
                         const std::vector<std::string>& environment = {});
  ~DaemonProcess();  // kills what still runs
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  // "127.0.0.1:PORT"; empty when it did not start.
  const std::string& address() const { return address_; }

  // Of its address.
  int port() const;

  pid_t pid() const { return pid_; }
  void Signal(int signal) const;
  // The exit code, when it ended in time; 128 + signal when a signal ended it.
  std::optional<int> WaitForExit(std::chrono::milliseconds timeout);

  // The processes that it has started and that still run.
  std::vector<pid_t> Workers() const;
  // Waits until it has a worker; -1 when it has none in time.
  pid_t WaitForWorker(std::chrono::milliseconds timeout) const;

  // Memory in bytes, now and at its highest.
  int64_t ResidentBytes() const;
  int64_t PeakBytes() const { return PeakBytesOf(pid_); }

  // The lines of its standard error so far; WaitForLine() until one holds `text`.
  std::vector<std::string> Log() const;
  std::optional<std::string> WaitForLine(const std::string& text,
                                         std::chrono::milliseconds timeout) const;
  // Reads its standard error no further, or again: a reader who stalls.
  void StallLog(bool stalled) { log_stalled_ = stalled; }

 private:
  void ReadLog(int pipe);

  pid_t pid_ = -1;
  std::string address_;
  std::optional<int> exit_code_;
  mutable std::mutex mutex_;
  mutable std::condition_variable logged_;
  std::vector<std::string> log_;
  std::atomic<bool> log_stalled_ = false;
  std::jthread log_reader_;
};

}  // namespace rilievo
