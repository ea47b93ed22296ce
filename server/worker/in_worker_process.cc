#include "server/worker/in_worker_process.h"

#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/worker/message_channel.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"
#include "server/worker/worker_protocol.pb.h"

namespace rilievo {
namespace {

worker::JobOrder OrderOf(const JobRequest& job, const WorkerSettings& settings) {
  worker::JobOrder order;
  order.set_version(RILIEVO_VERSION);
  *order.mutable_header() = job.header;
  order.set_max_surface_faces(job.options.max_surface_faces);
  order.set_threads(job.threads);
  order.set_memory_bytes(settings.memory_bytes);
  order.set_processor_seconds(settings.processor_seconds * job.threads);
  return order;
}

// What the worker says, in order; DATA_LOSS where it makes no sense.
class Answer {
 public:
  bool complete() const { return failure_ || (result_ && chunk_ == result_->chunk_bytes_size()); }

  absl::Status Take(worker::WorkerMessage message, const RunContext& context) {
    if (message.has_progress() && !result_) {
      const int stage = message.progress().stage();
      if (stage < 0 || stage >= kStageCount) return absl::DataLossError("no such stage");
      context.Report(static_cast<Stage>(stage), message.progress().fraction());
      return absl::OkStatus();
    }
    if (message.has_failure() && !result_) {
      failure_ = absl::Status(static_cast<absl::StatusCode>(message.failure().code()),
                              message.failure().text());
      return failure_->ok() ? absl::DataLossError("a failure without a code") : absl::OkStatus();
    }
    if (message.has_result() && !result_) {
      result_ = std::move(*message.mutable_result());
      chunks_.resize(static_cast<size_t>(result_->chunk_bytes_size()));
      SkipFullChunks();
      return absl::OkStatus();
    }
    if (!result_) return absl::DataLossError("a message that was not due");
    return TakePiece(message.piece());
  }

  absl::StatusOr<JobResult> Finish() && {
    if (failure_) return *failure_;
    JobResult result;
    result.encoded.chunks = std::move(chunks_);
    result.report = std::move(*result_->mutable_report());
    return result;
  }

 private:
  absl::Status TakePiece(const std::string& piece) {
    auto& chunk = chunks_[static_cast<size_t>(chunk_)];
    if (piece.empty() || piece.size() > result_->chunk_bytes(chunk_) - chunk.size()) {
      return absl::DataLossError("a piece that does not fit its chunk");
    }
    chunk.insert(chunk.end(), piece.begin(), piece.end());
    SkipFullChunks();
    return absl::OkStatus();
  }

  void SkipFullChunks() {
    while (chunk_ < result_->chunk_bytes_size() &&
           chunks_[static_cast<size_t>(chunk_)].size() == result_->chunk_bytes(chunk_)) {
      ++chunk_;
    }
  }

  std::optional<absl::Status> failure_;
  std::optional<worker::Result> result_;
  std::vector<std::vector<uint8_t>> chunks_;
  int chunk_ = 0;  // the one that grows
};

// Why a worker ended before its last word. `wait_status`: of wait().
absl::Status CauseOfEnd(int wait_status, const WorkerSettings& settings) {
  if (WIFSIGNALED(wait_status)) {
    switch (WTERMSIG(wait_status)) {
      case SIGKILL:
        return absl::AbortedError(
            "the process that worked on the job was killed, for want of memory or by hand");
      case SIGXCPU:
        return absl::DeadlineExceededError(
            "the job used up its processor time; ask for a lower max_level or send fewer points");
      default:
        return absl::InternalError(
            absl::StrCat("the worker was ended by signal ", WTERMSIG(wait_status)));
    }
  }
  if (WEXITSTATUS(wait_status) == static_cast<int>(WorkerExit::kOutOfMemory)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the job needs more than the ", settings.memory_bytes / 1'000'000,
                     " MB of memory it may have; ask for a lower max_level or fewer "
                     "control_faces, or send fewer points"));
  }
  return absl::InternalError(absl::StrCat("the worker ended with code ", WEXITSTATUS(wait_status)));
}

absl::StatusOr<JobResult> Run(const WorkerSettings& settings, const JobRequest& job,
                              ScanBytes points, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor file, std::move(points).TakeFile());
  RILIEVO_ASSIGN_OR_RETURN(WorkerProcess process,
                           WorkerProcess::Start(settings.program, std::move(file)));
  // Ends the reads below; then the process is killed.
  std::optional<std::stop_callback<std::function<void()>>> stop;
  stop.emplace(context.stop, [&process] { process.Abandon(); });
  Answer answer;
  absl::Status status = SendMessage(process.socket(), OrderOf(job, settings));
  while (status.ok() && !answer.complete()) {
    worker::WorkerMessage message;
    status = ReceiveMessage(process.socket(), &message);
    if (status.ok()) status = answer.Take(std::move(message), context);
  }
  stop.reset();
  if (status.code() == absl::StatusCode::kDataLoss) return absl::InternalError(status.message());
  const int wait_status = process.End();
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (!answer.complete()) return CauseOfEnd(wait_status, settings);
  return std::move(answer).Finish();
}

}  // namespace

JobWork InWorkerProcess(WorkerSettings settings) {
  return [settings = std::move(settings)](const JobRequest& job, ScanBytes points,
                                          const RunContext& context) {
    return Run(settings, job, std::move(points), context);
  };
}

}  // namespace rilievo
