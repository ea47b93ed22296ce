// rilievo-worker: one job in a process of its own. Started by rilievod, which gives it the points
// as standard input and a socket as file 3.
#include <fcntl.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

#include "core/pipeline/reconstruct.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"

namespace {

// A job's memory goes with its process: giving large blocks back to the system in between, and
// asking for them again, cost 2 % to 5 % of a job of 100 000 points.
void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  mallopt(M_TOP_PAD, 4 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "--version") == 0) {
    std::puts("rilievo-worker " RILIEVO_VERSION);
    return 0;
  }
  if (argc != 1 || fcntl(rilievo::kWorkerSocket, F_GETFD) < 0) {
    std::fputs("rilievo-worker works on one job of rilievod, which starts it\n", stderr);
    return static_cast<int>(rilievo::WorkerExit::kUsage);
  }
  prctl(PR_SET_NAME, "rilievo-worker");  // started by a descriptor it has only a number
  std::signal(SIGPIPE, SIG_IGN);
  KeepFreedMemory();
  const rilievo::FileDescriptor socket(rilievo::kWorkerSocket);
  const rilievo::WorkerExit code =
      rilievo::RunWorkerJob(socket, rilievo::FileDescriptor(STDIN_FILENO),
                            rilievo::InThisProcess(rilievo::ReconstructAndDrop));
  // Neither time nor memory is spent on taking the process down by hand.
  _exit(static_cast<int>(code));
}
