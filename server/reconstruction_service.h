// rilievo.v1.ReconstructionService: two reactors over a ServiceCore.
#pragma once

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "server/rpc/service_core.h"

namespace rilievo {

class ReconstructionService final : public v1::ReconstructionService::CallbackService {
 public:
  // `core` outlives this object.
  explicit ReconstructionService(ServiceCore* core) : core_(core) {}

  grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>* Reconstruct(
      grpc::CallbackServerContext* context) override;

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::GetCapabilitiesResponse* response) override;

 private:
  ServiceCore* const core_;
};

}  // namespace rilievo
