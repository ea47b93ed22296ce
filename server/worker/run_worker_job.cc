#include "server/worker/run_worker_job.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "server/worker/message_channel.h"
#include "server/worker/socket_parts.h"
#include "server/worker/worker_limits.h"
#include "server/worker/worker_process.h"
#include "server/worker/worker_protocol.pb.h"
#include "server/worker/worker_sandbox.h"

namespace rilievo {
namespace {

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

// Nothing more is due from the server than what is asked about parts: whatever ends the read means
// that nobody waits any longer.
void ReadUntilEnd(const FileDescriptor& socket, SocketParts* parts) {
  worker::ServerMessage message;
  while (ReceiveMessage(socket, &message).ok() && parts != nullptr) {
    parts->Take(std::move(message));
  }
  EndNow(WorkerExit::kAbandoned);
}

absl::Status ShutIn(const worker::JobOrder& order) {
  if (order.version() != RILIEVO_VERSION) {
    return absl::UnavailableError(absl::StrCat("the worker is of version " RILIEVO_VERSION
                                               ", the server of ",
                                               order.version(), "; install both together"));
  }
  RILIEVO_RETURN_IF_ERROR(LimitThisProcess({.memory_bytes = order.memory_bytes(),
                                            .processor_seconds = order.processor_seconds(),
                                            .threads = order.threads(),
                                            .file_bytes = order.scratch_bytes()}));
  return EnterSandbox(kFirstScratchFile, order.scratch_files());
}

absl::StatusOr<JobRequest> ReadHeader(const worker::JobOrder& order) {
  // The server has checked the header; its own limits of points do not matter here.
  ServerOptions limits;
  limits.max_points = std::numeric_limits<int32_t>::max();
  limits.max_scan_bytes = std::numeric_limits<int64_t>::max();
  limits.max_surface_faces = order.max_surface_faces();
  limits.threads = order.threads();
  auto parsed = ParseHeader(order.header(), limits);
  if (const auto* error = std::get_if<CallError>(&parsed)) {
    return absl::Status(error->code(), error->message);
  }
  return std::get<JobRequest>(std::move(parsed));
}

PartsRequest PartsOf(const worker::JobOrder& order, std::shared_ptr<SharedParts> shared) {
  std::vector<int> files(static_cast<size_t>(order.scratch_files()));
  std::iota(files.begin(), files.end(), kFirstScratchFile);
  return {order.part_points(), ScratchFolder::OfFiles("of the server", std::move(files)),
          std::move(shared)};
}

absl::StatusOr<JobResult> Work(const worker::JobOrder& order, FileDescriptor points,
                               const JobWork& work, const FileDescriptor& socket,
                               std::shared_ptr<SharedParts> shared) {
  RILIEVO_ASSIGN_OR_RETURN(JobRequest job, ReadHeader(order));
  if (order.part_points() > 0) {
    job.parts = PartsOf(order, std::move(shared));
    ReleaseLargeBlocksAtOnce();  // memory counts for more than time
  }
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
  return work(job, ScanBytes(std::move(points), order.scan_sha256()), context);
}

// Opened before files can no longer be opened.
class PeakMemory {
 public:
  int64_t bytes() const {
    std::string text(4096, '\0');
    const ssize_t size = pread(status_.number(), text.data(), text.size() - 1, 0);
    const size_t line = size > 0 ? text.find("VmHWM:") : std::string::npos;
    return line == std::string::npos ? 0 : std::strtoll(text.c_str() + line + 6, nullptr, 10) << 10;
  }

 private:
  FileDescriptor status_{open("/proc/self/status", O_RDONLY | O_CLOEXEC)};
};

absl::Status SendReady(const FileDescriptor& socket) {
  worker::WorkerMessage message;
  message.mutable_ready()->set_version(RILIEVO_VERSION);
  return SendMessage(socket, message);
}

absl::Status SendResult(const JobResult& result, int64_t peak_bytes, const FileDescriptor& socket) {
  worker::WorkerMessage message;
  message.mutable_result()->set_peak_bytes(peak_bytes);
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

absl::Status SendFailure(const absl::Status& status, int64_t peak_bytes,
                         const FileDescriptor& socket) {
  worker::WorkerMessage message;
  message.mutable_failure()->set_peak_bytes(peak_bytes);
  message.mutable_failure()->set_code(static_cast<int>(status.code()));
  message.mutable_failure()->set_text(std::string(status.message()));
  return SendMessage(socket, message);
}

}  // namespace

WorkerExit RunWorkerJob(const FileDescriptor& socket, FileDescriptor points, const JobWork& work) {
  std::set_terminate(OnTerminate);
  const auto exit_of = [](const absl::Status& sent) {
    return sent.ok() ? WorkerExit::kDone : WorkerExit::kAbandoned;
  };
  worker::JobOrder order;
  if (!ReceiveMessage(socket, &order).ok()) return WorkerExit::kAbandoned;
  close(kWorkerSocket + 1);
  close_range(static_cast<unsigned>(kFirstScratchFile + order.scratch_files()), ~0U, 0);
  const PeakMemory peak;
  if (const absl::Status shut = ShutIn(order); !shut.ok()) {
    return exit_of(SendFailure(shut, 0, socket));
  }
  if (!SendReady(socket).ok()) return WorkerExit::kAbandoned;
  const auto parts =
      order.shares_parts() ? std::make_shared<SocketParts>(&socket, order.leads()) : nullptr;
  std::thread([&socket, parts] { ReadUntilEnd(socket, parts.get()); }).detach();
  const auto result = Work(order, std::move(points), work, socket, parts);
  return exit_of(result.ok() ? SendResult(*result, peak.bytes(), socket)
                             : SendFailure(result.status(), peak.bytes(), socket));
}

}  // namespace rilievo
