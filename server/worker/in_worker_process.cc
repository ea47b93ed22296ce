#include "server/worker/in_worker_process.h"

#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/paging/scratch_file.h"
#include "server/conversion/parts_request.h"
#include "server/os/unnamed_file.h"
#include "server/worker/message_channel.h"
#include "server/worker/parts_server.h"
#include "server/worker/run_worker_job.h"
#include "server/worker/worker_process.h"
#include "server/worker/worker_protocol.pb.h"

namespace rilievo {
namespace {

worker::JobOrder OrderOf(const JobRequest& job, const ScanBytes& points,
                         const WorkerSettings& settings) {
  worker::JobOrder order;
  if (job.parts) {
    order.set_part_points(job.parts->points);
    order.set_scratch_files(kFilesOfParts);
    order.set_scratch_bytes(EstimateScratch(job));
    order.set_shares_parts(job.parts->shared != nullptr);
    order.set_leads(job.parts->shared && job.parts->shared->leads());
  }
  order.set_version(RILIEVO_VERSION);
  *order.mutable_header() = job.header;
  order.set_max_surface_faces(job.options.max_surface_faces);
  order.set_threads(job.threads);
  order.set_memory_bytes(settings.memory_bytes);
  order.set_processor_seconds(settings.processor_seconds * job.threads);
  order.set_scan_sha256(points.sha256());
  return order;
}

// For a worker, which may make none. RESOURCE_EXHAUSTED where there is no room for what it may
// write.
absl::StatusOr<std::vector<FileDescriptor>> FilesFor(const JobRequest& job) {
  std::vector<FileDescriptor> files;
  if (!job.parts) return files;
  RILIEVO_RETURN_IF_ERROR(CheckRoom(job.parts->scratch, EstimateScratch(job)));
  for (int i = 0; i < kFilesOfParts; ++i) {
    RILIEVO_ASSIGN_OR_RETURN(files.emplace_back(), UnnamedFile(job.parts->scratch.path()));
  }
  return files;
}

// Whether a job that found no room failed for want of disk: to be asked while this process has its
// files open, or the disk has their room again.
bool IsDiskFull(const absl::Status& status, const JobRequest& job) {
  constexpr int64_t kSome = 16 << 20;
  return absl::IsResourceExhausted(status) && job.parts &&
         !CheckRoom(job.parts->scratch, kSome).ok();
}

// More than any surface has of both: a compromised worker must not fill this process.
constexpr int kMostChunks = 64;
constexpr uint64_t kMostPlainBytes = 64 << 20, kMostBytesOfFace = 8;

bool FitsSurface(const worker::Result& result, const JobRequest& job) {
  const uint64_t most =
      kMostPlainBytes + kMostBytesOfFace * static_cast<uint64_t>(job.options.max_surface_faces);
  uint64_t total = 0;
  for (const uint64_t bytes : result.chunk_bytes()) {
    if (bytes > most - total) return false;
    total += bytes;
  }
  return result.chunk_bytes_size() <= kMostChunks;
}

// What a worker may say of a job; the rest is said of this machine or of the worker, here.
bool IsOfJob(absl::StatusCode code) {
  return code > absl::StatusCode::kOk && code <= absl::StatusCode::kDataLoss &&
         code != absl::StatusCode::kAborted && code != absl::StatusCode::kUnavailable;
}

// What the worker says, in order. UNAVAILABLE where it cannot begin, DATA_LOSS where it makes no
// sense.
class Answer {
 public:
  explicit Answer(const JobRequest& job) : job_(job) {}

  bool ready() const { return ready_; }
  // OK: none yet.
  absl::Status failure() const { return failure_.value_or(absl::OkStatus()); }
  bool complete() const { return failure_ || (result_ && chunk_ == result_->chunk_bytes_size()); }

  absl::Status Take(worker::WorkerMessage message, const RunContext& context) {
    if (!ready_) return TakeReady(message);
    if (message.has_progress() && !result_) {
      const int stage = message.progress().stage();
      if (stage < 0 || stage >= kStageCount) return absl::DataLossError("no such stage");
      context.Report(static_cast<Stage>(stage), message.progress().fraction());
      return absl::OkStatus();
    }
    if (message.has_failure() && !result_) {
      const auto code = static_cast<absl::StatusCode>(message.failure().code());
      if (!IsOfJob(code)) return absl::DataLossError("a failure without a code of a job's");
      failure_ = WithPeakBytes(absl::Status(code, message.failure().text()),
                               message.failure().peak_bytes());
      return absl::OkStatus();
    }
    if (message.has_result() && !result_) {
      if (!FitsSurface(message.result(), job_)) {
        return absl::DataLossError("more chunks or bytes than a surface has");
      }
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
    result.peak_bytes = result_->peak_bytes();
    return result;
  }

 private:
  absl::Status TakeReady(const worker::WorkerMessage& message) {
    ready_ = message.has_ready() && message.ready().version() == RILIEVO_VERSION;
    if (ready_) return absl::OkStatus();
    if (message.has_failure()) return absl::UnavailableError(message.failure().text());
    return absl::UnavailableError(
        absl::StrCat("the worker is of ",
                     message.has_ready() ? absl::StrCat("version ", message.ready().version())
                                         : "another version",
                     ", the server of " RILIEVO_VERSION "; install both together"));
  }

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

  const JobRequest& job_;
  bool ready_ = false;
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

absl::Status OfMachine(const absl::Status& status) {
  return absl::UnavailableError(status.message());
}

absl::StatusOr<JobResult> Run(const WorkerProgram& program, const WorkerSettings& settings,
                              const JobRequest& job, ScanBytes points, const RunContext& context) {
  const worker::JobOrder order = OrderOf(job, points, settings);
  absl::StatusOr<FileDescriptor> file = std::move(points).TakeFile();
  if (!file.ok()) return OfMachine(file.status());
  absl::StatusOr<std::vector<FileDescriptor>> scratch = FilesFor(job);
  if (!scratch.ok()) return OfMachine(scratch.status());
  absl::StatusOr<WorkerProcess> started = WorkerProcess::Start(program, *file, *scratch);
  if (!started.ok()) return OfMachine(started.status());
  if (!job.parts) file->Close();  // it may be in memory
  WorkerProcess process = *std::move(started);
  // Ends the reads below; then the process is killed.
  std::optional<std::stop_callback<std::function<void()>>> stop;
  stop.emplace(context.stop, [&process] { process.Abandon(); });
  Answer answer(job);
  absl::Status status = SendMessage(process.socket(), order);
  if (absl::IsResourceExhausted(status)) return status;  // the order is too long to travel
  if (!status.ok()) {
    // A worker that did not wait for the order may have said why.
    process.Abandon();
    status = absl::OkStatus();
  }
  PartsServer parts(job, process.socket());
  absl::Status of_parts;
  while (status.ok() && of_parts.ok() && !answer.complete()) {
    worker::WorkerMessage message;
    status = ReceiveMessage(process.socket(), &message);
    if (!status.ok()) break;
    if (answer.ready() && parts.IsAsked(message)) {
      of_parts = parts.Answer(message);
    } else {
      status = answer.Take(std::move(message), context);
    }
  }
  stop.reset();
  const bool disk_full = IsDiskFull(answer.failure(), job);
  const int wait_status = process.End();
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (!of_parts.ok() && !parts.worker_is_gone()) return of_parts;
  if (absl::IsUnavailable(status)) return status;
  if (absl::IsDataLoss(status)) {
    return answer.ready() ? absl::InternalError(status.message()) : OfMachine(status);
  }
  if (disk_full) return OfMachine(answer.failure());
  if (answer.complete()) return std::move(answer).Finish();
  status = CauseOfEnd(wait_status, settings);
  return answer.ready() || absl::IsAborted(status) ? status : OfMachine(status);
}

}  // namespace

absl::StatusOr<JobWork> InWorkerProcess(WorkerSettings settings) {
  RILIEVO_ASSIGN_OR_RETURN(WorkerProgram program, WorkerProgram::Open(settings.program));
  return [program = std::move(program), settings = std::move(settings)](
             const JobRequest& job, ScanBytes points, const RunContext& context) {
    return Run(program, settings, job, std::move(points), context);
  };
}

}  // namespace rilievo
