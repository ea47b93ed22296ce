// The worker's side: one job, then the process ends.
#pragma once

#include "server/os/file_descriptor.h"
#include "server/worker/job_work.h"

namespace rilievo {

// How a worker ends when it cannot say why over the socket.
enum class WorkerExit {
  kDone = 0,         // the last message was sent
  kUsage = 2,        // started by hand
  kOutOfMemory = 3,  // where no status could carry it
  kAbandoned = 4,    // the server closed the socket
  kDefect = 5,       // an exception that nobody caught
};

// Reads a JobOrder from `socket`, denies itself what the order says and all that EnterSandbox()
// does, says that it is ready, reads the points from `points`, works, and sends what came of it.
// The process ends at once when the server goes away. Files beyond the socket are closed, but
// for those of the order.
WorkerExit RunWorkerJob(const FileDescriptor& socket, FileDescriptor points, const JobWork& work);

}  // namespace rilievo
