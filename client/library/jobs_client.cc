#include "client/library/jobs_client.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/escaping.h"
#include "client/library/point_packing.h"
#include "client/library/status_conversion.h"
#include "client/library/surface_assembly.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"
#include "grpcpp/client_context.h"
#include "proto/keep_grpc_running.h"

namespace rilievo {
namespace {

constexpr size_t kChunkBytes = 256 << 10;
constexpr int kMaxUploads = 3;  // of a scan for one job
constexpr int kMostMovedOffsets = 3;

using Stub = v1::JobsService::StubInterface;

std::string Digest(const std::string& bytes) {
  Sha256 hash;
  hash.Add({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  const std::array<uint8_t, 32> digest = hash.Finish();
  return {digest.begin(), digest.end()};
}

}  // namespace

// The attempts at one thing, each with a context of its own.
struct JobsClient::Attempts {
  Attempts(const JobsClient& of, const CallOptions& call_options)
      : client(of),
        call(call_options),
        deadline(Deadline(call_options)),
        retry(of.retry_, deadline, call_options.stop) {}

  static std::optional<Retry::Clock::time_point> Deadline(const CallOptions& call) {
    if (!call.timeout) return std::nullopt;
    return Retry::Clock::now() + *call.timeout;
  }

  // `attempt(context, stub)` gives a grpc::Status.
  template <typename Attempt>
  absl::Status Once(const Attempt& attempt) {
    server = *client.server_;
    Stub* const stub = client.stubs_[server].get();
    grpc::ClientContext context;
    if (deadline) {
      context.set_deadline(std::chrono::system_clock::now() + (*deadline - Retry::Clock::now()));
    }
    const std::stop_callback cancel(call.stop, [&context] { context.TryCancel(); });
    const grpc::Status status = attempt(&context, stub);
    if (!status.ok() && call.stop.stop_requested()) {
      return absl::CancelledError("the caller asked to stop");
    }
    return StatusFromGrpc(status);
  }

  // Until it succeeds, or is not worth another attempt.
  template <typename Attempt>
  absl::Status Repeat(const Attempt& attempt) {
    for (;;) {
      const absl::Status status = Once(attempt);
      if (status.ok() || !Again(status)) return status;
    }
  }

  // Waits, unless another server can be asked at once; false when it is not worth another attempt.
  bool Again(const absl::Status& status) {
    if (!call.stop.stop_requested() && IsWorthARetry(status)) client.MoveOn(server);
    return retry.AfterFailure(status);
  }

  const JobsClient& client;
  size_t server = 0;  // of the latest attempt
  const CallOptions call;
  const std::optional<Retry::Clock::time_point> deadline;
  Retry retry;
};

PackedScan PackScan(const PointCloud& scan) {
  PackedScan packed;
  const PointLayout layout = LosslessLayout(scan);
  packed.header = HeaderOf(scan, layout);
  packed.bytes = PackPoints(scan, 0, scan.points.cols(), layout);
  packed.bytes += PackTriangles(scan, 0, scan.triangles.cols());
  packed.scan_id = absl::BytesToHexString(Digest(packed.bytes));
  return packed;
}

PackedScan PackUpdate(const PointCloud& scan, const UpdatedSurface& base) {
  PackedScan packed;
  const PointLayout layout = LosslessLayout(scan);
  packed.header = HeaderOf(scan, layout);
  *packed.header.mutable_base_surface() = ProtoBase(base);
  packed.bytes = PackPoints(scan, 0, scan.points.cols(), layout);
  packed.bytes.append(base.dss.begin(), base.dss.end());
  packed.scan_id = absl::BytesToHexString(Digest(packed.bytes));
  return packed;
}

JobsClient::JobsClient(const std::shared_ptr<grpc::ChannelInterface>& channel, RetryOptions retry)
    : JobsClient(std::vector<std::shared_ptr<grpc::ChannelInterface>>{channel}, retry) {}

JobsClient::JobsClient(const std::vector<std::shared_ptr<grpc::ChannelInterface>>& channels,
                       RetryOptions retry)
    : server_(std::make_unique<std::atomic<size_t>>(0)), retry_(retry) {
  PrepareToConnect();
  for (const auto& channel : channels) stubs_.push_back(v1::JobsService::NewStub(channel));
  retry_.servers = static_cast<int>(stubs_.size());
}

void JobsClient::MoveOn(size_t server) const {
  // Unless another thread has done so already.
  server_->compare_exchange_strong(server, (server + 1) % stubs_.size());
}

absl::Status JobsClient::UploadOnce(const PackedScan& scan, uint64_t offset,
                                    const std::function<void(int64_t)>& sent,
                                    Attempts* attempts) const {
  return attempts->Once([&](grpc::ClientContext* context, Stub* stub) {
    v1::UploadScanResponse response;
    const auto stream = stub->UploadScan(context, &response);
    v1::UploadScanRequest request;
    request.mutable_header()->set_upload_id(scan.scan_id);
    request.mutable_header()->set_offset(offset);
    request.mutable_header()->set_total_bytes(scan.bytes.size());
    bool open = stream->Write(request);
    for (size_t at = offset; open && at < scan.bytes.size(); at += kChunkBytes) {
      request.set_chunk(scan.bytes.substr(at, kChunkBytes));
      open = stream->Write(request);
      if (open && sent) sent(static_cast<int64_t>(std::min(at + kChunkBytes, scan.bytes.size())));
    }
    if (open) {
      request.mutable_end()->set_total_bytes(scan.bytes.size());
      request.mutable_end()->set_sha256(absl::HexStringToBytes(scan.scan_id));
      if (stream->Write(request)) stream->WritesDone();
    }
    // A write that failed means that the status is there already.
    return stream->Finish();
  });
}

absl::Status JobsClient::Upload(const PackedScan& scan, const std::function<void(int64_t)>& sent,
                                const CallOptions& call) const {
  Attempts attempts(*this, call);
  v1::GetUploadRequest query;
  query.set_upload_id(scan.scan_id);
  uint64_t known = 0;
  bool begun_anew = false, broken = false, overtaken = false;
  int moved_offsets = 0;
  for (;;) {
    v1::GetUploadResponse stored;
    RILIEVO_RETURN_IF_ERROR(attempts.Repeat([&](grpc::ClientContext* context, Stub* stub) {
      return stub->GetUpload(context, query, &stored);
    }));
    uint64_t offset = stored.stored_bytes();
    if (offset > known) attempts.retry.Progress();
    known = std::max(known, offset);
    if (offset > scan.bytes.size()) offset = 0;
    const absl::Status status = UploadOnce(scan, offset, sent, &attempts);
    if (status.ok()) return status;
    // What the server had was not what was sent: it has dropped it, and once more may be right.
    if (absl::IsDataLoss(status) && !begun_anew) {
      begun_anew = true;
      continue;
    }
    // It dropped it, or got more, after it was asked how much that was.
    if (absl::IsOutOfRange(status) && moved_offsets++ < kMostMovedOffsets) continue;
    // A broken stream of this very upload may reach the server after the one that goes on with it.
    if (absl::IsAborted(status) && broken && !overtaken) {
      overtaken = true;
      continue;
    }
    if (!attempts.Again(status)) return status;
    broken = true;
  }
}

absl::StatusOr<v1::Job> JobsClient::Create(const v1::CreateJobRequest& request,
                                           const CallOptions& call) const {
  v1::CreateJobResponse response;
  RILIEVO_RETURN_IF_ERROR(
      Attempts(*this, call).Repeat([&](grpc::ClientContext* context, Stub* stub) {
        return stub->CreateJob(context, request, &response);
      }));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::Job> JobsClient::Submit(const PackedScan& scan,
                                           const v1::ReconstructOptions& options,
                                           const std::string& request_id,
                                           const std::function<void(int64_t)>& sent,
                                           const CallOptions& call) const {
  v1::CreateJobRequest request;
  request.set_request_id(request_id);
  request.set_scan_id(scan.scan_id);
  *request.mutable_header() = scan.header;
  *request.mutable_header()->mutable_options() = options;
  // A few rounds: the same scan may be on its way from elsewhere, and the retention of a full
  // server may remove it between its upload and the job.
  Attempts attempts(*this, call);
  for (int uploads = 0;;) {
    absl::StatusOr<v1::Job> job = Create(request, call);
    if (!absl::IsNotFound(job.status()) || uploads == kMaxUploads) return job;
    const absl::Status uploaded = Upload(scan, sent, call);
    if (uploaded.ok()) {
      ++uploads;
    } else if (absl::IsAborted(uploaded) || absl::IsOutOfRange(uploaded)) {
      // Another stream of the same scan has taken over, or has just completed it.
      RILIEVO_RETURN_IF_ERROR(WaitForOther(scan, &attempts));
    } else {
      return uploaded;
    }
  }
}

absl::Status JobsClient::WaitForOther(const PackedScan& scan, Attempts* attempts) const {
  v1::GetUploadRequest query;
  query.set_upload_id(scan.scan_id);
  uint64_t before = 0;
  for (;;) {
    const absl::Status busy = absl::UnavailableError("the same scan is uploaded from elsewhere");
    if (!attempts->Again(busy)) return busy;
    v1::GetUploadResponse stored;
    RILIEVO_RETURN_IF_ERROR(attempts->Repeat([&](grpc::ClientContext* context, Stub* stub) {
      return stub->GetUpload(context, query, &stored);
    }));
    if (stored.stored_bytes() <= before) return absl::OkStatus();  // complete, or it stands still
    before = stored.stored_bytes();
    attempts->retry.Progress();
  }
}

absl::StatusOr<v1::Job> JobsClient::Get(const std::string& job_id, const CallOptions& call) const {
  v1::GetJobRequest request;
  request.set_job_id(job_id);
  v1::GetJobResponse response;
  RILIEVO_RETURN_IF_ERROR(
      Attempts(*this, call).Repeat([&](grpc::ClientContext* context, Stub* stub) {
        return stub->GetJob(context, request, &response);
      }));
  return std::move(*response.mutable_job());
}

absl::StatusOr<std::vector<v1::Job>> JobsClient::List(size_t limit, const CallOptions& call) const {
  Attempts attempts(*this, call);
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request;
  do {
    request.set_page_size(static_cast<uint32_t>(std::clamp<size_t>(limit - jobs.size(), 1, 1000)));
    v1::ListJobsResponse response;
    RILIEVO_RETURN_IF_ERROR(attempts.Repeat([&](grpc::ClientContext* context, Stub* stub) {
      return stub->ListJobs(context, request, &response);
    }));
    for (v1::Job& job : *response.mutable_jobs()) jobs.push_back(std::move(job));
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty() && jobs.size() < limit);
  return jobs;
}

absl::StatusOr<v1::Job> JobsClient::Watch(const std::string& job_id,
                                          const std::function<void(const v1::JobEvent&)>& event,
                                          const CallOptions& call) const {
  Attempts attempts(*this, call);
  v1::WatchJobRequest request;
  request.set_job_id(job_id);
  for (;;) {
    const absl::Status status = attempts.Once([&](grpc::ClientContext* context, Stub* stub) {
      const auto stream = stub->WatchJob(context, request);
      v1::WatchJobResponse response;
      while (stream->Read(&response)) {
        attempts.retry.Progress();
        request.set_after_sequence(response.event().sequence());
        if (event) event(response.event());
      }
      return stream->Finish();
    });
    if (status.ok()) return Get(job_id, call);
    if (!attempts.Again(status)) return status;
  }
}

absl::StatusOr<std::vector<uint8_t>> JobsClient::Fetch(
    const std::string& job_id, const std::function<void(const v1::SurfacePiece&)>& piece,
    const CallOptions& call, std::vector<uint8_t> known) const {
  Attempts attempts(*this, call);
  std::vector<uint8_t> bytes = std::move(known);
  v1::SurfaceHeader header;
  for (;;) {
    v1::StreamSurfaceRequest request;
    request.set_job_id(job_id);
    request.set_offset(bytes.size());
    bool gap = false;
    const absl::Status status = attempts.Once([&](grpc::ClientContext* context, Stub* stub) {
      const auto stream = stub->StreamSurface(context, request);
      v1::StreamSurfaceResponse response;
      while (!gap && stream->Read(&response)) {
        attempts.retry.Progress();
        if (response.has_surface()) header = response.surface();
        if (!response.has_piece()) continue;
        gap = response.piece().offset() != bytes.size();
        if (gap) continue;
        const std::string& data = response.piece().data();
        bytes.insert(bytes.end(), data.begin(), data.end());
        if (piece) piece(response.piece());
      }
      if (gap) context->TryCancel();
      return stream->Finish();
    });
    if (gap) return absl::DataLossError("the server left out a part of the surface");
    if (status.ok() && bytes.size() == header.total_bytes()) {
      RILIEVO_RETURN_IF_ERROR(CheckDigest(header, bytes));
      return bytes;
    }
    if (status.ok()) return absl::DataLossError("the server ended before the surface did");
    if (!attempts.Again(status)) return status;
  }
}

absl::StatusOr<v1::Job> JobsClient::Cancel(const std::string& job_id,
                                           const CallOptions& call) const {
  v1::CancelJobRequest request;
  request.set_job_id(job_id);
  v1::CancelJobResponse response;
  RILIEVO_RETURN_IF_ERROR(
      Attempts(*this, call).Repeat([&](grpc::ClientContext* context, Stub* stub) {
        return stub->CancelJob(context, request, &response);
      }));
  return std::move(*response.mutable_job());
}

absl::Status JobsClient::Delete(const std::string& job_id, const CallOptions& call) const {
  v1::DeleteJobRequest request;
  request.set_job_id(job_id);
  v1::DeleteJobResponse response;
  int calls = 0;
  const absl::Status status =
      Attempts(*this, call).Repeat([&](grpc::ClientContext* context, Stub* stub) {
        ++calls;
        return stub->DeleteJob(context, request, &response);
      });
  return calls > 1 && absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::Status JobsClient::DeleteScan(const std::string& scan_id, const CallOptions& call) const {
  v1::DeleteScanRequest request;
  request.set_scan_id(scan_id);
  v1::DeleteScanResponse response;
  int calls = 0;
  const absl::Status status =
      Attempts(*this, call).Repeat([&](grpc::ClientContext* context, Stub* stub) {
        ++calls;
        return stub->DeleteScan(context, request, &response);
      });
  return calls > 1 && absl::IsNotFound(status) ? absl::OkStatus() : status;
}

}  // namespace rilievo
