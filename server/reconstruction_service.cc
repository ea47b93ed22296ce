#include "server/reconstruction_service.h"

#include <utility>

#include "server/reconstruct_call.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/refusal.h"

namespace rilievo {
namespace {

void FillLimits(const ServerOptions& options, v1::Limits* limits) {
  limits->set_max_points(static_cast<uint64_t>(options.max_points));
  limits->set_max_triangles(static_cast<uint64_t>(options.MaxTriangles()));
  limits->set_max_scan_bytes(static_cast<uint64_t>(options.max_scan_bytes));
  limits->set_max_message_bytes(kMaxMessageBytes);
  limits->set_max_chunk_bytes(kMaxChunkBytes);
  limits->set_max_control_faces(kMaxControlFaces);
  limits->set_max_surface_faces(static_cast<uint64_t>(options.max_surface_faces));
  limits->set_max_concurrent_jobs(static_cast<uint32_t>(options.max_concurrent_jobs));
  limits->set_max_queued_jobs(static_cast<uint32_t>(options.max_queued_jobs));
  limits->set_max_waiting_jobs(static_cast<uint32_t>(options.max_waiting_jobs));
  limits->set_max_threads(static_cast<uint32_t>(options.ThreadLimit()));
  limits->set_max_job_seconds(static_cast<double>(options.max_job_time.count()) / 1000);
  limits->set_max_idle_seconds(static_cast<double>(options.max_idle_time.count()) / 1000);
}

}  // namespace

grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>*
ReconstructionService::Reconstruct(grpc::CallbackServerContext* context) {
  Caller caller;
  if (const auto error = core_->AdmitStream(*context, &caller)) {
    return new Refusal<grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>>(
        GrpcStatus(*error));
  }
  return ReconstructCall::Begin(core_, disk_ ? &*disk_ : nullptr, context, std::move(caller));
}

grpc::ServerUnaryReactor* ReconstructionService::GetCapabilities(
    grpc::CallbackServerContext* context, const v1::GetCapabilitiesRequest* /*request*/,
    v1::GetCapabilitiesResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  Caller caller;
  if (const auto error = core_->door->Admit(*context, &caller)) {
    reactor->Finish(GrpcStatus(*error));
    return reactor;
  }
  response->set_server_version(RILIEVO_VERSION);
  FillLimits(core_->options, response->mutable_limits());
  response->add_coordinate_formats(v1::COORDINATE_FORMAT_FLOAT32_LE);
  response->add_coordinate_formats(v1::COORDINATE_FORMAT_FLOAT64_LE);
  for (const auto topology : {v1::TOPOLOGY_AUTO, v1::TOPOLOGY_PLANAR, v1::TOPOLOGY_SPHERICAL,
                              v1::TOPOLOGY_ARBITRARY, v1::TOPOLOGY_GIVEN}) {
    response->add_topologies(topology);
  }
  response->set_keeps_jobs(!core_->options.store.empty());
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace rilievo
