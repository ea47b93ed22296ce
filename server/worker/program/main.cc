// rilievo-worker: one job in a process of its own. Started by rilievod, which gives it the points
// as standard input and a socket as file 3.
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

#include "core/pipeline/reconstruct.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "--version") == 0) {
    std::puts("rilievo-worker " RILIEVO_VERSION);
    return 0;
  }
  if (argc != 1 || fcntl(rilievo::kWorkerSocket, F_GETFD) < 0) {
    std::fputs("rilievo-worker works on one job of rilievod, which starts it\n", stderr);
    return static_cast<int>(rilievo::WorkerExit::kUsage);
  }
  std::signal(SIGPIPE, SIG_IGN);
  const rilievo::FileDescriptor socket(rilievo::kWorkerSocket);
  const rilievo::WorkerExit code = rilievo::RunWorkerJob(
      socket, rilievo::FileDescriptor(STDIN_FILENO), rilievo::InThisProcess(rilievo::Reconstruct));
  // Neither time nor memory is spent on taking the process down by hand.
  _exit(static_cast<int>(code));
}
