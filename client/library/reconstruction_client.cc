#include "client/library/reconstruction_client.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "client/library/status_conversion.h"
#include "client/library/surface_assembly.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"
#include "grpcpp/client_context.h"
#include "proto/keep_grpc_running.h"

namespace rilievo {
namespace {

// Large enough that messages cost little, small enough that progress and cancel are prompt.
constexpr int64_t kMessageBytes = 384 << 10;

void Prepare(const CallOptions& call, grpc::ClientContext* context) {
  if (call.timeout) context->set_deadline(std::chrono::system_clock::now() + *call.timeout);
}

// False when a write failed: the server has already answered, and the reader has its reason.
bool SendScan(const PointCloud& scan, const PointLayout& layout, v1::ReconstructHeader header,
              const std::function<void(int64_t)>& sent, ReconstructionClient::Stream* stream) {
  v1::ReconstructRequest request;
  *request.mutable_header() = std::move(header);
  if (!stream->Write(request)) return false;
  const int64_t step = kMessageBytes / layout.bytes();
  for (int64_t begin = 0; begin < scan.points.cols(); begin += step) {
    const int64_t end = std::min<int64_t>(begin + step, scan.points.cols());
    request.mutable_points()->set_data(PackPoints(scan, begin, end, layout));
    if (!stream->Write(request)) return false;
    if (sent) sent(end);
  }
  constexpr int64_t kTriangles = kMessageBytes / kTriangleBytes;
  for (int64_t begin = 0; begin < scan.triangles.cols(); begin += kTriangles) {
    const int64_t end = std::min<int64_t>(begin + kTriangles, scan.triangles.cols());
    request.mutable_triangles()->set_data(PackTriangles(scan, begin, end));
    if (!stream->Write(request)) return false;
  }
  return true;
}

bool SendBase(const std::vector<uint8_t>& dss, ReconstructionClient::Stream* stream) {
  v1::ReconstructRequest request;
  constexpr size_t kBytes = kMessageBytes;
  for (size_t at = 0; at < dss.size(); at += kBytes) {
    request.mutable_base()->set_data(dss.data() + at, std::min(kBytes, dss.size() - at));
    if (!stream->Write(request)) return false;
  }
  return true;
}

// The whole of a reconstruction.
void Send(const PointCloud& scan, const v1::ReconstructOptions& options,
          const std::function<void(int64_t)>& sent, ReconstructionClient::Stream* stream) {
  const PointLayout layout = LosslessLayout(scan);
  v1::ReconstructHeader header = HeaderOf(scan, layout);
  *header.mutable_options() = options;
  if (SendScan(scan, layout, std::move(header), sent, stream)) stream->WritesDone();
}

// Takes one answer into the result.
absl::Status Receive(v1::ReconstructResponse response, const ReconstructCallbacks& callbacks,
                     SurfaceAssembly* assembly, std::optional<v1::Summary>* summary) {
  if (*summary) return absl::DataLossError("an answer came after the summary");
  switch (response.message_case()) {
    case v1::ReconstructResponse::kProgress:
      if (callbacks.progress) callbacks.progress(response.progress());
      return absl::OkStatus();
    case v1::ReconstructResponse::kSurface:
      RILIEVO_RETURN_IF_ERROR(assembly->Begin(response.surface()));
      if (callbacks.surface) callbacks.surface(response.surface());
      return absl::OkStatus();
    case v1::ReconstructResponse::kPiece:
      RILIEVO_RETURN_IF_ERROR(assembly->Append(response.piece()));
      if (callbacks.piece) callbacks.piece(response.piece());
      return absl::OkStatus();
    case v1::ReconstructResponse::kSummary:
      *summary = std::move(*response.mutable_summary());
      return absl::OkStatus();
    case v1::ReconstructResponse::MESSAGE_NOT_SET:
      break;  // of a newer server
  }
  return absl::OkStatus();
}

absl::Status StatusOfCall(const grpc::Status& status, const CallOptions& call) {
  if (!status.ok() && call.stop.stop_requested()) {
    return absl::CancelledError("the caller asked to stop");
  }
  return StatusFromGrpc(status);
}

}  // namespace

ReconstructionClient::ReconstructionClient(const std::shared_ptr<grpc::ChannelInterface>& channel)
    : stub_(v1::ReconstructionService::NewStub(channel)) {
  PrepareToConnect();
}

absl::StatusOr<ReconstructResult> ReconstructionClient::Reconstruct(
    const PointCloud& scan, const v1::ReconstructOptions& options,
    const ReconstructCallbacks& callbacks, const CallOptions& call) const {
  return Call([&](Stream* stream) { Send(scan, options, callbacks.sent, stream); }, {}, callbacks,
              call);
}

absl::StatusOr<ReconstructResult> ReconstructionClient::Reconstruct(
    PointCloud&& scan, const v1::ReconstructOptions& options, const ReconstructCallbacks& callbacks,
    const CallOptions& call) const {
  const auto send = [&](Stream* stream) {
    Send(scan, options, callbacks.sent, stream);
    scan = PointCloud();
  };
  return Call(send, {}, callbacks, call);
}

absl::StatusOr<ReconstructResult> ReconstructionClient::Update(
    const PointCloud& scan, const UpdatedSurface& base, const ReconstructCallbacks& callbacks,
    const CallOptions& call) const {
  const auto send = [&](Stream* stream) {
    const PointLayout layout = LosslessLayout(scan);
    v1::ReconstructHeader header = HeaderOf(scan, layout);
    *header.mutable_base_surface() = ProtoBase(base);
    if (SendScan(scan, layout, std::move(header), callbacks.sent, stream) &&
        SendBase(base.dss, stream)) {
      stream->WritesDone();
    }
  };
  return Call(send, base.dss, callbacks, call);
}

absl::StatusOr<ReconstructResult> ReconstructionClient::Call(
    const std::function<void(Stream*)>& send, std::vector<uint8_t> known,
    const ReconstructCallbacks& callbacks, const CallOptions& call) const {
  grpc::ClientContext context;
  Prepare(call, &context);
  const std::stop_callback cancel(call.stop, [&context] { context.TryCancel(); });
  const auto stream = stub_->Reconstruct(&context);
  std::jthread writer([&] { send(stream.get()); });

  SurfaceAssembly assembly(std::move(known));
  std::optional<v1::Summary> summary;
  absl::Status received;
  v1::ReconstructResponse response;
  while (stream->Read(&response)) {
    received = Receive(std::move(response), callbacks, &assembly, &summary);
    if (!received.ok()) {
      context.TryCancel();
      break;
    }
    response.Clear();
  }
  // After the last read no write blocks: the call is over, or cancelled just above.
  writer.join();
  const grpc::Status finished = stream->Finish();
  RILIEVO_RETURN_IF_ERROR(received);
  RILIEVO_RETURN_IF_ERROR(StatusOfCall(finished, call));
  if (!summary) return absl::DataLossError("the answer ended without a summary");

  ReconstructResult result;
  result.chunk_bytes = assembly.chunk_bytes();
  RILIEVO_ASSIGN_OR_RETURN(result.dss, std::move(assembly).Finish());
  result.report = std::move(*summary->mutable_report());
  return result;
}

absl::StatusOr<v1::GetCapabilitiesResponse> ReconstructionClient::GetCapabilities(
    const CallOptions& call) const {
  grpc::ClientContext context;
  Prepare(call, &context);
  const std::stop_callback cancel(call.stop, [&context] { context.TryCancel(); });
  v1::GetCapabilitiesResponse response;
  const grpc::Status status = stub_->GetCapabilities(&context, {}, &response);
  RILIEVO_RETURN_IF_ERROR(StatusOfCall(status, call));
  return response;
}

}  // namespace rilievo
