// rilievo.v1.ReconstructionService: two reactors over a ServiceCore.
#pragma once

#include <chrono>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "server/service_core.h"

namespace rilievo {

class ReconstructionService final : public v1::ReconstructionService::CallbackService {
 public:
  // `options` are valid; `log` may be empty.
  ReconstructionService(const ServerOptions& options, JobWork work, JobLog log);

  // The gRPC server is gone.
  ~ReconstructionService() override;

  grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>* Reconstruct(
      grpc::CallbackServerContext* context) override;

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::GetCapabilitiesResponse* response) override;

  // From now on new jobs are refused with UNAVAILABLE; those under way go on.
  void BeginDrain();

  // Stops what is under way.
  void StopAll();

  // Whether every call ended in time.
  bool WaitUntilIdle(std::chrono::milliseconds timeout);

 private:
  ServiceCore core_;
};

}  // namespace rilievo
