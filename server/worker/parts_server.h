// What a worker process that shares parts with others asks of its server.
#pragma once

#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "server/conversion/job_request.h"
#include "server/os/file_descriptor.h"
#include "server/worker/worker_protocol.pb.h"

namespace rilievo {

class PartsServer {
 public:
  // Both outlive it. `socket`: to the worker.
  PartsServer(const JobRequest& job, const FileDescriptor& socket) : job_(job), socket_(socket) {}

  // Whether the message is about parts, and this worker shares them.
  bool IsAsked(const worker::WorkerMessage& message) const;

  // The errors of SharedParts; INTERNAL where the worker is gone (worker_is_gone()), or asks for
  // what it may not: a part that it was not given, or more room than its job has.
  absl::Status Answer(const worker::WorkerMessage& asked);

  bool worker_is_gone() const { return worker_is_gone_; }

 private:
  // More than the step is cut into, each a row of the store's.
  int64_t MostPartsOf(PartStep step) const;
  absl::Status Send(const worker::ServerMessage& message);
  absl::Status TellTurn(PartStep step, int count);
  absl::Status TakePart(PartStep step, int part);
  absl::Status SendPart(PartStep step, int part);

  const JobRequest& job_;
  const FileDescriptor& socket_;
  bool worker_is_gone_ = false;
  std::pair<PartStep, int> given_{PartStep::kCoarse, -1};  // the part that it was told to do
  int64_t taken_bytes_ = 0;                                // of parts, in all
};

}  // namespace rilievo
