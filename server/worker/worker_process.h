// A running rilievo-worker, from the server's side.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// The file number under which a worker finds its socket.
inline constexpr int kWorkerSocket = 3;
// And the first of the files for its parts.
inline constexpr int kFirstScratchFile = kWorkerSocket + 2;

// "rilievo-worker" beside the program that runs; NOT_FOUND when there is none that can be started.
absl::StatusOr<std::string> WorkerBesideThisProgram();

// A program as it was when it was opened: an upgrade puts another file in its place, which a
// running server must not start.
class WorkerProgram {
 public:
  // NOT_FOUND when there is no such file.
  static absl::StatusOr<WorkerProgram> Open(const std::string& path);

  int number() const { return file_->number(); }

 private:
  explicit WorkerProgram(std::shared_ptr<const FileDescriptor> file) : file_(std::move(file)) {}

  std::shared_ptr<const FileDescriptor> file_;
};

class WorkerProcess {
 public:
  // `points`: its standard input; `scratch`: from file kFirstScratchFile on. Nothing else of this
  // process reaches it but standard error, the program itself as file kWorkerSocket + 1, and what
  // of the environment programs are loaded by. RESOURCE_EXHAUSTED when there is no room for a
  // process.
  static absl::StatusOr<WorkerProcess> Start(const WorkerProgram& program,
                                             const FileDescriptor& points,
                                             const std::vector<FileDescriptor>& scratch = {});

  WorkerProcess(WorkerProcess&& other) noexcept;
  WorkerProcess& operator=(WorkerProcess&&) = delete;

  // Kills it when it still runs.
  ~WorkerProcess();

  const FileDescriptor& socket() const { return socket_; }

  // Makes reads of the socket end, here and there. Any thread, while this object lives.
  void Abandon() const;

  // Kills it when it still runs; the status that wait() gives.
  int End();

 private:
  WorkerProcess(pid_t process, FileDescriptor socket)
      : process_(process), socket_(std::move(socket)) {}

  pid_t process_;
  FileDescriptor socket_;
};

}  // namespace rilievo
