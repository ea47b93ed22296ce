// rilievo.v1.ReconstructionService: two reactors over a ServiceCore.
#pragma once

#include <optional>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "server/jobs/disk_pool.h"
#include "server/rpc/service_core.h"

namespace rilievo {

class ReconstructionService final : public v1::ReconstructionService::CallbackService {
 public:
  // `core` outlives this object.
  explicit ReconstructionService(ServiceCore* core) : core_(core) {
    if (!core_->options.scratch.empty()) disk_.emplace(kScratchThreads);
  }

  grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>* Reconstruct(
      grpc::CallbackServerContext* context) override;

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::GetCapabilitiesResponse* response) override;

  // Of the threads that put points into the scratch folder; null without one.
  const Heartbeat* disk_heart() const { return disk_ ? &disk_->heart() : nullptr; }

 private:
  static constexpr int kScratchThreads = 2;  // one slow write does not keep all others

  ServiceCore* const core_;
  std::optional<DiskPool> disk_;
};

}  // namespace rilievo
