#include "server/worker/run_worker_job.h"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <new>
#include <thread>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/worker/message_channel.h"
#include "server/worker/worker_limits.h"
#include "server/worker/worker_protocol.pb.h"

namespace rilievo {
namespace {

constexpr size_t kPieceBytes = 1 << 20;

[[noreturn]] void EndNow(WorkerExit code) { _exit(static_cast<int>(code)); }

[[noreturn]] void OnTerminate() {
  if (const std::exception_ptr current = std::current_exception()) {
    try {
      std::rethrow_exception(current);
    } catch (const std::bad_alloc&) {
      EndNow(WorkerExit::kOutOfMemory);
    } catch (...) {
    }
  }
  EndNow(WorkerExit::kDefect);
}

// Nothing more is due from the server: whatever ends the read means that nobody waits any longer.
void EndWithServer(const FileDescriptor& socket) {
  char byte;
  if (!socket.Read(&byte, 1).ok()) EndNow(WorkerExit::kAbandoned);
}

absl::StatusOr<JobRequest> TakeOrder(const worker::JobOrder& order) {
  if (order.version() != RILIEVO_VERSION) {
    return absl::InternalError(absl::StrCat("the worker is of version " RILIEVO_VERSION
                                            ", the server of ",
                                            order.version(), "; install both together"));
  }
  RILIEVO_RETURN_IF_ERROR(LimitThisProcess({.memory_bytes = order.memory_bytes(),
                                            .processor_seconds = order.processor_seconds(),
                                            .threads = order.threads()}));
  // The server has checked the header; its own limits of points are no concern here.
  ServerOptions limits;
  limits.max_points = std::numeric_limits<int32_t>::max();
  limits.max_scan_bytes = 24 * limits.max_points;
  limits.max_surface_faces = order.max_surface_faces();
  limits.threads = order.threads();
  auto parsed = ParseHeader(order.header(), limits);
  if (const auto* error = std::get_if<CallError>(&parsed)) {
    return absl::Status(error->code, error->message);
  }
  return std::get<JobRequest>(std::move(parsed));
}

absl::StatusOr<JobResult> Work(const worker::JobOrder& order, FileDescriptor points,
                               const JobWork& work, const FileDescriptor& socket) {
  RILIEVO_ASSIGN_OR_RETURN(const JobRequest job, TakeOrder(order));
  RunContext context;
  context.threads = job.threads;
  context.seed = job.seed;
  context.progress = [&socket](const Progress& progress) {
    worker::WorkerMessage message;
    message.mutable_progress()->set_stage(static_cast<int>(progress.stage));
    message.mutable_progress()->set_fraction(progress.fraction);
    // A server that is gone ends this process by itself.
    SendMessage(socket, message).IgnoreError();
  };
  return work(job, ScanBytes(std::move(points)), context);
}

absl::Status SendResult(const JobResult& result, const FileDescriptor& socket) {
  worker::WorkerMessage message;
  *message.mutable_result()->mutable_report() = result.report;
  for (const auto& chunk : result.encoded.chunks) {
    message.mutable_result()->add_chunk_bytes(chunk.size());
  }
  RILIEVO_RETURN_IF_ERROR(SendMessage(socket, message));
  for (const auto& chunk : result.encoded.chunks) {
    for (size_t at = 0; at < chunk.size(); at += kPieceBytes) {
      message.set_piece(chunk.data() + at, std::min(kPieceBytes, chunk.size() - at));
      RILIEVO_RETURN_IF_ERROR(SendMessage(socket, message));
    }
  }
  return absl::OkStatus();
}

absl::Status SendFailure(const absl::Status& status, const FileDescriptor& socket) {
  worker::WorkerMessage message;
  message.mutable_failure()->set_code(static_cast<int>(status.code()));
  message.mutable_failure()->set_text(std::string(status.message()));
  return SendMessage(socket, message);
}

}  // namespace

WorkerExit RunWorkerJob(const FileDescriptor& socket, FileDescriptor points, const JobWork& work) {
  std::set_terminate(OnTerminate);
  worker::JobOrder order;
  if (!ReceiveMessage(socket, &order).ok()) return WorkerExit::kAbandoned;
  std::thread([&socket] { EndWithServer(socket); }).detach();
  const auto result = Work(order, std::move(points), work, socket);
  const absl::Status sent =
      result.ok() ? SendResult(*result, socket) : SendFailure(result.status(), socket);
  return sent.ok() ? WorkerExit::kDone : WorkerExit::kAbandoned;
}

}  // namespace rilievo
